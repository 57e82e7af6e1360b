#pragma once

#include <string>
#include <vector>

#include "annotation.h"

namespace anticrack {

/// Pictures side by side under one colour scale: rows are states (strains), columns are runs.
struct Panel {
  std::vector<std::string> column_titles;  ///< one a column
  std::vector<std::string> row_labels;     ///< one a row; read upwards at the left
  Annotation annotation;                   ///< its title stands above all, its state is not shown
};

struct PanelLayout {
  int width = 0, height = 0;        ///< of the whole panel [pixels]
  std::vector<Rectangle> pictures;  ///< row by row
  AnnotationLayout strip;
  double text_size = 0;
};

/// @param picture_width, picture_height  of every picture [pixels]
/// @throws InputError  without rows or columns
PanelLayout layout_panel(const Panel& panel, int picture_width, int picture_height);

/// @param pictures    row by row, all of one size, all with the same pixel size
/// @param pixel_size  [m]
/// @throws InputError  if their number or size does not fit
Image compose_panel(const Panel& panel, const std::vector<Image>& pictures, double pixel_size);

}  // namespace anticrack
