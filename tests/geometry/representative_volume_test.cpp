#include "measures/representative_volume.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>

#include "errors.h"
#include "expect_error.h"
#include "fields/random_stream.h"
#include "measured_shapes.h"

namespace anticrack {
namespace {

TEST(RepresentativeVolume, TakesTheShortestSideInParts) {
  const PhaseImage image{{131, 262, 140}, 1, {}};
  EXPECT_EQ(sub_box_edges(image), (std::vector<int>{65, 43, 32, 21, 16, 10, 8, 5, 4}));
  EXPECT_EQ(sub_box_edges(image, 20), (std::vector<int>{65, 43, 32, 21}));
}

TEST(RepresentativeVolume, StatisticsOfKnownCubesAreExact) {
  // 4 x 2 x 3 cubes with an edge of 5, and a rest; cube n along x has n full layers of 5.
  const PhaseImage image =
      image_of({22, 11, 15}, 1, [](const Vec3& x) { return x[0] < 20 && int(x[1]) % 5 < int(x[0]) / 5; });
  const int edges[] = {5};
  const auto curve = sub_box_solid_fractions(image, edges);
  EXPECT_EQ(curve[0].boxes, 24);
  EXPECT_DOUBLE_EQ(curve[0].mean, (0 + 1 + 2 + 3) / 4.0 / 5);
  EXPECT_DOUBLE_EQ(curve[0].standard_deviation, std::sqrt(6 * (9 + 1 + 1 + 9) / 4.0 / 23) / 5);

  const auto counted = sub_box_measure(image, edges, [](const PhaseImage& cube) {
    EXPECT_EQ(cube.size, (Index3{5, 5, 5}));
    double solid = 0;
    for (std::uint8_t voxel : cube.solid) solid += voxel;
    return solid;
  });
  EXPECT_DOUBLE_EQ(counted[0].mean, 125 * curve[0].mean);
  EXPECT_DOUBLE_EQ(counted[0].standard_deviation, 125 * curve[0].standard_deviation);
}

TEST(RepresentativeVolume, FitFindsAPowerLaw) {
  std::vector<SubBoxStatistics> curve;
  for (int edge : {40, 20, 10})  // variance = 2e-4 V^-0.9, V in m^3, voxels of 0.01 m
    curve.push_back({edge, 8, 0.3, std::sqrt(2e-4 * std::pow(std::pow(0.01 * edge, 3), -0.9))});
  const auto fit = fit_representative_volume(curve, 0.01);
  EXPECT_NEAR(fit.exponent, 0.9, 1e-12);
  EXPECT_NEAR(fit.scale, 2e-4, 1e-15);
  // 2 standard deviations over the mean are 5 % where V^-0.9 = (0.025 0.3)^2 / 2e-4.
  EXPECT_NEAR(fit.edge_for_relative_error(0.05), std::pow(std::pow(0.0075, 2) / 2e-4, -1 / 2.7), 1e-12);
}

TEST(RepresentativeVolume, FitLeavesOutCubesBelowAThirdOfTheLargest) {
  const SubBoxStatistics curve[] = {{30, 8, 1, 0.1}, {15, 64, 1, 0.2}, {10, 216, 1, 0.3}, {9, 343, 7, 50}};
  const auto fit = fit_representative_volume(curve, 1),
             without = fit_representative_volume(std::span(curve, 3), 1);
  EXPECT_EQ(fit.exponent, without.exponent);
  EXPECT_EQ(fit.scale, without.scale);
  EXPECT_EQ(fit.mean, 1);
}

TEST(RepresentativeVolume, OfIndependentVoxelsHasTheRangeOfOneVoxel) {
  RandomStream random(2, 0);
  const PhaseImage image =
      image_of({144, 144, 144}, 0.5, [&](const Vec3&) { return random.uniform() < 0.3; });
  const std::vector<int> edges{24, 16, 12, 8};
  const auto curve = sub_box_solid_fractions(image, edges);
  // The variance of n values scatters by sqrt(2/n): 1.5 % for all 8505 cubes together. Five times.
  const auto fit = fit_representative_volume(curve, image.voxel_size, false);
  EXPECT_NEAR(fit.scale / (0.3 * 0.7), 0.125, 5 * 0.015 * 0.125);
  EXPECT_EQ(fit.exponent, 1);
  // sqrt(2 / sum of n (x - mean)^2), x = log volume: 1.9 %.
  EXPECT_NEAR(fit_representative_volume(curve, image.voxel_size).exponent, 1, 5 * 0.019);
}

TEST(RepresentativeVolume, OfACutHasTheVarianceOfTheTheory) {
  constexpr int samples = 8;
  const SampleLattice lattice{{96, 96, 96}, 1.0 / 96};
  GaussianRandomFieldSpec spec{.waves = 10000, .wavelengths_per_side = 9, .heterogeneity = 50, .seed = 0};
  const FieldTheory theory{Morphology::single_cut, 0.34, GammaSpectrum::of(spec, 1)};
  const std::vector<int> edges{24, 16, 12, 8};
  std::vector<double> variance(edges.size(), 0.0);
  for (spec.seed = 1; spec.seed <= samples; ++spec.seed) {
    const auto curve = sub_box_solid_fractions(image_of_field(lattice, spec, 0.34), edges);
    for (std::size_t n = 0; n < edges.size(); ++n)
      variance[n] += std::pow(curve[n].standard_deviation, 2) / samples;
  }
  const double whole = solid_fraction_variance(theory, 96, lattice.spacing);
  for (std::size_t n = 0; n < edges.size(); ++n) {
    // Cubes scatter about their own sample's fraction, which takes its variance away.
    const double boxes = std::pow(96 / edges[n], 3);
    const double expected =
        (solid_fraction_variance(theory, edges[n], lattice.spacing) - whole) * boxes / (boxes - 1);
    // Four standard errors of a variance of normal values; those of small cubes have shorter tails.
    EXPECT_NEAR(variance[n], expected, 4 * std::sqrt(2 / (samples * boxes)) * expected) << edges[n];
  }
}

TEST(RepresentativeVolume, HasTheSameBitsOnAnyNumberOfThreads) {
  RandomStream random(4, 0);
  const PhaseImage image = image_of({50, 40, 60}, 1, [&](const Vec3&) { return random.uniform() < 0.6; });
  const auto on = [&](int threads) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, std::size_t(threads));
    return sub_box_solid_fractions(image, sub_box_edges(image));
  };
  const auto one = on(1), two = on(2), five = on(5);
  for (std::size_t n = 0; n < one.size(); ++n) {
    EXPECT_EQ(one[n].standard_deviation, two[n].standard_deviation);
    EXPECT_EQ(one[n].standard_deviation, five[n].standard_deviation);
  }
}

TEST(RepresentativeVolume, RefusesWhatHasNoScatter) {
  const PhaseImage image = image_of({10, 10, 10}, 1, [](const Vec3&) { return true; });
  const int too_large[] = {6}, none[] = {0}, half[] = {5};
  EXPECT_ERROR(sub_box_solid_fractions(image, too_large), InputError, "leaves two boxes or more");
  EXPECT_ERROR(sub_box_solid_fractions(image, none), InputError, "an edge of 0 voxels; expected >= 1");
  const auto curve = sub_box_solid_fractions(image, half);
  EXPECT_ERROR(
      fit_representative_volume(curve, 1), InputError,
      "0 edges of sub-boxes, down to 1 voxels, between which the measure varies; expected at least 2");
}

}  // namespace
}  // namespace anticrack
