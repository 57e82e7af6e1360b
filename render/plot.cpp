#include "plot.h"

#include <algorithm>
#include <cmath>

#include "annotation.h"
#include "errors.h"
#include "ticks.h"

namespace anticrack {

namespace {

// Eight colours that stay apart for colour-blind readers and in grey (Wong 2011), black first.
constexpr Canvas::Color curve_colors[] = {{0.10, 0.10, 0.10}, {0.00, 0.45, 0.70}, {0.84, 0.37, 0.00},
                                          {0.00, 0.62, 0.45}, {0.80, 0.47, 0.65}, {0.34, 0.71, 0.91},
                                          {0.90, 0.62, 0.00}, {0.60, 0.55, 0.10}};

struct Range {
  double low = INFINITY;
  double high = -INFINITY;

  void include(double v) {
    low = std::min(low, v);
    high = std::max(high, v);
  }
  /// A little air, but an axis that starts at zero stays there.
  void pad() {
    double air = 0.04 * (high - low);
    if (!(air > 0)) air = high != 0 ? 0.5 * std::abs(high) : 1;
    if (!(low >= 0 && low < 2 * air)) {
      low -= air;
    } else {
      low = 0;
    }
    high += air;
  }
};

struct Axes {
  Range x, y;
  Rectangle box;

  std::array<double, 2> place(double px, double py) const {
    return {box.x + box.width * (px - x.low) / (x.high - x.low),
            box.y + box.height * (y.high - py) / (y.high - y.low)};
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
    if (i < curve.x.size() && std::isfinite(curve.x[i]) && std::isfinite(curve.y[i])) {
      stretch.push_back(axes.place(curve.x[i], curve.y[i]));
    } else if (!stretch.empty()) {
      draw(stretch);
      stretch.clear();
    }
  }
}

void draw_legend(Canvas& canvas, const Plot& plot, const Axes& axes, double size) {
  double text_width = 0;
  double rows = 0;
  for (const Curve& curve : plot.curves) {
    if (curve.label.empty()) continue;
    text_width = std::max(text_width, canvas.measure(curve.label, size).width);
    ++rows;
  }
  if (rows == 0) return;
  const double line = 1.35 * size;
  const double sample = 2 * size;
  const double width = 0.6 * size + sample + 0.5 * size + text_width + 0.6 * size;
  const double height = rows * line + 0.5 * size;

  // The corner with the fewest points of curves.
  Rectangle best;
  long fewest = -1;
  for (const auto& [right, low] : {std::array{0, 0}, std::array{1, 0}, std::array{1, 1}, std::array{0, 1}}) {
    const double inset = 0.6 * size;
    const Rectangle corner{right ? axes.box.x + axes.box.width - width - inset : axes.box.x + inset,
                           low ? axes.box.y + axes.box.height - height - inset : axes.box.y + inset, width,
                           height};
    long hidden = 0;
    for (const Curve& curve : plot.curves) {
      for_each_stretch(curve, axes, [&](const auto& points) {
        hidden += std::count_if(points.begin(), points.end(), [&](const auto& p) {
          return p[0] > corner.x && p[0] < corner.x + width && p[1] > corner.y && p[1] < corner.y + height;
        });
      });
    }
    if (fewest < 0 || hidden < fewest) {
      fewest = hidden;
      best = corner;
    }
  }

  canvas.fill(best.x, best.y, best.width, best.height, {1, 1, 1});
  canvas.frame(best.x, best.y, best.width, best.height, 1, Canvas::faint);
  double y = best.y + 0.25 * size + 0.5 * line;
  for (std::size_t i = 0; i < plot.curves.size(); ++i) {
    const Curve& curve = plot.curves[i];
    if (curve.label.empty()) continue;
    const double x = best.x + 0.6 * size;
    canvas.line(x, y, x + sample, y, size / 8, curve_colors[i % std::size(curve_colors)]);
    canvas.text(x + sample + 0.5 * size, y + 0.36 * size, curve.label, size);
    y += line;
  }
}

}  // namespace

std::string draw_plot(const Plot& plot, DocumentFormat format, int width, int height,
                      const TextChunks& text) {
  Axes axes;
  for (const Curve& curve : plot.curves) {
    if (curve.x.size() != curve.y.size()) {
      throw InputError("curve '" + curve.label + "': " + std::to_string(curve.x.size()) + " abscissas for " +
                       std::to_string(curve.y.size()) + " values; expected equally many");
    }
    for (std::size_t i = 0; i < curve.x.size(); ++i) {
      if (!std::isfinite(curve.x[i]) || !std::isfinite(curve.y[i])) continue;
      axes.x.include(curve.x[i]);
      axes.y.include(curve.y[i]);
    }
  }
  if (!(axes.x.low <= axes.x.high)) throw InputError("nothing to plot: no curve has a finite point");
  axes.x.pad();
  axes.y.pad();

  Canvas canvas(double(width), double(height), format);
  const double size = std::clamp(std::min(width / 42.0, height / 28.0), 8.0, 60.0);
  const double ascent = canvas.measure("0", size).ascent;
  const Ticks x_ticks = linear_ticks(axes.x.low, axes.x.high, 6);
  const Ticks y_ticks = linear_ticks(axes.y.low, axes.y.high, 6);
  double number_width = 0;
  for (const std::string& label : y_ticks.labels) {
    number_width = std::max(number_width, canvas.measure(label, size).width);
  }

  // The box keeps what the measured labels leave.
  const double tick = 0.35 * size;
  const double gap = 0.5 * size;
  const double left = std::ceil(gap + 1.2 * size + gap + number_width + gap + tick);
  const double bottom = std::ceil(gap + 1.2 * size + gap + size + gap + tick);
  axes.box = {left, std::ceil(size), std::floor(width - left - 1.6 * size),
              std::floor(height - bottom - size)};
  if (axes.box.width < 8 * size || axes.box.height < 6 * size) {
    throw InputError("plot of " + std::to_string(width) + " x " + std::to_string(height) +
                     " pixels leaves no room between its labels; expected at least 300 x 200");
  }
  const Rectangle& box = axes.box;

  // Faint grid, then curves, then the frame on top of both.
  for (const double v : x_ticks.values) {
    const double x = axes.place(v, axes.y.low)[0];
    canvas.line(x, box.y, x, box.y + box.height, size / 24, {0.91, 0.91, 0.91});
  }
  for (const double v : y_ticks.values) {
    const double y = axes.place(axes.x.low, v)[1];
    canvas.line(box.x, y, box.x + box.width, y, size / 24, {0.91, 0.91, 0.91});
  }
  canvas.clipped(box.x, box.y, box.width, box.height, [&] {
    for (std::size_t i = 0; i < plot.curves.size(); ++i) {
      for_each_stretch(plot.curves[i], axes, [&](const auto& points) {
        canvas.polyline(points, size / 8, curve_colors[i % std::size(curve_colors)]);
      });
    }
  });
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
  canvas.text(box.x + box.width / 2, height - gap - 0.25 * size,
              with_exponent(plot.x_label, x_ticks.exponent), 1.1 * size, 0.5);
  canvas.vertical_text(gap + ascent, box.y + box.height / 2, with_exponent(plot.y_label, y_ticks.exponent),
                       1.1 * size);
  draw_legend(canvas, plot, axes, size);
  return canvas.document(text);
}

}  // namespace anticrack
