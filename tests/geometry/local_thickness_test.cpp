#include "measures/local_thickness.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>

#include "errors.h"
#include "expect_error.h"
#include "fields/random_stream.h"
#include "measured_shapes.h"
#include "measures/distance_transform.h"

namespace anticrack {
namespace {

// Every ball paints every voxel that it contains.
std::vector<std::int32_t> paint_all_balls(const PhaseImage& image, Phase phase) {
  const auto squares = squared_distances(image, phase);
  std::vector<std::int32_t> radii(image.count(), 0);
  const auto [nx, ny, nz] = image.size;
  const auto at = [&](std::size_t n) { return Index3{int(n) % nx, int(n) / nx % ny, int(n) / nx / ny}; };
  for (std::size_t n = 0; n < image.count(); ++n)
    for (std::size_t m = 0; m < image.count(); ++m) {
      const Index3 a = at(n), b = at(m);
      const int away =
          (a[0] - b[0]) * (a[0] - b[0]) + (a[1] - b[1]) * (a[1] - b[1]) + (a[2] - b[2]) * (a[2] - b[2]);
      if (away < squares[n]) radii[m] = std::max(radii[m], squares[n]);
    }
  return radii;
}

TEST(LocalThickness, IsThatOfAllBallsPainted) {
  for (int seed : {1, 2}) {
    const PhaseImage image = image_of_field(
        {{24, 17, 21}, 0.05},
        {.waves = 100, .wavelengths_per_side = 1.5, .heterogeneity = 5, .seed = std::uint64_t(seed)}, 0.5);
    for (Phase phase : {Phase::pore, Phase::solid})
      EXPECT_EQ(squared_local_radii(image, phase), paint_all_balls(image, phase)) << seed;
  }
  RandomStream random(6, 0);
  const PhaseImage sparse = image_of({20, 20, 15}, 1, [&](const Vec3&) { return random.uniform() < 0.99; });
  EXPECT_EQ(squared_local_radii(sparse, Phase::solid), paint_all_balls(sparse, Phase::solid));
}

TEST(LocalThickness, OfASlabIsItsWidth) {
  for (int width : {1, 2, 5, 8}) {
    const PhaseImage image = image_of({30, 20, 25}, 0.1, [&](const Vec3& x) {
      const int i = int(x[0] / 0.1);
      return i >= 9 && i < 9 + width;
    });
    const auto thickness = thickness_distribution(image, Phase::solid);
    ASSERT_EQ(thickness.shares.size(), 1u);
    EXPECT_DOUBLE_EQ(thickness.mean,
                     0.1 * (width + width % 2));  // the convention of centres: even widths are exact
    EXPECT_EQ(thickness.voxels, std::uint64_t(width * 20 * 25));
    EXPECT_EQ(thickness.standard_deviation, 0);
  }
}

TEST(LocalThickness, OfABallIsItsDiameter) {
  const double radius = 12.3;
  const Vec3 centre(20.5, 20.5, 20.5);  // a voxel's centre
  const PhaseImage image =
      image_of({41, 41, 41}, 1, [&](const Vec3& x) { return (x - centre).norm() < radius; });
  const auto thickness = thickness_distribution(image, Phase::solid);
  // One ball holds all voxels; it ends at the first lattice point outside: 152 = 12.33^2 is a sum of three
  // squares.
  ASSERT_EQ(thickness.shares.size(), 1u);
  EXPECT_DOUBLE_EQ(thickness.mean, 2 * std::sqrt(152.0));
}

TEST(LocalThickness, OfACylinderThroughTheFacesIsItsDiameterAllAlong) {
  const double radius = 8.2;
  const PhaseImage image =
      image_of({31, 31, 24}, 1, [&](const Vec3& x) { return std::hypot(x[0] - 15.5, x[1] - 15.5) < radius; });
  const auto thickness = thickness_distribution(image, Phase::solid);
  ASSERT_EQ(thickness.shares.size(), 1u);
  EXPECT_DOUBLE_EQ(thickness.mean, 2 * std::sqrt(68.0));  // 8^2 + 2^2, the next lattice point outside of 8.2
}

TEST(LocalThickness, DistributionCountsEachVoxelOnce) {
  // Two slabs, 2 and 6 voxels wide.
  const PhaseImage image =
      image_of({20, 10, 10}, 0.5, [&](const Vec3& x) { return x[0] < 1 || (x[0] > 4 && x[0] < 7); });
  const auto thickness = thickness_distribution(image, Phase::solid);
  // The first lies at a face, which bounds nothing: the ball at the face is twice as wide.
  ASSERT_EQ(thickness.shares.size(), 2u);
  EXPECT_EQ(thickness.shares[0].voxels, 200u);
  EXPECT_DOUBLE_EQ(thickness.shares[0].diameter, 2.0);
  EXPECT_EQ(thickness.shares[1].voxels, 600u);
  EXPECT_DOUBLE_EQ(thickness.shares[1].diameter, 3.0);
  EXPECT_DOUBLE_EQ(thickness.mean, 2.75);
  EXPECT_DOUBLE_EQ(thickness.standard_deviation, std::sqrt(0.25 * 0.75));
  EXPECT_EQ(thickness.histogram(1.5), (std::vector<double>{0, 0.25, 0.75}));
  EXPECT_EQ(thickness.quantile(0.2), 2.0);
  EXPECT_EQ(thickness.quantile(0.5), 3.0);
  EXPECT_ERROR(thickness.histogram(0), InputError, "expected a bin width > 0");
}

TEST(LocalThickness, HasTheSameBitsOnAnyNumberOfThreads) {
  const PhaseImage image = image_of_field(
      {{40, 30, 50}, 0.02}, {.waves = 300, .wavelengths_per_side = 3, .heterogeneity = 10, .seed = 4}, 0.4);
  const auto on = [&](int threads) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, std::size_t(threads));
    return squared_local_radii(image, Phase::pore);
  };
  const auto one = on(1);
  EXPECT_EQ(on(2), one);
  EXPECT_EQ(on(5), one);
}

TEST(LocalThickness, RefusesAnImageOfOnePhase) {
  const PhaseImage solid = image_of({4, 4, 4}, 1, [](const Vec3&) { return true; });
  EXPECT_ERROR(squared_local_radii(solid, Phase::solid), InputError, "the image has no pore voxel");
  const PhaseImage empty = image_of({4, 4, 4}, 1, [](const Vec3&) { return false; });
  EXPECT_ERROR(thickness_distribution(empty, Phase::solid), InputError, "the image has no solid voxel");
}

}  // namespace
}  // namespace anticrack
