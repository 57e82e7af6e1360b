#pragma once

#include <array>
#include <optional>
#include <span>
#include <vector>

#include "image.h"

namespace anticrack {

/// A colour table over [0, 1], smooth in CIELAB. Built once from the anchors in assets/colormaps.
class ColorMap {
 public:
  static const ColorMap& strain();  ///< light sand to near-black violet, linear in lightness
  static const ColorMap& sign();    ///< blue - light grey - red, zero in the middle

  std::array<float, 3> linear_rgb(double t) const;  ///< linear light; t is clipped to [0, 1]
  Rgb8 rgb(double t) const;                         ///< sRGB
  const std::vector<std::array<float, 3>>& table() const {
    return table_;
  }  ///< linear light, evenly spaced in t

 private:
  explicit ColorMap(std::vector<std::array<float, 3>> table) : table_(std::move(table)) {}
  static ColorMap from_csv(std::string_view csv);
  std::vector<std::array<float, 3>> table_;
};

/// How values become colours; shared by every picture of a series.
struct ColorScale {
  const ColorMap* map = nullptr;
  double low = 0;
  double high = 1;  ///< > low; low > 0 where logarithmic
  bool logarithmic = false;
  bool clipped_low = false;  ///< some value lies below low: the colour bar says so
  bool clipped_high = false;

  double position(double value) const;  ///< in [0, 1]
};

/// What fixes a scale. A signed quantity gets the diverging map and a range that is symmetric about zero.
struct ScaleRequest {
  bool is_signed = false;
  bool logarithmic = false;
  double percentile = 99.5;                      ///< of |value| (signed) or value; in (0, 100]
  std::optional<std::array<double, 2>> fixed{};  ///< low, high
};

/// Finds the scale of a series: include the values of every frame, then choose.
///
/// Not signed: from min(0, low percentile) to the percentile, the widest of all frames; signed: symmetric
/// about zero. Logarithmic: the low end is the (100 - percentile) percentile of the positive values, at most
/// four decades below the high end. Ends that are not fixed are rounded outwards to two digits, so that the
/// bar ends at numbers one can read.
class ScaleChooser {
 public:
  /// @throws InputError  for a percentile or fixed range out of bounds, or a signed quantity on a logarithmic
  /// scale
  explicit ScaleChooser(const ScaleRequest& request);
  void include(std::span<const float> values);
  /// @throws InputError  for a logarithmic scale without positive values
  ColorScale choose() const;

 private:
  ScaleRequest request_;
  double smallest_, largest_;  ///< of all values
  double low_, high_;          ///< widest percentiles
};

}  // namespace anticrack
