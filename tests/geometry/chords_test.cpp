#include "measures/chords.h"

#include <gtest/gtest.h>

#include <numbers>

#include "measured_shapes.h"

namespace anticrack {
namespace {

TEST(Chords, OfASlabAreItsThickness) {
  // Solid planes 3 to 7 and 10 to 11 of 12 along z.
  const PhaseImage image =
      make_image({6, 5, 12}, 0.5, [](int, int, int k) { return (k >= 3 && k <= 7) || k >= 10; });
  const Chords across = measure_chords(image, Phase::solid, 2);
  EXPECT_EQ(across.whole[5], 30u);
  EXPECT_EQ(across.cut[2], 30u);
  EXPECT_EQ(across.ends, 90u);
  EXPECT_DOUBLE_EQ(across.mean_of_whole(), 2.5);
  EXPECT_DOUBLE_EQ(across.mean(), 0.5 * 7 * 30 / 45);
  const Chords pores = measure_chords(image, Phase::pore, 2);
  EXPECT_EQ(pores.whole[2], 30u);
  EXPECT_EQ(pores.cut[3], 30u);
  const Chords along = measure_chords(image, Phase::solid, 0);
  EXPECT_EQ(along.cut[6], 5u * 7);
  EXPECT_EQ(along.ends, 0u);
  EXPECT_TRUE(std::isnan(along.mean()));
  EXPECT_TRUE(std::isnan(along.mean_of_whole()));
}

TEST(Chords, CoverEachVoxelOncePerAxis) {
  const PhaseImage image = cut_of_field(40, 4, 0, 5);
  for (const Phase phase : {Phase::solid, Phase::pore})
    for (int axis = 0; axis < 3; ++axis) {
      const Chords chords = measure_chords(image, phase, axis);
      std::uint64_t voxels = 0;
      for (std::size_t l = 0; l <= 40; ++l) voxels += l * (chords.whole[l] + chords.cut[l]);
      EXPECT_EQ(voxels, std::uint64_t(std::count(image.solid.begin(), image.solid.end(), int(phase))));
      EXPECT_EQ(voxels, chords.voxels);
    }
}

TEST(Chords, OfABallAverageTwoThirdsOfItsDiameter) {
  // 4 V / S of a convex body. The rim has chords shorter than a voxel, lost or rounded: 1 % at this radius.
  const Chords chords = measure_chords(ball_image(61, 27.3, 1e-3), Phase::solid, 1);
  EXPECT_NEAR(chords.mean() / (4.0 / 3 * 27.3e-3), 1, 0.01);
  EXPECT_DOUBLE_EQ(chords.mean(), chords.mean_of_whole());
}

TEST(Chords, OfACylinderAverageHalfPiRadii) {
  const PhaseImage image =
      make_image({61, 61, 4}, 1, [](int i, int j, int) { return std::hypot(i - 30, j - 30) < 27.3; });
  EXPECT_NEAR(measure_chords(image, Phase::solid, 0).mean() / (std::numbers::pi / 2 * 27.3), 1, 0.01);
}

}  // namespace
}  // namespace anticrack
