#include "color_map.h"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <string>

#include "embedded_assets.h"
#include "errors.h"
#include "ticks.h"

namespace anticrack {

namespace {

constexpr int table_size = 1024;

struct Lab {
  double L, a, b;
};

/// CIELAB under D65 to linear sRGB, clipped to the gamut.
std::array<float, 3> linear_from_lab(const Lab& lab) {
  const auto inverse = [](double f) {
    return f > 6.0 / 29 ? f * f * f : 3 * (6.0 / 29) * (6.0 / 29) * (f - 4.0 / 29);
  };
  const double fy = (lab.L + 16) / 116;
  const double X = 0.95047 * inverse(fy + lab.a / 500);
  const double Y = inverse(fy);
  const double Z = 1.08883 * inverse(fy - lab.b / 200);
  const double rgb[3] = {3.2404542 * X - 1.5371385 * Y - 0.4985314 * Z,
                         -0.9692660 * X + 1.8760108 * Y + 0.0415560 * Z,
                         0.0556434 * X - 0.2040259 * Y + 1.0572252 * Z};
  std::array<float, 3> linear;
  for (int c = 0; c < 3; ++c) linear[c] = float(std::clamp(rgb[c], 0.0, 1.0));
  return linear;
}

std::vector<Lab> parse_anchors(std::string_view csv) {
  std::istringstream lines{std::string(csv)};
  std::vector<Lab> anchors;
  for (std::string line; std::getline(lines, line);) {
    Lab lab{};
    if (std::sscanf(line.c_str(), "%lf,%lf,%lf", &lab.L, &lab.a, &lab.b) == 3) anchors.push_back(lab);
  }
  return anchors;
}

/// Smooth curve through equal steps of the piecewise-linear lightness; Catmull-Rom in a and b, linear in L.
Lab interpolate(const std::vector<Lab>& anchors, double s) {
  const int last = int(anchors.size()) - 1;
  const int i = std::clamp(int(s), 0, last - 1);
  const double t = s - i;
  const Lab& p1 = anchors[std::size_t(i)];
  const Lab& p2 = anchors[std::size_t(i + 1)];
  const Lab& p0 = anchors[std::size_t(std::max(i - 1, 0))];
  const Lab& p3 = anchors[std::size_t(std::min(i + 2, last))];
  const auto cubic = [t](double q0, double q1, double q2, double q3) {
    return q1 + 0.5 * t * (q2 - q0 + t * (2 * q0 - 5 * q1 + 4 * q2 - q3 + t * (3 * (q1 - q2) + q3 - q0)));
  };
  return {p1.L + t * (p2.L - p1.L), cubic(p0.a, p1.a, p2.a, p3.a), cubic(p0.b, p1.b, p2.b, p3.b)};
}

/// Away from zero (or towards it) to two significant digits; what single precision adds does not count.
double rounded(double value, bool away) {
  if (value == 0) return 0;
  const double unit = std::pow(10, std::floor(std::log10(std::abs(value))) - 1);
  const double digits = std::abs(value) / unit;
  return std::copysign(unit * (away ? std::ceil(digits - 1e-5) : std::floor(digits + 1e-5)), value);
}

double percentile_of(std::vector<float>& values, double percent) {
  const auto rank = std::size_t(std::lround(percent / 100 * double(values.size() - 1)));
  std::nth_element(values.begin(), values.begin() + std::ptrdiff_t(rank), values.end());
  return values[rank];
}

}  // namespace

ColorMap ColorMap::from_csv(std::string_view csv) {
  const std::vector<Lab> anchors = parse_anchors(csv);

  // Walk along the anchors at a constant rate of lightness, so that equal steps of the value look like equal
  // steps.
  std::vector<double> length{0};
  for (std::size_t i = 1; i < anchors.size(); ++i) {
    length.push_back(length.back() + std::abs(anchors[i].L - anchors[i - 1].L));
  }
  std::vector<std::array<float, 3>> table;
  for (int k = 0; k < table_size; ++k) {
    const double target = length.back() * k / (table_size - 1);
    std::size_t i = 1;
    while (i + 1 < length.size() && length[i] < target) ++i;
    const double s = double(i - 1) + (target - length[i - 1]) / (length[i] - length[i - 1]);
    table.push_back(linear_from_lab(interpolate(anchors, s)));
  }
  return ColorMap(std::move(table));
}

const ColorMap& ColorMap::strain() {
  static const ColorMap map = from_csv(embedded_strain_colors());
  return map;
}

const ColorMap& ColorMap::sign() {
  static const ColorMap map = from_csv(embedded_signed_colors());
  return map;
}

std::array<float, 3> ColorMap::linear_rgb(double t) const {
  const double s = std::clamp(t, 0.0, 1.0) * (table_size - 1);
  const auto i = std::min(std::size_t(s), std::size_t(table_size - 2));
  const float f = float(s - double(i));
  std::array<float, 3> rgb;
  for (std::size_t c = 0; c < 3; ++c) rgb[c] = table_[i][c] + f * (table_[i + 1][c] - table_[i][c]);
  return rgb;
}

Rgb8 ColorMap::rgb(double t) const {
  const auto c = linear_rgb(t);
  return {encode_srgb(c[0]), encode_srgb(c[1]), encode_srgb(c[2])};
}

double ColorScale::position(double value) const {
  if (!logarithmic) return std::clamp((value - low) / (high - low), 0.0, 1.0);
  if (value <= low) return 0;
  return std::min(std::log(value / low) / std::log(high / low), 1.0);
}

ScaleChooser::ScaleChooser(const ScaleRequest& request)
    : request_(request),
      smallest_(INFINITY),
      largest_(-INFINITY),
      low_(request.logarithmic ? INFINITY : 0),
      high_(0) {
  if (!(request.percentile > 0 && request.percentile <= 100)) {
    throw InputError("percentile = " + number_label(request.percentile) + "; expected 0 < percentile <= 100");
  }
  if (request.logarithmic && request.is_signed) {
    throw InputError("logarithmic scale: expected a quantity without sign");
  }
  if (!request.fixed) return;
  const auto [low, high] = *request.fixed;
  if (!(high > low) || !std::isfinite(high - low)) {
    throw InputError("range = " + number_label(low) + ", " + number_label(high) + "; expected low < high");
  }
  if (request.logarithmic && !(low > 0)) {
    throw InputError("range = " + number_label(low) + ", " + number_label(high) +
                     "; a logarithmic scale needs a positive low end");
  }
}

void ScaleChooser::include(std::span<const float> values) {
  std::vector<float> kept;
  kept.reserve(values.size());
  for (const float v : values) {
    smallest_ = std::min(smallest_, double(v));
    largest_ = std::max(largest_, double(v));
    const float measure = request_.is_signed ? std::abs(v) : v;
    if (!request_.logarithmic || measure > 0) kept.push_back(measure);
  }
  if (kept.empty() || request_.fixed) return;
  high_ = std::max(high_, percentile_of(kept, request_.percentile));
  low_ = std::min(low_, percentile_of(kept, 100 - request_.percentile));
}

ColorScale ScaleChooser::choose() const {
  ColorScale scale;
  scale.map = request_.is_signed ? &ColorMap::sign() : &ColorMap::strain();
  scale.logarithmic = request_.logarithmic;
  if (request_.fixed) {
    scale.low = (*request_.fixed)[0];
    scale.high = (*request_.fixed)[1];
  } else {
    scale.high = rounded(high_, high_ > 0);
    scale.low = request_.is_signed ? -scale.high : rounded(low_, low_ < 0);
    if (scale.logarithmic) {
      if (!(high_ > 0)) throw InputError("logarithmic scale: no value is positive");
      scale.low = rounded(std::max(low_, 1e-4 * high_), false);
    }
    // A quantity that is the same everywhere still needs a bar of some width.
    if (!(scale.high > scale.low)) scale.high = scale.low + (scale.low != 0 ? std::abs(scale.low) : 1);
    if (request_.is_signed) scale.low = -scale.high;
  }
  // What lies below a logarithmic bar that nobody asked for is mostly zeros: small by nature, not cut off.
  scale.clipped_low = smallest_ < scale.low && (request_.fixed || !scale.logarithmic);
  scale.clipped_high = largest_ > scale.high;
  return scale;
}

}  // namespace anticrack
