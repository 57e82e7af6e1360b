#include "color_map.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

#include "errors.h"
#include "expect_error.h"

namespace anticrack {
namespace {

/// CIELAB lightness of linear sRGB under D65.
double lightness(const std::array<float, 3>& c) {
  const double Y = 0.2126729 * c[0] + 0.7151522 * c[1] + 0.0721750 * c[2];
  return 116 * (Y > 216.0 / 24389 ? std::cbrt(Y) : (24389.0 / 27 * Y + 16) / 116) - 16;
}

ColorScale scale_of(const std::vector<float>& values, const ScaleRequest& request) {
  ScaleChooser chooser(request);
  chooser.include(values);
  return chooser.choose();
}

TEST(ColorMap, StrainFallsLinearlyInLightnessFromLightToNearBlack) {
  const ColorMap& map = ColorMap::strain();
  const double first = lightness(map.linear_rgb(0));
  const double last = lightness(map.linear_rgb(1));
  EXPECT_GT(first, 90);
  EXPECT_LT(last, 12);
  for (int i = 1; i <= 256; ++i) {
    const double t = i / 256.0;
    EXPECT_LT(lightness(map.linear_rgb(t)), lightness(map.linear_rgb(t - 1 / 256.0))) << t;
    // Half a unit of lightness is below what an eye tells apart; larger departures would come from gamut
    // clipping.
    EXPECT_NEAR(lightness(map.linear_rgb(t)), first + t * (last - first), 0.5) << t;
  }
}

TEST(ColorMap, SignIsLightestAtZeroAndFallsEquallyOnBothSides) {
  const ColorMap& map = ColorMap::sign();
  EXPECT_GT(lightness(map.linear_rgb(0.5)), 94);
  for (int i = 1; i <= 128; ++i) {
    const double t = i / 256.0;
    EXPECT_LT(lightness(map.linear_rgb(0.5 + t)), lightness(map.linear_rgb(0.5 + t - 1 / 256.0))) << t;
    EXPECT_NEAR(lightness(map.linear_rgb(0.5 + t)), lightness(map.linear_rgb(0.5 - t)), 0.5) << t;
  }
  EXPECT_GT(lightness(map.linear_rgb(0)), 50) << "narrow: shading must stay visible at the ends";
  EXPECT_GT(map.linear_rgb(1)[0], 2 * map.linear_rgb(1)[2]) << "positive is red";
  EXPECT_GT(map.linear_rgb(0)[2], 2 * map.linear_rgb(0)[0]) << "negative is blue";
}

TEST(ColorScale, EndsAtTheRoundedPercentileAndSaysThatItClips) {
  std::vector<float> values(1001);
  std::iota(values.begin(), values.end(), 0.0f);
  const ColorScale scale = scale_of(values, {.percentile = 99});
  EXPECT_EQ(scale.low, 0);
  EXPECT_DOUBLE_EQ(scale.high, 990);
  EXPECT_TRUE(scale.clipped_high);
  EXPECT_FALSE(scale.clipped_low);
  EXPECT_FALSE(scale_of(values, {.percentile = 100}).clipped_high);
}

TEST(ColorScale, OfASignedQuantityIsSymmetric) {
  const ColorScale scale = scale_of({-3, 1, 2}, {.is_signed = true, .percentile = 100});
  EXPECT_DOUBLE_EQ(scale.low, -3);
  EXPECT_DOUBLE_EQ(scale.high, 3);
  EXPECT_DOUBLE_EQ(scale.position(0), 0.5);
  const ColorScale at_rest = scale_of({0, 0}, {.is_signed = true});
  EXPECT_GT(at_rest.high, 0);
  EXPECT_DOUBLE_EQ(at_rest.position(0), 0.5);
}

TEST(ColorScale, SharesTheWidestRangeOfASeries) {
  ScaleChooser chooser({.percentile = 100});
  chooser.include(std::vector<float>{0, 1});
  chooser.include(std::vector<float>{0, 5});
  chooser.include(std::vector<float>{0, 2});
  EXPECT_DOUBLE_EQ(chooser.choose().high, 5);
}

TEST(ColorScale, LogarithmicPutsTheGeometricMeanInTheMiddle) {
  const ColorScale scale = scale_of({0, 0.01f, 1}, {.logarithmic = true, .percentile = 100});
  EXPECT_DOUBLE_EQ(scale.low, 0.01);  // although 0.01f is a hair below
  EXPECT_NEAR(scale.position(0.1), 0.5, 1e-9);
  EXPECT_EQ(scale.position(0), 0);
}

TEST(ColorScale, FixedRangeHoldsWhateverTheValues) {
  const ColorScale scale = scale_of({-7, 12}, {.fixed = {{0, 1.5}}});
  EXPECT_EQ(scale.low, 0);
  EXPECT_EQ(scale.high, 1.5);
  EXPECT_TRUE(scale.clipped_low);
  EXPECT_TRUE(scale.clipped_high);
  EXPECT_TRUE(scale_of({1, 2}, {.logarithmic = true, .fixed = {{3, 4}}}).clipped_low);
}

TEST(ColorScale, OfAConstantHasSomeWidth) {
  const ColorScale scale = scale_of({0, 0}, {});
  EXPECT_GT(scale.high, scale.low);
}

TEST(ColorScale, RefusesWhatCannotBeAScale) {
  EXPECT_ERROR(ScaleChooser({.percentile = 0}), InputError, "percentile = 0; expected 0 < percentile <= 100");
  EXPECT_ERROR(ScaleChooser({.percentile = 101}), InputError,
               "percentile = 101; expected 0 < percentile <= 100");
  EXPECT_ERROR(ScaleChooser({.percentile = NAN}), InputError, "; expected 0 < percentile <= 100");
  EXPECT_ERROR(ScaleChooser({.fixed = {{1, 1}}}), InputError, "range = 1, 1; expected low < high");
  EXPECT_ERROR(ScaleChooser({.logarithmic = true, .fixed = {{0, 1}}}), InputError,
               "a logarithmic scale needs a positive low end");
  EXPECT_ERROR(ScaleChooser({.is_signed = true, .logarithmic = true}), InputError,
               "logarithmic scale: expected a quantity without sign");
  EXPECT_ERROR(scale_of({0, 0}, {.logarithmic = true}), InputError,
               "logarithmic scale: no value is positive");
}

}  // namespace
}  // namespace anticrack
