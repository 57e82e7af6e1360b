#include "measures/two_point_correlation.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>
#include <map>
#include <numbers>

#include "errors.h"
#include "expect_error.h"
#include "fields/random_stream.h"
#include "measured_shapes.h"

namespace anticrack {
namespace {

PhaseImage random_image(const Index3& size, std::uint64_t seed) {
  RandomStream random(seed, 0);
  return image_of(size, 0.5, [&](const Vec3&) { return random.uniform() < 0.4; });
}

struct Pairs {
  std::uint64_t all = 0, solid = 0, mixed = 0;
  double length = 0;
};

// Every voxel with every other.
Pairs count_pairs(const PhaseImage& image, PairRule rule, const Index3& shift) {
  Pairs pairs;
  for (int k = 0; k < image.size[2]; ++k)
    for (int j = 0; j < image.size[1]; ++j)
      for (int i = 0; i < image.size[0]; ++i) {
        Index3 other{i + shift[0], j + shift[1], k + shift[2]};
        bool outside = false;
        for (int axis = 0; axis < 3; ++axis) {
          outside |= other[axis] < 0 || other[axis] >= image.size[axis];
          other[axis] = (other[axis] + image.size[axis]) % image.size[axis];
        }
        if (outside && rule == PairRule::inside_box) continue;
        const int a = image.solid[image.offset(i, j, k)],
                  b = image.solid[image.offset(other[0], other[1], other[2])];
        pairs.all += 1;
        pairs.solid += std::uint64_t(a * b);
        pairs.mixed += a != b;
      }
  pairs.length = std::sqrt(double(shift[0] * shift[0] + shift[1] * shift[1] + shift[2] * shift[2]));
  return pairs;
}

std::map<int, Pairs> count_pairs_by_length(const PhaseImage& image, PairRule rule, int largest,
                                           int bins_per_voxel) {
  std::map<int, Pairs> bins;
  for (int k = 0; k <= largest; ++k)
    for (int j = -largest; j <= largest; ++j)
      for (int i = -largest; i <= largest; ++i) {
        if (k == 0 && (j < 0 || (j == 0 && i < 0))) continue;
        const Pairs pairs = count_pairs(image, rule, {i, j, k});
        const int bin = int(std::lround(pairs.length * bins_per_voxel));
        if (bin > largest * bins_per_voxel) continue;
        bins[bin].all += pairs.all;
        bins[bin].solid += pairs.solid;
        bins[bin].length += pairs.length * double(pairs.all);
      }
  return bins;
}

void expect_counts_of_a_naive_loop(const Index3& size, PairRule rule, int largest, int bins_per_voxel) {
  const PhaseImage image = random_image(size, 5);
  const auto correlation = correlate_solid(image, rule, largest, bins_per_voxel);
  for (int axis = 0; axis < 3; ++axis)
    for (int lag = 0; lag <= largest; ++lag) {
      Index3 shift{0, 0, 0};
      shift[axis] = lag;
      const Pairs pairs = count_pairs(image, rule, shift);
      EXPECT_EQ(correlation.axes[axis].pairs[lag], pairs.all);
      EXPECT_EQ(correlation.axes[axis].solid_pairs[lag], pairs.solid) << axis << " " << lag;
      EXPECT_EQ(correlation.axes[axis].mixed_pairs[lag], pairs.mixed) << axis << " " << lag;
    }
  const auto bins = count_pairs_by_length(image, rule, largest, bins_per_voxel);
  ASSERT_EQ(correlation.radial.size(), bins.size());
  auto bin = correlation.radial.begin();
  for (const auto& [length, pairs] : bins) {
    EXPECT_EQ(bin->pairs, pairs.all) << length;
    EXPECT_EQ(bin->solid_pairs, pairs.solid) << length;
    EXPECT_NEAR(bin->r, 0.5 * pairs.length / double(pairs.all), 1e-13);
    ++bin;
  }
}

TEST(TwoPointCorrelation, CountsThePairsOfANaiveLoop) {
  for (PairRule rule : {PairRule::inside_box, PairRule::periodic}) {
    expect_counts_of_a_naive_loop({8, 12, 10}, rule, 4, 1);
    expect_counts_of_a_naive_loop({13, 7, 11}, rule, 3, 3);  // periods without a fast transform
  }
  expect_counts_of_a_naive_loop({5, 11, 9}, PairRule::inside_box, 4, 2);  // all lags of an axis
}

TEST(TwoPointCorrelation, HasTheSameBitsOnAnyNumberOfThreads) {
  const PhaseImage image = random_image({31, 62, 40}, 8);
  const auto on = [&](int threads) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, std::size_t(threads));
    return correlate_solid(image, PairRule::inside_box, 15);
  };
  const auto one = on(1);
  for (int threads : {2, 5}) {
    const auto several = on(threads);
    ASSERT_EQ(several.radial.size(), one.radial.size());
    for (std::size_t n = 0; n < one.radial.size(); ++n) {
      EXPECT_EQ(several.radial[n].r, one.radial[n].r);
      EXPECT_EQ(several.radial[n].solid_pairs, one.radial[n].solid_pairs);
    }
    for (int axis = 0; axis < 3; ++axis)
      EXPECT_EQ(several.axes[axis].mixed_pairs, one.axes[axis].mixed_pairs);
  }
}

TEST(TwoPointCorrelation, OfLayersIsATriangleAcrossThem) {
  // Layers 4 voxels thick, 8 apart, along z: the probability falls by 1/8 a voxel, to 0 and up again.
  const PhaseImage image = image_of({16, 16, 32}, 1, [](const Vec3& x) { return int(x[2]) % 8 < 4; });
  const auto correlation = correlate_solid(image, PairRule::periodic, 8);
  for (int lag = 0; lag <= 8; ++lag) {
    EXPECT_EQ(correlation.axes[2].g(lag), std::abs(4 - lag) / 8.0);
    EXPECT_EQ(correlation.axes[0].g(lag), 0.5);
  }
  EXPECT_EQ(correlation.solid_fraction, 0.5);
  EXPECT_EQ(correlation.normalized(0.5), 1);
  EXPECT_EQ(correlation.normalized(0.25), 0);
  // S_V = 1/4; of three directions one sees all faces, two none: 2/3, as documented.
  EXPECT_NEAR(surface_by_slope(correlation).axes_first_difference, 2.0 / 3 / 4, 1e-15);
}

TEST(TwoPointCorrelation, RefusesLagsThatAreNotInTheImage) {
  const PhaseImage image = random_image({6, 9, 8}, 1);
  EXPECT_ERROR(correlate_solid(image, PairRule::inside_box, 6), InputError,
               "largest lag = 6 voxels; expected 1 to 5 in an image of 6 x 9 x 8 voxels");
  EXPECT_ERROR(correlate_solid(image, PairRule::periodic, 4), InputError, "expected 1 to 3");
  EXPECT_ERROR(correlate_solid(image, PairRule::periodic, 3, 0), InputError, "0 bins a voxel; expected >= 1");
  EXPECT_ERROR(surface_by_slope(correlate_solid(image, PairRule::periodic, 1)), InputError,
               "expected lags up to 2");
}

// The paper's samples: 131^3 lattice points, nine wavelengths, b = 50. One sample's specific surface scatters
// by 0.4 to 0.8 % (standard deviation over 200 realizations); the mean of n samples by less than 0.8 % /
// sqrt(n).
class PaperSamples : public testing::Test {
 protected:
  static constexpr int samples = 8;
  static constexpr double phi = 0.34;
  const SampleLattice lattice{{131, 131, 131}, 1.0 / 131};
  const FieldTheory theory{
      Morphology::single_cut, phi, {.mean_wave_number = 18 * std::numbers::pi, .heterogeneity = 50}};
  const double surface = minkowski_densities(theory).surface;

  PhaseImage sample(int seed) const {
    return image_of_field(
        lattice,
        {.waves = 10000, .wavelengths_per_side = 9, .heterogeneity = 50, .seed = std::uint64_t(seed)}, phi);
  }
};

TEST_F(PaperSamples, HaveTheCorrelationAndSurfaceOfTheTheory) {
  constexpr int lag = 40;
  double mean[lag + 1] = {}, squares[lag + 1] = {}, r[lag + 1] = {};
  SlopeSurface slope{}, periodic{};
  for (int seed = 1; seed <= samples; ++seed) {
    const PhaseImage image = sample(seed);
    const auto correlation = correlate_solid(image, PairRule::inside_box, lag);
    for (int n = 0; n <= lag; ++n) {
      const double g =
          correlation.axes[0].g(n) / 3 + correlation.axes[1].g(n) / 3 + correlation.axes[2].g(n) / 3;
      r[n] = n * lattice.spacing;
      mean[n] += g / samples;
      squares[n] += g * g / samples;
    }
    const auto one = surface_by_slope(correlation);
    const auto wrapped = surface_by_slope(correlate_solid(image, PairRule::periodic, 2));
    slope.axes_first_difference += one.axes_first_difference / samples;
    slope.axes_extrapolated += one.axes_extrapolated / samples;
    slope.radial += one.radial / samples;
    periodic.axes_first_difference += wrapped.axes_first_difference / samples;
    periodic.radial += wrapped.radial / samples;
  }
  for (int n = 0; n <= lag; ++n) {
    const double scatter = std::sqrt((squares[n] - mean[n] * mean[n]) / (samples - 1));
    // Of 41 correlated values: 99.9 % of Student's distribution with 7 degrees of freedom lie within 5.4.
    EXPECT_NEAR(mean[n], two_point_probability(theory, r[n]), 5.4 * scatter) << n;
  }
  const double tolerance = 3 * 0.008 / std::sqrt(double(samples)) * surface;
  EXPECT_NEAR(slope.axes_extrapolated, surface, tolerance);
  const double step = phi - two_point_probability(theory, lattice.spacing), scale = 4 / lattice.spacing;
  EXPECT_NEAR(slope.axes_first_difference, scale * step, tolerance);

  // The wrapped sample: one pair in 131 along an axis joins opposite faces, which know nothing of each other.
  // Its share of mixed pairs is 7 times as large, so that the surface comes out too large.
  const double wrapped = (130 * step + phi * (1 - phi)) / 131;
  EXPECT_NEAR(periodic.axes_first_difference, scale * wrapped, tolerance);

  // The first radial bin: three pairs of length h and six of sqrt(2) h a voxel, fewer where the box ends.
  const double diagonal = phi - two_point_probability(theory, std::sqrt(2.0) * lattice.spacing);
  const double near = 3 * 130 / 131.0, far = 6 * std::pow(130 / 131.0, 2);
  const double first_bin = (near * step + far * diagonal) / (near + far * std::sqrt(2.0));
  EXPECT_NEAR(slope.radial, scale * first_bin, tolerance);
  const double inside = std::pow(130 / 131.0, 2);
  const double wrapped_diagonal = inside * diagonal + (1 - inside) * phi * (1 - phi);
  const double wrapped_bin = (3 * wrapped + 6 * wrapped_diagonal) / (3 + 6 * std::sqrt(2.0));
  EXPECT_NEAR(periodic.radial, scale * wrapped_bin, tolerance);

  // The biases that the README tells.
  EXPECT_NEAR(scale * step / surface, 0.997, 0.0005);
  EXPECT_NEAR(scale * first_bin / surface, 0.995, 0.0005);
  EXPECT_NEAR(scale * wrapped / surface, 1.036, 0.0005);
  EXPECT_NEAR(scale * wrapped_bin / surface, 1.042, 0.0005);
}

}  // namespace
}  // namespace anticrack
