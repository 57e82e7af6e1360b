#include "panel.h"

#include <algorithm>
#include <cmath>

#include "errors.h"

namespace anticrack {

PanelLayout layout_panel(const Panel& panel, int picture_width, int picture_height) {
  const int columns = int(panel.column_titles.size());
  const int rows = int(panel.row_labels.size());
  if (columns < 1 || rows < 1) throw InputError("panel: expected at least one column and one row");

  PanelLayout layout;
  Canvas measuring(1, 1);
  // Small enough that the longest title fits its column and the longest label its row.
  double size = std::clamp(std::min(picture_width / 16.0, picture_height / 20.0), 9.0, 40.0);
  for (const std::string& title : panel.column_titles) {
    const double width = measuring.measure(title, size).width;
    if (width > 0.94 * picture_width) size *= 0.94 * picture_width / width;
  }
  for (const std::string& label : panel.row_labels) {
    const double width = measuring.measure(label, size).width;
    if (width > 0.94 * picture_height) size *= 0.94 * picture_height / width;
  }
  layout.text_size = size;
  const int gap = int(std::ceil(0.6 * size));
  const int left = int(std::ceil(gap + 1.2 * size + gap));
  const bool titled = !panel.annotation.title.empty();
  const int top = int(std::ceil(gap + (titled ? 1.9 * size : 0) + 1.3 * size));
  const int body_height = top + rows * (picture_height + gap);
  layout.width = left + columns * (picture_width + gap) + gap;

  // Only the strip of a picture's annotation is used, put below the last row.
  Annotation strip = panel.annotation;
  strip.title.clear();
  strip.state.clear();
  const int probe = 4096;
  layout.strip = layout_annotation(layout.width, probe, strip, size);
  const double shift = body_height + gap - layout.strip.quantity.y;
  for (Rectangle* r : {&layout.strip.state, &layout.strip.scale_bar, &layout.strip.color_bar,
                       &layout.strip.quantity, &layout.strip.bar}) {
    r->y = std::floor(r->y + shift);
  }
  layout.height = int(std::ceil(probe + shift));

  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      layout.pictures.push_back({double(left + column * (picture_width + gap)),
                                 double(top + row * (picture_height + gap)), double(picture_width),
                                 double(picture_height)});
    }
  }
  return layout;
}

Image compose_panel(const Panel& panel, const std::vector<Image>& pictures, double pixel_size) {
  const std::size_t columns = panel.column_titles.size();
  if (pictures.empty() || pictures.size() != columns * panel.row_labels.size()) {
    throw InputError("panel: got " + std::to_string(pictures.size()) + " pictures; expected " +
                     std::to_string(columns * panel.row_labels.size()));
  }
  for (const Image& picture : pictures) {
    if (picture.width != pictures[0].width || picture.height != pictures[0].height) {
      throw InputError("panel: pictures differ in size; expected one size");
    }
  }
  const PanelLayout layout = layout_panel(panel, pictures[0].width, pictures[0].height);
  const double size = layout.text_size;
  Canvas canvas(layout.width, layout.height);
  const double ascent = canvas.measure("0", size).ascent;
  if (!panel.annotation.title.empty()) {
    canvas.text(0.5 * layout.width, 0.6 * size + 1.25 * ascent, panel.annotation.title, 1.25 * size, 0.5);
  }
  for (std::size_t i = 0; i < pictures.size(); ++i) {
    const Rectangle& r = layout.pictures[i];
    canvas.picture(int(r.x), int(r.y), pictures[i]);
    if (i < columns) canvas.text(r.x + 0.5 * r.width, r.y - 0.35 * size, panel.column_titles[i], size, 0.5);
    if (i % columns == 0) {
      canvas.vertical_text(0.6 * size + ascent, r.y + 0.5 * r.height, panel.row_labels[i / columns], size);
    }
  }
  draw_annotation_strip(canvas, layout.strip, pixel_size, panel.annotation);
  return canvas.image();
}

}  // namespace anticrack
