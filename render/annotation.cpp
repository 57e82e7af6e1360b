#include "annotation.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "errors.h"
#include "ticks.h"

namespace anticrack {

namespace {

struct BarLabel {
  double position;  ///< 0 to 1 along the bar
  std::string text;
};

/// The two ends always, with the sign of what is clipped there, and round numbers between them; all over one
/// power of ten.
std::vector<BarLabel> bar_labels(const ColorScale& scale, int& exponent) {
  const Ticks ticks =
      scale.logarithmic ? logarithmic_ticks(scale.low, scale.high) : linear_ticks(scale.low, scale.high, 4);
  exponent = ticks.exponent;
  const double unit = std::pow(10, exponent);
  std::vector<BarLabel> labels{{0, (scale.clipped_low ? "\u2264 " : "") + number_label(scale.low / unit)},
                               {1, (scale.clipped_high ? "\u2265 " : "") + number_label(scale.high / unit)}};
  for (std::size_t i = 0; i < ticks.values.size(); ++i) {
    labels.push_back({scale.position(ticks.values[i]), ticks.labels[i]});
  }
  return labels;
}

std::string quantity_text(const Annotation& annotation) {
  int exponent = 0;
  bar_labels(annotation.scale, exponent);
  if (exponent == 0) return annotation.quantity;
  return annotation.quantity + "  (\u00d7" + power_of_ten(exponent) + ")";
}

}  // namespace

double round_length(double limit) {
  const double power = std::pow(10, std::floor(std::log10(limit) + 1e-9));
  const double digit = limit / power * (1 + 1e-9);
  return power * (digit >= 5 ? 5 : digit >= 2 ? 2 : 1);
}

std::string length_label(double metres) {
  const std::pair<double, const char*> units[] = {
      {1e3, "km"}, {1, "m"}, {1e-2, "cm"}, {1e-3, "mm"}, {1e-6, "\u00b5m"}};
  for (const auto& [size, name] : units) {
    if (metres >= size * (1 - 1e-9)) return number_label(metres / size) + " " + name;
  }
  return number_label(metres / 1e-9) + " nm";
}

AnnotationLayout layout_annotation(int width, int height, const Annotation& annotation, double text_size) {
  Canvas measuring(1, 1);
  AnnotationLayout layout;

  // Text follows the picture's size; narrow pictures shrink it until both columns of the strip have room.
  if (text_size == 0) text_size = std::clamp(std::min(width / 42.0, height / 48.0), 7.0, 60.0);
  for (double size = text_size;; size *= 0.94) {
    const double line = 1.02 * size;
    const double gap = 0.75 * size;
    const TextSize state = measuring.measure(annotation.state, size);
    const TextSize quantity = measuring.measure(quantity_text(annotation), size);
    int exponent = 0;
    double half_low = 0;
    double half_high = 0;
    for (const BarLabel& label : bar_labels(annotation.scale, exponent)) {
      const double half = measuring.measure(label.text, size).width / 2;
      if (label.position == 0) half_low = std::max(half_low, half);
      if (label.position == 1) half_high = std::max(half_high, half);
    }

    layout.text_size = size;
    layout.bar_length_limit = std::min(0.2 * width, 12 * size);
    const double left_width = std::max({state.width, layout.bar_length_limit, 6 * size});
    const double bar_left = gap + left_width + 2 * gap + half_low;
    const double bar_right = width - gap - half_high;
    const double bar_width = std::min(bar_right - bar_left, 24 * size);
    if ((bar_width < 8 * size || bar_right - bar_left + half_low < quantity.width) && size > 6) continue;

    // From the bottom upwards: numbers, bar, quantity. The left column keeps the same baselines.
    const double bottom = height - gap;
    const double bar_top = std::floor(bottom - line - 0.45 * size - 0.9 * size);
    layout.bar = {std::floor(bar_right - bar_width), bar_top, std::floor(bar_width), std::ceil(0.9 * size)};
    const double quantity_top = bar_top - 0.4 * size - line;
    layout.quantity = {layout.bar.x, quantity_top, quantity.width, line};
    if (layout.bar.x + quantity.width > width - gap) layout.quantity.x = width - gap - quantity.width;
    layout.color_bar = {layout.bar.x - half_low, bar_top, layout.bar.width + half_low + half_high,
                        bottom - bar_top};
    layout.state = {gap, quantity_top, state.width, line};
    layout.scale_bar = {gap, bar_top, left_width, bottom - bar_top};

    const double title_size = 1.15 * size;
    const double title_height = annotation.title.empty() ? 0 : 1.02 * title_size;
    layout.title = {gap, gap, measuring.measure(annotation.title, title_size).width, title_height};
    const double picture_top = title_height > 0 ? std::ceil(layout.title.y + title_height) : 0;
    layout.picture = {0, picture_top, double(width), std::floor(quantity_top - 0.5 * gap - picture_top)};
    break;
  }
  if (layout.picture.height < 16 || layout.picture.width < 16 || layout.bar.width < 8) {
    throw InputError(
        "picture of " + std::to_string(width) + " x " + std::to_string(height) +
        " pixels leaves no room for the sample beside its colour bar; expected at least 200 x 260");
  }
  return layout;
}

void draw_annotation_strip(Canvas& canvas, const AnnotationLayout& layout, double pixel_size,
                           const Annotation& annotation) {
  const double size = layout.text_size;
  const double ascent = canvas.measure("0", size).ascent;
  const double stroke = std::max(1.0, std::round(size / 14));

  if (!annotation.state.empty()) {
    canvas.text(layout.state.x, layout.state.y + ascent, annotation.state, size);
  }

  const double length = round_length(layout.bar_length_limit * pixel_size);
  const double length_pixels = length / pixel_size;
  const double middle = std::floor(layout.bar.y + layout.bar.height / 2);
  const double end = std::round(0.3 * size);
  canvas.fill(layout.scale_bar.x, middle, length_pixels, 2 * stroke, Canvas::ink);
  for (const double x : {layout.scale_bar.x, layout.scale_bar.x + length_pixels - stroke}) {
    canvas.fill(x, middle - end + stroke, stroke, 2 * end, Canvas::ink);
  }
  const double numbers = layout.color_bar.y + layout.color_bar.height - 1.02 * size + ascent;
  canvas.text(layout.scale_bar.x, numbers, length_label(length), size);

  // Column by column, so that a colour of the bar is exactly a colour of the map.
  const Rectangle& bar = layout.bar;
  Image strip(int(bar.width), int(bar.height));
  for (int column = 0; column < strip.width; ++column) {
    const Rgb8 color = annotation.scale.map->rgb(column / (strip.width - 1.0));
    for (int row = 0; row < strip.height; ++row) strip.at(column, row) = color;
  }
  canvas.picture(int(bar.x), int(bar.y), strip);
  canvas.frame(bar.x - 0.5 * stroke, bar.y - 0.5 * stroke, bar.width + stroke, bar.height + stroke, stroke);
  canvas.text(layout.quantity.x, layout.quantity.y + ascent, quantity_text(annotation), size);

  int exponent = 0;
  std::vector<std::array<double, 2>> taken;
  for (const BarLabel& label : bar_labels(annotation.scale, exponent)) {
    const double x = bar.x + label.position * bar.width;
    const double half = canvas.measure(label.text, size).width / 2 + 0.3 * size;
    const bool free = std::none_of(taken.begin(), taken.end(),
                                   [&](const auto& t) { return x - half < t[1] && t[0] < x + half; });
    if (!free) continue;
    taken.push_back({x - half, x + half});
    canvas.fill(std::round(x - 0.5 * stroke), bar.y + bar.height, stroke, 0.3 * size, Canvas::ink);
    canvas.text(x, numbers, label.text, size, 0.5);
  }
}

Image annotate(int width, int height, const Image& picture, double pixel_size, const Annotation& annotation) {
  const AnnotationLayout layout = layout_annotation(width, height, annotation);
  Canvas canvas(width, height);
  canvas.picture(int(layout.picture.x), int(layout.picture.y), picture);
  if (!annotation.title.empty()) {
    const double size = 1.15 * layout.text_size;
    canvas.text(layout.title.x, layout.title.y + canvas.measure("0", size).ascent, annotation.title, size);
  }
  draw_annotation_strip(canvas, layout, pixel_size, annotation);
  return canvas.image();
}

}  // namespace anticrack
