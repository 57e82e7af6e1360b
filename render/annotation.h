#pragma once

#include <string>

#include "camera.h"
#include "canvas.h"
#include "color_map.h"

namespace anticrack {

/// What stands around a picture. Texts may carry the canvas's markup.
struct Annotation {
  ColorScale scale;
  std::string quantity;  ///< with unit, e.g. "mean stress p [MPa]"
  std::string state;     ///< of loading, e.g. "ε_y = −11.0 %"; may be empty
  std::string title;     ///< may be empty
};

struct Rectangle {
  double x = 0, y = 0, width = 0, height = 0;
  bool overlaps(const Rectangle& o) const {
    return x < o.x + o.width && o.x < x + width && y < o.y + o.height && o.y < y + height;
  }
};

/// Where everything lies, from the measured texts: nothing overlaps the sample or its neighbour.
struct AnnotationLayout {
  double text_size = 0;
  Rectangle picture;                                       ///< whole pixels
  Rectangle title, state, scale_bar, color_bar, quantity;  ///< of the whole item with its text
  Rectangle bar;                                           ///< the coloured part of the colour bar
  double bar_length_limit = 0;  ///< [pixels] the scale bar is the longest round length below this
};

/// @param text_size  [pixels] at most; 0: follows the picture's size
/// @throws InputError  if width x height leaves no room for the picture
AnnotationLayout layout_annotation(int width, int height, const Annotation& annotation, double text_size = 0);

/// The picture with its margins. @param picture  of the size of layout.picture @param pixel_size [m]
Image annotate(int width, int height, const Image& picture, double pixel_size, const Annotation& annotation);

/// The strip of state, scale bar and colour bar below a picture or panel; `layout` says where.
void draw_annotation_strip(Canvas& canvas, const AnnotationLayout& layout, double pixel_size,
                           const Annotation& annotation);

/// Longest of 1, 2, 5 times a power of ten that is at most `limit` [m].
double round_length(double limit);

/// "20 cm", "5 m", "20 µm": with a unit that leaves a number from 1 to 999.
std::string length_label(double metres);

}  // namespace anticrack
