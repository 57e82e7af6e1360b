#include "plot.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "annotation.h"
#include "errors.h"
#include "ticks.h"

namespace anticrack {

namespace {

// Eight colours that stay apart for colour-blind readers and in grey (Wong 2011), black first; then darker
// ones.
constexpr Canvas::Color curve_colors[] = {{0.10, 0.10, 0.10}, {0.00, 0.45, 0.70}, {0.84, 0.37, 0.00},
                                          {0.00, 0.62, 0.45}, {0.80, 0.47, 0.65}, {0.34, 0.71, 0.91},
                                          {0.90, 0.62, 0.00}, {0.60, 0.55, 0.10}, {0.55, 0.10, 0.15},
                                          {0.35, 0.20, 0.60}, {0.55, 0.55, 0.55}, {0.00, 0.35, 0.30}};

constexpr Canvas::Color broad_color{0.87, 0.87, 0.87};

struct Axis {
  bool logarithmic = false;
  double low = INFINITY;
  double high = -INFINITY;

  bool shows(double v) const { return std::isfinite(v) && (!logarithmic || v > 0); }
  /// Where the axis is even.
  double scale(double v) const { return logarithmic ? std::log10(v) : v; }
  double share(double v) const { return (scale(v) - scale(low)) / (scale(high) - scale(low)); }

  void include(double v) {
    low = std::min(low, v);
    high = std::max(high, v);
  }
  /// A little air. A linear axis that starts at zero stays there; a logarithmic one covers a factor of four
  /// at least.
  void pad() {
    if (logarithmic) {
      const double decades = std::max(1.1 * std::log10(high / low), std::log10(4));
      const double middle = std::sqrt(low * high);
      low = middle * std::pow(10.0, -0.5 * decades);
      high = middle * std::pow(10.0, 0.5 * decades);
      return;
    }
    double air = 0.04 * (high - low);
    if (!(air > 0)) air = high != 0 ? 0.5 * std::abs(high) : 1;
    air = std::max(air, 1e-9 * std::max(std::abs(low), std::abs(high)));  // ticks need digits to differ in
    if (!(low >= 0 && low < 2 * air)) {
      low -= air;
    } else {
      low = 0;
    }
    high += air;
  }
  Ticks ticks(int count) const {
    return logarithmic ? logarithmic_ticks(low, high) : linear_ticks(low, high, count);
  }
};

struct Axes {
  Axis x, y;
  Rectangle box;

  bool shows(double px, double py) const { return x.shows(px) && y.shows(py); }
  std::array<double, 2> place(double px, double py) const {
    return {box.x + box.width * x.share(px), box.y + box.height * (1 - y.share(py))};
  }
};

std::string with_exponent(const std::string& label, int exponent) {
  return exponent == 0 ? label : label + "  (\u00d7" + power_of_ten(exponent) + ")";
}

/// Splits a curve at values that are not finite.
template <class Draw>
void for_each_stretch(const Curve& curve, const Axes& axes, Draw&& draw) {
  std::vector<std::array<double, 2>> stretch;
  for (std::size_t i = 0; i <= curve.x.size(); ++i) {
    if (i < curve.x.size() && axes.shows(curve.x[i], curve.y[i])) {
      stretch.push_back(axes.place(curve.x[i], curve.y[i]));
    } else if (!stretch.empty()) {
      draw(stretch);
      stretch.clear();
    }
  }
}

void draw_marker(Canvas& canvas, Marker marker, double x, double y, double radius, Canvas::Color color) {
  const double width = 0.45 * radius;
  switch (marker) {
    case Marker::none:
      return;
    case Marker::filled:
      return canvas.disc(x, y, radius, color);
    case Marker::hollow:
      canvas.disc(x, y, radius, color);
      return canvas.disc(x, y, radius - width, {1, 1, 1});
    case Marker::cross:
      canvas.line(x - radius, y - radius, x + radius, y + radius, width, color);
      return canvas.line(x - radius, y + radius, x + radius, y - radius, width, color);
  }
}

void draw_curve(Canvas& canvas, const Curve& curve, const Axes& axes, double size, Canvas::Color color) {
  if (curve.stroke == Stroke::broad) {
    for_each_stretch(curve, axes,
                     [&](const auto& points) { canvas.polyline(points, 0.9 * size, broad_color); });
    return;
  }
  for_each_stretch(curve, axes, [&](const auto& points) { canvas.polyline(points, size / 8, color); });
  for (std::size_t i = 0; i < curve.markers.size(); ++i) {
    const bool above = curve.y[i] == INFINITY;
    if (!axes.shows(curve.x[i], above ? axes.y.high : curve.y[i])) continue;
    auto [x, y] = axes.place(curve.x[i], above ? axes.y.high : curve.y[i]);
    if (above) y += 0.5 * size;
    draw_marker(canvas, curve.markers[i], x, y, size / 3.2, color);
  }
}

/// A right triangle whose hypotenuse has the slope, and the exponent beside it.
void draw_slope(Canvas& canvas, const Slope& slope, const Axes& axes, double size) {
  const double y_end = slope.y * std::pow(slope.x_end / slope.x, slope.exponent);
  if (!axes.shows(slope.x, slope.y) || !axes.shows(slope.x_end, y_end)) return;
  const auto corner = axes.place(slope.x, y_end), start = axes.place(slope.x, slope.y),
             end = axes.place(slope.x_end, y_end);
  const std::array<double, 2> around[] = {start, corner, end, start};
  canvas.polyline(around, size / 12, Canvas::ink);
  char text[32];
  std::snprintf(text, sizeof text, "%.2f", std::abs(slope.exponent));
  canvas.text(corner[0] - 0.3 * size, 0.5 * (corner[1] + start[1]) + 0.36 * size, text, 0.9 * size, 1);
}

struct Legend {
  double rows = 0, line = 0, sample = 0, width = 0, height = 0;

  Legend(const Canvas& canvas, const Plot& plot, double size) : line(1.35 * size), sample(2 * size) {
    double text_width = 0;
    for (const Curve& curve : plot.curves) {
      if (curve.label.empty()) continue;
      text_width = std::max(text_width, canvas.measure(curve.label, size).width);
      ++rows;
    }
    width = 0.6 * size + sample + 0.5 * size + text_width + 0.6 * size;
    height = rows * line + 0.5 * size;
  }
};

/// The corner of the frame with the fewest points of curves.
Rectangle emptiest_corner(const Legend& legend, const Plot& plot, const Axes& axes, double size) {
  Rectangle best;
  long fewest = -1;
  for (const auto& [right, low] : {std::array{0, 0}, std::array{1, 0}, std::array{1, 1}, std::array{0, 1}}) {
    const double inset = 0.6 * size;
    const Rectangle corner{right ? axes.box.x + axes.box.width - legend.width - inset : axes.box.x + inset,
                           low ? axes.box.y + axes.box.height - legend.height - inset : axes.box.y + inset,
                           legend.width, legend.height};
    long hidden = 0;
    for (const Curve& curve : plot.curves) {
      for_each_stretch(curve, axes, [&](const auto& points) {
        hidden += std::count_if(points.begin(), points.end(), [&](const auto& p) {
          return p[0] > corner.x && p[0] < corner.x + corner.width && p[1] > corner.y &&
                 p[1] < corner.y + corner.height;
        });
      });
    }
    if (fewest < 0 || hidden < fewest) {
      fewest = hidden;
      best = corner;
    }
  }
  return best;
}

void draw_legend(Canvas& canvas, const Legend& legend, const Plot& plot, const Rectangle& at, double size) {
  canvas.fill(at.x, at.y, at.width, at.height, {1, 1, 1});
  canvas.frame(at.x, at.y, at.width, at.height, 1, Canvas::faint);
  double y = at.y + 0.25 * size + 0.5 * legend.line;
  for (std::size_t i = 0; i < plot.curves.size(); ++i) {
    const Curve& curve = plot.curves[i];
    if (curve.label.empty()) continue;
    const double x = at.x + 0.6 * size;
    const bool broad = curve.stroke == Stroke::broad;
    canvas.line(x, y, x + legend.sample, y, broad ? 0.9 * size : size / 8,
                broad ? broad_color : curve_colors[i % std::size(curve_colors)]);
    canvas.text(x + legend.sample + 0.5 * size, y + 0.36 * size, curve.label, size);
    y += legend.line;
  }
}

/// Ranges of both axes from what the curves show. @throws InputError
Axes axes_of(const Plot& plot) {
  Axes axes;
  axes.x.logarithmic = plot.log_x;
  axes.y.logarithmic = plot.log_y;
  for (const Curve& curve : plot.curves) {
    if (!curve.markers.empty() && curve.markers.size() != curve.x.size()) {
      throw InputError("curve '" + curve.label + "': " + std::to_string(curve.markers.size()) +
                       " markers for " + std::to_string(curve.x.size()) +
                       " points; expected equally many or none");
    }
    if (curve.x.size() != curve.y.size()) {
      throw InputError("curve '" + curve.label + "': " + std::to_string(curve.x.size()) + " abscissas for " +
                       std::to_string(curve.y.size()) + " values; expected equally many");
    }
    for (std::size_t i = 0; i < curve.x.size(); ++i) {
      const bool above = !curve.markers.empty() && curve.y[i] == INFINITY;
      if (above && axes.x.shows(curve.x[i])) axes.x.include(curve.x[i]);
      if (!axes.shows(curve.x[i], curve.y[i])) continue;
      axes.x.include(curve.x[i]);
      axes.y.include(curve.y[i]);
    }
  }
  if (!(axes.y.low <= axes.y.high)) throw InputError("nothing to plot: no curve has a finite point");
  if (plot.y_from_zero) axes.y.include(0);
  axes.x.pad();
  axes.y.pad();
  return axes;
}

void draw_curves(Canvas& canvas, const Plot& plot, const Axes& axes, double size) {
  const Rectangle& box = axes.box;
  canvas.clipped(box.x, box.y, box.width, box.height, [&] {
    for (const Stroke stroke : {Stroke::broad, Stroke::thin}) {
      for (std::size_t i = 0; i < plot.curves.size(); ++i) {
        if (plot.curves[i].stroke != stroke) continue;
        draw_curve(canvas, plot.curves[i], axes, size, curve_colors[i % std::size(curve_colors)]);
      }
    }
    for (const Slope& slope : plot.slopes) draw_slope(canvas, slope, axes, size);
  });
}

double text_size(double width, double height) {
  return std::clamp(std::min(width / 42.0, height / 28.0), 8.0, 60.0);
}

/// A whole plot within a rectangle of the canvas.
void draw_plot(Canvas& canvas, const Plot& plot, const Rectangle& place) {
  Axes axes = axes_of(plot);
  const double size = text_size(place.width, place.height);
  const double ascent = canvas.measure("0", size).ascent;
  const Ticks x_ticks = axes.x.ticks(6);
  const Ticks y_ticks = axes.y.ticks(6);
  double number_width = 0;
  for (const std::string& label : y_ticks.labels) {
    number_width = std::max(number_width, canvas.measure(label, size).width);
  }

  // The box keeps what the measured labels leave.
  const double tick = 0.35 * size;
  const double gap = 0.5 * size;
  const double left = std::ceil(gap + 1.2 * size + gap + number_width + gap + tick);
  const double top = std::ceil(plot.title.empty() ? size : 2.4 * size);
  const double bottom = std::ceil(gap + 1.2 * size + gap + size + gap + tick);
  const Legend legend(canvas, plot, size);
  const double beside = plot.legend_beside && legend.rows > 0 ? legend.width + size : 0;
  axes.box = {place.x + left, place.y + top, std::floor(place.width - left - 1.6 * size - beside),
              std::floor(place.height - bottom - top)};
  const Rectangle& box = axes.box;
  if (box.width < 8 * size || box.height < 6 * size) {
    throw InputError("plot of " + std::to_string(int(place.width)) + " x " +
                     std::to_string(int(place.height)) +
                     " pixels leaves no room between its labels; expected at least 300 x 200");
  }

  // Faint grid, then curves, then the frame on top of both.
  for (const double v : x_ticks.values) {
    const double x = axes.place(v, axes.y.low)[0];
    canvas.line(x, box.y, x, box.y + box.height, size / 24, {0.91, 0.91, 0.91});
  }
  for (const double v : y_ticks.values) {
    const double y = axes.place(axes.x.low, v)[1];
    canvas.line(box.x, y, box.x + box.width, y, size / 24, {0.91, 0.91, 0.91});
  }
  draw_curves(canvas, plot, axes, size);
  canvas.frame(box.x, box.y, box.width, box.height, size / 14);
  for (std::size_t i = 0; i < x_ticks.values.size(); ++i) {
    const double x = axes.place(x_ticks.values[i], axes.y.low)[0];
    canvas.line(x, box.y + box.height, x, box.y + box.height + tick, size / 14);
    canvas.text(x, box.y + box.height + tick + gap + ascent, x_ticks.labels[i], size, 0.5);
  }
  for (std::size_t i = 0; i < y_ticks.values.size(); ++i) {
    const double y = axes.place(axes.x.low, y_ticks.values[i])[1];
    canvas.line(box.x - tick, y, box.x, y, size / 14);
    canvas.text(box.x - tick - gap, y + 0.36 * size, y_ticks.labels[i], size, 1);
  }
  if (!plot.title.empty()) canvas.text(box.x, place.y + 1.7 * size, plot.title, 1.1 * size);
  canvas.text(box.x + box.width / 2, place.y + place.height - gap - 0.25 * size,
              with_exponent(plot.x_label, x_ticks.exponent), 1.1 * size, 0.5);
  canvas.vertical_text(place.x + gap + ascent, box.y + box.height / 2,
                       with_exponent(plot.y_label, y_ticks.exponent), 1.1 * size);
  if (legend.rows > 0)
    draw_legend(canvas, legend, plot,
                beside > 0 ? Rectangle{box.x + box.width + size, box.y, legend.width, legend.height}
                           : emptiest_corner(legend, plot, axes, size),
                size);
}

void draw_table(Canvas& canvas, const Table& table, const Rectangle& place) {
  const double size =
      std::min(text_size(place.width, place.height), (place.height - 4) / (1.5 * double(table.size()) + 2));
  double y = place.y + 2.4 * size;
  for (const auto& [name, value] : table) {
    canvas.text(place.x + size, y, name, size);
    canvas.text(place.x + place.width - 1.6 * size, y, value, size, 1);
    canvas.line(place.x + size, y + 0.4 * size, place.x + place.width - 1.6 * size, y + 0.4 * size, size / 24,
                Canvas::faint);
    y += 1.5 * size;
  }
}

}  // namespace

std::string draw_plot(const Plot& plot, DocumentFormat format, int width, int height,
                      const TextChunks& text) {
  Canvas canvas(double(width), double(height), format);
  draw_plot(canvas, plot, {0, 0, double(width), double(height)});
  return canvas.document(text);
}

std::string draw_page(const Page& page, DocumentFormat format, int width, const TextChunks& text) {
  if (page.columns < 1 || page.cells.empty())
    throw InputError("page of " + std::to_string(page.cells.size()) + " cells in " +
                     std::to_string(page.columns) + " columns; expected at least one of each");
  const double cell_width = double(width) / page.columns, cell_height = std::floor(0.72 * cell_width);
  const double size = 1.3 * text_size(cell_width, cell_height), title_height = std::ceil(2.4 * size);
  const int rows = (int(page.cells.size()) + page.columns - 1) / page.columns;
  Canvas canvas(double(width), title_height + rows * cell_height, format);
  canvas.text(size, 1.7 * size, page.title, size);
  for (std::size_t n = 0; n < page.cells.size(); ++n) {
    const Rectangle place{cell_width * double(n % page.columns),
                          title_height + cell_height * double(n / page.columns), cell_width, cell_height};
    if (const auto* plot = std::get_if<Plot>(&page.cells[n])) draw_plot(canvas, *plot, place);
    if (const auto* table = std::get_if<Table>(&page.cells[n])) draw_table(canvas, *table, place);
  }
  return canvas.document(text);
}

}  // namespace anticrack
