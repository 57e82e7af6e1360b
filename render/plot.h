#pragma once

#include <array>
#include <string>
#include <variant>
#include <vector>

#include "canvas.h"

namespace anticrack {

enum class Marker { none, filled, hollow, cross };
enum class Stroke {
  thin,
  broad,  ///< light, behind all others
};

struct Curve {
  std::string label;  ///< in the legend; may be empty
  std::vector<double> x, y;
  std::vector<Marker> markers =
      {};  ///< one a point, or empty; a point at y = infinity stands at the upper edge
  Stroke stroke = Stroke::thin;
};

/// A triangle between two places of x, below the curves, that shows y ~ x^exponent; for logarithmic axes.
struct Slope {
  double x, y;  ///< its corner with the right angle's horizontal side
  double x_end;
  double exponent;
};

/// Curves over two axes. Texts may carry the canvas's markup; ranges follow from the data.
struct Plot {
  std::string x_label, y_label;
  std::vector<Curve> curves;
  bool log_x = false, log_y = false;  ///< values that are not positive are left out of a logarithmic axis
  std::vector<Slope> slopes = {};
  bool legend_beside = false;  ///< right of the frame instead of in one of its corners
  std::string title = {};      ///< above the frame; may be empty
  bool y_from_zero = false;    ///< the ordinate's range holds zero (linear axes)
};

/// The plot as a file: PNG at the given size in pixels, SVG and PDF as vectors with the same layout. No date
/// inside. Points with a value that is not finite break the line. The legend takes the corner that hides the
/// fewest points.
/// @throws InputError  if no curve has a finite point, or x, y and markers differ in length
std::string draw_plot(const Plot& plot, DocumentFormat format, int width = 1200, int height = 840,
                      const TextChunks& text = {});

/// Names and values, one pair a line.
using Table = std::vector<std::array<std::string, 2>>;

/// Plots and tables in rows, filled from the left.
struct Page {
  std::string title;
  std::vector<std::variant<Plot, Table>> cells;
  int columns = 2;
};

/// @param width  [pixels]; the height follows
/// @throws InputError  as above; or without cells or columns
std::string draw_page(const Page& page, DocumentFormat format, int width = 1800, const TextChunks& text = {});

}  // namespace anticrack
