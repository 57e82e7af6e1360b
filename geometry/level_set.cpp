#include "level_set.h"

#include <openvdb/tools/SignedFloodFill.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <memory>

#include "closest_point.h"
#include "closest_seeds.h"

namespace anticrack {
namespace {

using Leaf = openvdb::FloatTree::LeafNodeType;

constexpr double half_width = 3.0;       // voxels
constexpr double far_away = 1e3;         // stands for any distance beyond the band
constexpr double least_distance = 1e-6;  // keeps the sign of a lattice point that lies on the surface

// Distances in voxels from lattice points to the surface of the capped solid.
class CappedSolid {
 public:
  explicit CappedSolid(const PaddedField& excess) : excess_(excess), seeds_(excess) {}

  // Negative inside, +-far_away beyond the band; (i, j, k) within the padded lattice.
  double signed_distance(int i, int j, int k) const {
    const Vec3 x(i, j, k), in_box = x.cwiseMax(lower()).cwiseMin(upper());
    if (in_box != x) {
      // Outside: the face is the nearest solid where it is solid, else a point of the cut within the box.
      if (interpolate_value(excess_, in_box) > 0) return (x - in_box).norm();
      return distance_to_cut(x, i, j, k);
    }
    const double to_cut = distance_to_cut(x, i, j, k);
    if (!(excess_.at(i, j, k) > 0)) return std::max(to_cut, least_distance);
    const double to_face = std::min((x - lower()).minCoeff(), (upper() - x).minCoeff());
    return -std::max(std::min(to_cut, to_face), least_distance);
  }

 private:
  static Vec3 lower() { return Vec3::Constant(-0.5); }
  Vec3 upper() const {
    return Vec3(excess_.points[0], excess_.points[1], excess_.points[2]) - Vec3::Constant(0.5);
  }

  double distance_to_cut(const Vec3& x, int i, int j, int k) const {
    const ClosestSeeds::Choice seeds = seeds_.at(i, j, k);
    if (!seeds.first) return far_away;
    const double distance = distance_to_cut(x, *seeds.first);
    return seeds.second ? std::min(distance, distance_to_cut(x, *seeds.second)) : distance;
  }

  double distance_to_cut(const Vec3& x, const Vec3& seed) const {
    const double rough = (x - seed).norm();
    constexpr double seed_error = 0.75;  // voxels, of the worst seed
    if (rough > half_width + seed_error) return far_away;
    const std::optional<Vec3> closest = find_closest_point(excess_, x, seed);
    if (!closest) return rough;
    const double distance = (x - *closest).norm();
    return distance > rough + seed_error ? rough : distance;
  }

  const PaddedField& excess_;
  ClosestSeeds seeds_;
};

// The leaf at `origin`, or nothing if no point of it lies in the band.
std::unique_ptr<Leaf> build_leaf(const CappedSolid& solid, const PaddedField& excess,
                                 const openvdb::Coord& origin, double spacing) {
  const auto background = float(half_width * spacing);
  auto leaf = std::make_unique<Leaf>(origin, background, false);
  for (openvdb::Index offset = 0; offset < Leaf::SIZE; ++offset) {
    const openvdb::Coord voxel = leaf->offsetToGlobalCoord(offset);
    bool within = true;
    for (int axis = 0; axis < 3; ++axis)
      within &=
          voxel[axis] >= -PaddedField::padding && voxel[axis] < excess.points[axis] + PaddedField::padding;
    if (!within) continue;
    const double distance = solid.signed_distance(voxel[0], voxel[1], voxel[2]);
    if (std::abs(distance) < half_width)
      leaf->setValueOn(offset, float(distance * spacing));
    else
      leaf->setValueOff(offset, distance < 0 ? -background : background);
  }
  return leaf->isEmpty() ? nullptr : std::move(leaf);
}

}  // namespace

LevelSet build_level_set(const PaddedField& excess, double spacing) {
  const CappedSolid solid(excess);
  const LengthUnit unit = length_unit_for(spacing);
  spacing /= unit.metres;

  constexpr int edge = Leaf::DIM;
  Index3 leaves;  // along each axis, from -edge
  for (int axis = 0; axis < 3; ++axis)
    leaves[axis] = (excess.points[axis] + PaddedField::padding - 1) / edge + 2;
  const std::size_t leaf_count = std::size_t(leaves[0]) * std::size_t(leaves[1]) * std::size_t(leaves[2]);
  std::vector<std::unique_ptr<Leaf>> built(leaf_count);
  tbb::parallel_for(std::size_t(0), leaf_count, [&](std::size_t n) {
    const auto i = int(n % leaves[0]), j = int(n / leaves[0] % leaves[1]), k = int(n / leaves[0] / leaves[1]);
    built[n] =
        build_leaf(solid, excess, openvdb::Coord(edge * (i - 1), edge * (j - 1), edge * (k - 1)), spacing);
  });

  auto grid = openvdb::FloatGrid::create(float(half_width * spacing));
  for (auto& leaf : built)
    if (leaf) grid->tree().addLeaf(leaf.release());
  openvdb::tools::signedFloodFill(grid->tree());

  auto transform = openvdb::math::Transform::createLinearTransform(spacing);
  transform->postTranslate(openvdb::Vec3d(0.5 * spacing));
  grid->setTransform(transform);
  grid->setGridClass(openvdb::GRID_LEVEL_SET);
  grid->setName("surface");
  return {grid, unit};
}

}  // namespace anticrack
