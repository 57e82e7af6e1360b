#include "measures/geodesic.h"

#include <gtest/gtest.h>

#include "errors.h"
#include "expect_error.h"
#include "measured_shapes.h"

namespace anticrack {
namespace {

TEST(Tortuosity, OfAStraightChannelIsOne) {
  const PhaseImage image =
      make_image({30, 12, 9}, 1e-3, [](int, int j, int k) { return j == 3 || (k > 2 && k < 7 && j > 6); });
  for (const Phase phase : {Phase::solid, Phase::pore})
    for (const auto& found :
         {tortuosity_by_steps(image, phase, 0), tortuosity_by_fast_marching(image, phase, 0)}) {
      ASSERT_TRUE(found);
      EXPECT_EQ(found->mean, 1.0);
      EXPECT_EQ(found->least, 1.0);
    }
}

TEST(Tortuosity, OfACrankIsItsLength) {
  // Up, four voxels aside, up: 10 + 4 steps for a height of 10. Bends of one voxel width allow no short cut
  // by steps.
  const PhaseImage image = make_image({7, 3, 11}, 1, [](int i, int j, int k) {
    return j == 1 && ((i == 1 && k <= 5) || (i == 5 && k >= 5) || (k == 5 && i >= 1 && i <= 5));
  });
  const auto steps = tortuosity_by_steps(image, Phase::solid, 2);
  ASSERT_TRUE(steps);
  EXPECT_DOUBLE_EQ(steps->mean, 1.4);
  EXPECT_EQ(steps->outlet_voxels, 1u);
  // No voxel has neighbours reached along two axes, so the front takes the same way.
  EXPECT_FLOAT_EQ(float(tortuosity_by_fast_marching(image, Phase::solid, 2)->mean), 1.4f);
}

TEST(Tortuosity, IsAbsentWherePhaseDoesNotPercolate) {
  const PhaseImage image = make_image({5, 5, 5}, 1, [](int, int, int k) { return k != 2; });
  EXPECT_FALSE(tortuosity_by_steps(image, Phase::solid, 2));
  EXPECT_FALSE(tortuosity_by_fast_marching(image, Phase::solid, 2));
  EXPECT_FALSE(tortuosity_by_fast_marching(image, Phase::pore, 2));
  EXPECT_TRUE(tortuosity_by_steps(image, Phase::solid, 0));
  EXPECT_ERROR(
      tortuosity_by_steps(make_image({5, 5, 1}, 1, [](int, int, int) { return true; }), Phase::solid, 2),
      InputError, "at least 2 along it");
}

TEST(ArrivalTimes, FromAPointErrAsTheDocumentationSays) {
  // An open half space behind a wall with a hole of one voxel.
  constexpr int n = 61, c = n / 2;
  const PhaseImage image =
      make_image({n, n, n}, 1, [](int i, int j, int k) { return k > 0 || (i == c && j == c); });
  const std::vector<float> times = arrival_times(image, Phase::solid, {2, false});
  double at_ten = 0, far = 0;
  for (int k = 0; k < n; ++k)
    for (int j = 0; j < n; ++j)
      for (int i = 0; i < n; ++i) {
        if (!image.is(Phase::solid, image.offset(i, j, k))) continue;
        const double distance = std::hypot(i - c, j - c, k);
        const double time = times[image.offset(i, j, k)];
        EXPECT_GE(time, distance * (1 - 1e-6));  // first order is never early
        if (distance > 9.5 && distance < 10.5) at_ten = std::max(at_ten, time / distance - 1);
        if (distance > 49.5 && distance < 50.5) far = std::max(far, time / distance - 1);
      }
  EXPECT_FLOAT_EQ(times[image.offset(c, c, n - 1)], n - 1);
  EXPECT_LT(at_ten, 0.18);
  EXPECT_LT(far, 0.06);
}

TEST(ArrivalTimes, SolveTheUpwindDifferencesInEveryVoxel) {
  const PhaseImage image = cut_of_field(65, 5, theoretical_threshold(Morphology::single_cut, 0.4), 3);
  const std::vector<float> times = arrival_times(image, Phase::solid, {0, false});
  const auto at = [&](int i, int j, int k) {
    const auto inside = [](int n) { return n >= 0 && n < 65; };
    return inside(i) && inside(j) && inside(k) ? double(times[image.offset(i, j, k)]) : HUGE_VAL;
  };
  for (int k = 0; k < 65; ++k)
    for (int j = 0; j < 65; ++j)
      for (int i = 1; i < 65; ++i) {
        const double t = at(i, j, k);
        if (t == HUGE_VAL) continue;
        double gradient = 0;
        for (const double before :
             {std::min(at(i - 1, j, k), at(i + 1, j, k)), std::min(at(i, j - 1, k), at(i, j + 1, k)),
              std::min(at(i, j, k - 1), at(i, j, k + 1))})
          if (before < t) gradient += (t - before) * (t - before);
        // Times reach 200: half a unit of the last place of a float, 8e-6, in three differences of at most 1.
        ASSERT_NEAR(gradient, 1, 1e-4) << i << " " << j << " " << k;
      }
}

// Refused by the size alone, before a voxel is looked at.
TEST(Burning, OfMoreVoxelsThanStepsCountIsRefused) {
  const PhaseImage image{{1 << 11, 1 << 11, 1 << 10}, 1, {}};
  EXPECT_ERROR(burning_times(image, Phase::solid, {0, true}), InputError,
               "paths through 2048 x 2048 x 1024 voxels; expected fewer than 2^32 with a border");
}

TEST(Burning, CountsLayersFromTheFace) {
  const PhaseImage image = make_image({4, 3, 3}, 1, [](int i, int j, int) { return i != 2 || j == 0; });
  const auto times = burning_times(image, Phase::solid, {0, true});
  EXPECT_EQ(times[image.offset(3, 2, 0)], 0u);
  EXPECT_EQ(times[image.offset(1, 0, 0)], 2u);
  EXPECT_EQ(times[image.offset(1, 2, 2)], 4u);
  EXPECT_EQ(times[image.offset(2, 1, 0)], never_burned);
}

TEST(Tortuosity, OfTheVoidAtPhiIsThatOfTheSolidAtOneMinusPhi) {
  // Exactly, of the fields G and -G: the pore of {G > t} is {-G > -t}, but for points on the threshold.
  const double t = theoretical_threshold(Morphology::single_cut, 0.6);
  const PhaseImage cut = cut_of_field(65, 5, t, 4), mirrored = cut_of_field(65, 5, -t, 4, -1);
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_EQ(tortuosity_by_steps(cut, Phase::pore, axis)->mean,
              tortuosity_by_steps(mirrored, Phase::solid, axis)->mean);
    EXPECT_EQ(tortuosity_by_fast_marching(cut, Phase::pore, axis)->mean,
              tortuosity_by_fast_marching(mirrored, Phase::solid, axis)->mean);
  }
  // In ensemble, of other samples: 1.242 at 0.44, with a scatter of 1.5 % a sample of five wavelengths; mean
  // of four and three axes; three sigma of the difference of two.
  double solid = 0, pore = 0;
  for (const std::uint64_t seed : {11, 12, 13, 14})
    for (int axis = 0; axis < 3; ++axis) {
      solid +=
          tortuosity_by_steps(cut_of_field(65, 5, theoretical_threshold(Morphology::single_cut, 0.44), seed),
                              Phase::solid, axis)
              ->mean /
          12;
      pore += tortuosity_by_steps(
                  cut_of_field(65, 5, theoretical_threshold(Morphology::single_cut, 0.56), seed + 50),
                  Phase::pore, axis)
                  ->mean /
              12;
    }
  EXPECT_NEAR(solid, pore, 0.03);
}

}  // namespace
}  // namespace anticrack
