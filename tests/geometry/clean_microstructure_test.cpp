#include "measures/clean_microstructure.h"

#include <gtest/gtest.h>

#include <cmath>

#include "errors.h"
#include "expect_error.h"
#include "level_sets/level_set.h"

namespace anticrack {
namespace {

constexpr int n = 32;
constexpr double h = 1.0 / n;

template <class Excess>
Microstructure cut(const Excess& excess_at) {
  PaddedField excess{{n, n, n}, {}};
  constexpr int p = PaddedField::padding;
  Microstructure structure;
  structure.lattice = {{n, n, n}, h};
  for (int k = -p; k < n + p; ++k)
    for (int j = -p; j < n + p; ++j)
      for (int i = -p; i < n + p; ++i) excess.values.push_back(float(excess_at(i, j, k)));
  for (int k = 0; k < n; ++k)
    for (int j = 0; j < n; ++j)
      for (int i = 0; i < n; ++i) structure.solid_points += excess_at(i, j, k) > 0;
  structure.surface = std::make_shared<LevelSet>(build_level_set(excess, h));
  return structure;
}

double floor_excess(int, int, int k) {
  return 12.3 - k;
}
double ball_excess(int i, int j, int k) {
  return 5.2 - std::hypot(i - 16, j - 15, k - 20);
}

TEST(CleanedMicrostructure, IsThatWithoutTheRemovedPiece) {
  // A ball 2.5 voxels above a floor: in between, and in the ball, distances are those to the floor
  // afterwards.
  const Microstructure both =
      cut([](int i, int j, int k) { return std::max(floor_excess(i, j, k), ball_excess(i, j, k)); });
  const Microstructure alone = cut(floor_excess);
  const CleanedMicrostructure cleaned = remove_unconnected(both, SpanningRule::x, Connectivity::faces);
  EXPECT_EQ(cleaned.removed_clusters, 1u);
  EXPECT_EQ(cleaned.connected_points, alone.solid_points);
  EXPECT_EQ(cleaned.solid_points, both.solid_points);
  EXPECT_EQ(cleaned.structure.solid_points, alone.solid_points);
  const auto was = both.surface->grid->getConstAccessor(), expected = alone.surface->grid->getConstAccessor(),
             is = cleaned.structure.surface->grid->getConstAccessor();
  int rebuilt = 0;
  for (int k = -4; k < n + 4; ++k)
    for (int j = -4; j < n + 4; ++j)
      for (int i = -4; i < n + 4; ++i) {
        const openvdb::Coord at(i, j, k);
        ASSERT_EQ(is.getValue(at) < 0, expected.getValue(at) < 0) << at;
        if (is.getValue(at) < 0) {
          ASSERT_EQ(is.getValue(at), was.getValue(at)) << at;
        }
        // Half the square of the way aside, over the way: at most 0.05 voxel, which is what is left alone as
        // well.
        ASSERT_NEAR(is.getValue(at) / h, expected.getValue(at) / h, 0.051) << at;
        rebuilt += is.getValue(at) != was.getValue(at);
      }
  EXPECT_GT(rebuilt, 500);
}

TEST(CleanedMicrostructure, KeepsEveryDistanceInTheSolidThatStays) {
  const GaussianRandomFieldSpec spec{
      .waves = 1000, .wavelengths_per_side = 5, .heterogeneity = 50, .seed = 2};
  const Microstructure structure = generate_microstructure({{48, 48, 48}, 1e-5}, spec, 0.3);
  const CleanedMicrostructure cleaned =
      remove_unconnected(structure, SpanningRule::six_faces, Connectivity::faces);
  ASSERT_GT(cleaned.removed_clusters, 0u);
  ASSERT_LT(cleaned.connected_points, cleaned.solid_points);
  EXPECT_EQ(seed_particles(cleaned.structure, structure.lattice).size(), cleaned.connected_points);
  const auto was = structure.surface->grid->getConstAccessor();
  const auto is = cleaned.structure.surface->grid->getConstAccessor();
  std::size_t removed = 0;
  for (int k = -4; k < 52; ++k)
    for (int j = -4; j < 52; ++j)
      for (int i = -4; i < 52; ++i) {
        const openvdb::Coord at(i, j, k);
        if (is.getValue(at) < 0) {
          ASSERT_EQ(is.getValue(at), was.getValue(at));
        }
        ASSERT_GE(is.getValue(at), was.getValue(at));
        removed += was.getValue(at) < 0 && is.getValue(at) > 0;
      }
  EXPECT_EQ(removed, cleaned.solid_points - cleaned.connected_points);
  // Cleaned twice is cleaned once.
  const auto again = remove_unconnected(cleaned.structure, SpanningRule::six_faces, Connectivity::faces);
  EXPECT_EQ(again.removed_clusters, 0u);
  EXPECT_EQ(again.connected_points, cleaned.connected_points);
}

TEST(CleanedMicrostructure, IsRefusedWhereNothingSpans) {
  EXPECT_ERROR(remove_unconnected(cut(ball_excess), SpanningRule::y, Connectivity::faces), InputError,
               "no cluster of the solid spans the sample (y)");
}

TEST(CleanedMicrostructure, IsRefusedWhereTheLatticeIsNotThatOfTheGrid) {
  Microstructure structure = cut(floor_excess);
  structure.lattice = {{2 * n, 2 * n, 2 * n}, h / 2};
  EXPECT_ERROR(remove_unconnected(structure, SpanningRule::x, Connectivity::faces), InputError,
               "are not voxels of its level set");
}

}  // namespace
}  // namespace anticrack
