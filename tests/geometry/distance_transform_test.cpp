#include "measures/distance_transform.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>

#include "errors.h"
#include "expect_error.h"
#include "fields/random_stream.h"
#include "measured_shapes.h"

namespace anticrack {
namespace {

std::vector<std::int32_t> distances_to_all(const PhaseImage& image, Phase phase) {
  std::vector<std::int32_t> squares(image.count(), 0);
  const auto [nx, ny, nz] = image.size;
  const auto at = [&](std::size_t n) { return Index3{int(n) % nx, int(n) / nx % ny, int(n) / nx / ny}; };
  for (std::size_t n = 0; n < image.count(); ++n) {
    if (!image.is(phase, n)) continue;
    squares[n] = no_distance;
    for (std::size_t other = 0; other < image.count(); ++other) {
      if (image.is(phase, other)) continue;
      const Index3 a = at(n), b = at(other);
      squares[n] = std::min(squares[n], (a[0] - b[0]) * (a[0] - b[0]) + (a[1] - b[1]) * (a[1] - b[1]) +
                                            (a[2] - b[2]) * (a[2] - b[2]));
    }
  }
  return squares;
}

TEST(DistanceTransform, IsThatOfABruteForceSearch) {
  for (double share : {0.003, 0.05, 0.5, 0.97})
    for (const Index3& size : {Index3{17, 9, 13}, Index3{1, 23, 6}, Index3{12, 12, 1}, Index3{5, 30, 3}}) {
      RandomStream random(3, std::uint64_t(share * 1000) + std::uint64_t(size[0]));
      const PhaseImage image = image_of(size, 1, [&](const Vec3&) { return random.uniform() < share; });
      for (Phase phase : {Phase::pore, Phase::solid})
        EXPECT_EQ(squared_distances(image, phase), distances_to_all(image, phase)) << share << " " << size[0];
    }
}

TEST(DistanceTransform, WithoutTheOtherPhaseThereIsNone) {
  const PhaseImage image = image_of({4, 5, 6}, 1, [](const Vec3&) { return true; });
  const auto squares = squared_distances(image, Phase::solid);
  EXPECT_TRUE(std::ranges::all_of(squares, [](std::int32_t square) { return square == no_distance; }));
  const auto pores = squared_distances(image, Phase::pore);
  EXPECT_TRUE(std::ranges::all_of(pores, [](std::int32_t square) { return square == 0; }));
}

TEST(DistanceTransform, HasTheSameBitsOnAnyNumberOfThreads) {
  const PhaseImage image = image_of_field(
      {{40, 30, 50}, 0.02}, {.waves = 300, .wavelengths_per_side = 3, .heterogeneity = 10, .seed = 4}, 0.4);
  const auto on = [&](int threads) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, std::size_t(threads));
    return squared_distances(image, Phase::solid);
  };
  const auto one = on(1);
  EXPECT_EQ(on(2), one);
  EXPECT_EQ(on(5), one);
}

TEST(DistanceTransform, RefusesDiagonalsThatOverflow) {
  const PhaseImage image{{46341, 1, 1}, 1, {}};
  EXPECT_ERROR(squared_distances(image, Phase::solid), InputError, "expected a diagonal below 46340 voxels");
}

}  // namespace
}  // namespace anticrack
