#pragma once

#include <string>
#include <vector>

#include "canvas.h"

namespace anticrack {

struct Curve {
  std::string label;  ///< in the legend; may be empty
  std::vector<double> x, y;
};

/// Curves over two axes. Texts may carry the canvas's markup; ranges follow from the data.
struct Plot {
  std::string x_label, y_label;
  std::vector<Curve> curves;
};

/// The plot as a file: PNG at the given size in pixels, SVG and PDF as vectors with the same layout. No date
/// inside. Points with a value that is not finite break the line. The legend takes the corner that hides the
/// fewest points.
/// @throws InputError  if no curve has a finite point, or x and y differ in length
std::string draw_plot(const Plot& plot, DocumentFormat format, int width = 1200, int height = 840,
                      const TextChunks& text = {});

}  // namespace anticrack
