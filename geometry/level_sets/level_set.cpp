#include "level_sets/level_set.h"

#include <openvdb/tools/SignedFloodFill.h>
#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <memory>

#include "level_sets/closest_point.h"
#include "level_sets/closest_seeds.h"

namespace anticrack {
namespace {

using Leaf = openvdb::FloatTree::LeafNodeType;

constexpr double half_width = 3.0;       // voxels
constexpr double seed_error = 0.75;      // voxels, of the worst seed
constexpr double far_away = 1e3;         // stands for any distance beyond the band
constexpr double least_distance = 1e-6;  // keeps the sign of a lattice point that lies on the surface

// Distances in voxels from lattice points to the surface of the capped solid.
class CappedSolid {
 public:
  explicit CappedSolid(const CutSolid& solid)
      : solid_(solid),
        sheets_(solid.sheets()),
        seeds_(solid),
        found_(composed() ? solid.points() : Index3{}) {}

  // Of two fields: distances that `shortened_distance` may still shorten.
  bool composed() const { return solid_.fields.size() == 2; }

  // Whether a point belongs to the padded lattice.
  bool holds(int i, int j, int k) const {
    const Index3 index = {i, j, k};
    for (int axis = 0; axis < 3; ++axis)
      if (index[axis] < -PaddedField::padding || index[axis] >= solid_.points()[axis] + PaddedField::padding)
        return false;
    return true;
  }

  // Negative inside, +-far_away beyond the band; (i, j, k) within the padded lattice.
  double signed_distance(int i, int j, int k) {
    const Vec3 x(i, j, k), in_box = x.cwiseMax(lower()).cwiseMin(upper());
    if (in_box != x) {
      // Outside: the face is the nearest solid where it is solid, else a point of the cut within the box.
      if (excess(in_box) > 0) return (x - in_box).norm();
      return distance_to_cut(x, i, j, k, false);
    }
    const bool is_solid = solid_.excess_at(solid_.fields[0].offset(i, j, k)) > 0;
    const double to_cut = distance_to_cut(x, i, j, k, is_solid);
    if (!is_solid) return std::max(to_cut, least_distance);
    const double to_face = std::min((x - lower()).minCoeff(), (upper() - x).minCoeff());
    return -std::max(std::min(to_cut, to_face), least_distance);
  }

  // At most `distance`, which `signed_distance` found: less if a closest point that it found for a neighbour
  // leads to a nearer sheet or crease. Call it when all points are done.
  double shortened_distance(int i, int j, int k, bool from_solid, double distance) const {
    constexpr double accuracy = 0.03;                 // voxels, of the stored closest points
    constexpr double most = 0.8, least = 0.15;        // voxels apart: other closest points
    const double slack = distance < 1.0 ? 0.2 : 0.0;  // voxels, of what the first order expects
    const Vec3 x(i, j, k);
    std::array<Vec3, 28> known;
    std::ptrdiff_t count = 0;
    double apart = most;
    if (const auto own = found_.of({i, j, k})) {
      known[std::size_t(count++)] = *own;
      if (distance < 1.0 && is_intricate(*own, distance)) apart = std::clamp(most * distance, least, most);
    }
    Nearest nearest{distance, {}};
    double certain = std::max(0.0, distance - accuracy);
    for (int dk = -1; dk <= 1; ++dk)
      for (int dj = -1; dj <= 1; ++dj)
        for (int di = -1; di <= 1; ++di) {
          const std::optional<Vec3> start = found_.of({i + di, j + dj, k + dk});
          if (!start) continue;
          const bool is_nearer = (x - *start).squaredNorm() < certain * certain;
          const auto is_beside = [&](const Vec3& y) { return (y - *start).squaredNorm() < apart * apart; };
          if (!is_nearer && std::any_of(known.begin(), known.begin() + count, is_beside)) continue;
          // Going from the neighbour to x, its closest point moves sideways on a plane and stays on a crease.
          const Vec3 step(-di, -dj, -dk), way = x - step - *start;
          const double squared_length = way.squaredNorm();
          const bool has_normal = squared_length > 0.01;
          const double along = has_normal ? way.dot(step) / squared_length : 0.0;
          const double expected = has_normal ? std::abs(1 + along) * std::sqrt(squared_length) : 0.0;
          const Vec3 sideways = step - along * way;
          const auto leads_to = [&, squared = std::max(sideways.squaredNorm(), 1e-6)](const Vec3& y) {
            const double share = std::clamp((y - *start).dot(sideways) / squared, 0.0, 1.0);
            return (y - *start - share * sideways).squaredNorm() < apart * apart;
          };
          if (!is_nearer && (expected >= nearest.distance + slack ||
                             std::any_of(known.begin(), known.begin() + count, leads_to)))
            continue;
          const Nearest other = closest_of_any(x, *start, from_solid, nearest);
          const bool shorter = other.distance < nearest.distance;
          known[std::size_t(count++)] = shorter ? other.at : *start;
          if (shorter) nearest = other, certain = std::max(0.0, nearest.distance - accuracy);
        }
    return nearest.distance;
  }

 private:
  struct Nearest {
    double distance = far_away;
    Vec3 at = Vec3::Zero();
  };

  static Vec3 lower() { return Vec3::Constant(-0.5); }
  Vec3 upper() const {
    return Vec3(solid_.points()[0], solid_.points()[1], solid_.points()[2]) - Vec3::Constant(0.5);
  }
  double excess(const Vec3& x) const {
    return solid_.excess([&](const PaddedField& field) { return interpolate_value(field, x); });
  }

  // To the sheets, and the creases of composed solids.
  double distance_to_cut(const Vec3& x, int i, int j, int k, bool from_solid) {
    const ClosestSeeds::Choice seeds = seeds_.at(i, j, k);
    if (!seeds.first) return far_away;
    if (!composed()) {
      const double distance = distance_to_sheets(x, *seeds.first);
      return seeds.second ? std::min(distance, distance_to_sheets(x, *seeds.second)) : distance;
    }

    const double rough = (x - *seeds.first).norm();
    if (rough > half_width + seed_error) return far_away;
    Nearest nearest = closest_of_any(x, *seeds.first, from_solid, {});
    if (seeds.second) nearest = closest_of_any(x, *seeds.second, from_solid, nearest);
    // A seed lies on the boundary: if nothing as near was found, look again, at all seeds around.
    constexpr double seed_accuracy = 0.03;  // voxels, of most
    if (nearest.distance > rough + seed_accuracy) {
      for (const Vec3& seed : seeds_.all_around(i, j, k))
        if ((x - seed).norm() < nearest.distance + seed_error)
          nearest = closest_of_any(x, seed, from_solid, nearest);
    }
    if (!(nearest.distance < far_away)) return rough;
    found_.put({i, j, k}, nearest.at);
    return nearest.distance;
  }

  double distance_to_sheets(const Vec3& x, const Vec3& seed) const {
    const double rough = (x - seed).norm();
    if (rough > half_width + seed_error) return far_away;
    const double distance =
        sheets_.size() == 1 ? distance_to_one(x, seed) : closest_of_any(x, seed, false, {}).distance;
    return distance > rough + seed_error ? rough : distance;
  }

  std::optional<Vec3> closest_on(std::span<const Sheet> sheets, const Vec3& x, const Vec3& start) const {
    // The curved and thin parts of composed solids take one step more.
    return find_closest_point(sheets, x, start, composed() ? Accuracy::fine : Accuracy::usual);
  }

  double distance_to_one(const Vec3& x, const Vec3& start) const {
    const std::optional<Vec3> closest = closest_on(sheets_, x, start);
    return closest ? (x - *closest).norm() : far_away;
  }

  // Whether near y two closest points of an x at `distance` from it may lie beside each other: with x about
  // at a centre of curvature, or where sheets cross at a small angle.
  bool is_intricate(const Vec3& y, double distance) const {
    constexpr double beside = 0.3, small_sine = 0.5;  // voxels; sine
    std::array<Vec3, 2> normals;
    std::size_t count = 0;
    for (const PaddedField& field : solid_.fields) {
      const FieldJet jet = interpolate_jet(field, y);
      const double slope = jet.gradient.norm();
      if (std::abs(std::abs(jet.value) - solid_.threshold) > beside * slope) continue;
      if (distance * jet.hessian.norm() > slope) return true;
      normals[count++] = jet.gradient / slope;
    }
    return count == 2 && normals[0].cross(normals[1]).norm() < small_sine;
  }

  // On the nearest of the sheets that pass near the seed, where they bound the solid, and of the creases;
  // `best` if that is nearer. Only seen from the pores of an open cell and from the solid of a closed one may
  // a crease be nearer than every sheet.
  Nearest closest_of_any(const Vec3& x, const Vec3& seed, bool from_solid, Nearest best) const {
    constexpr double reach = 1.5;  // voxels, to first order
    std::array<double, 4> away;
    double nearest = far_away;
    for (std::size_t field = 0; field < solid_.fields.size(); ++field) {
      const FieldJet jet = interpolate_jet(solid_.fields[field], seed);
      for (const std::size_t n : {2 * field, 2 * field + 1}) {
        away[n] = std::abs(jet.value - sheets_[n].level) / jet.gradient.norm();
        nearest = std::min(nearest, away[n]);
      }
    }
    const bool reentrant = (solid_.morphology == Morphology::open_cell) != from_solid;
    std::array<std::array<std::optional<Vec3>, 2>, 2> off_boundary;  // by the sheets of either field
    for (std::size_t n = 0; n < sheets_.size(); ++n) {
      if (away[n] > std::max(reach, nearest)) continue;
      const std::optional<Vec3> closest = closest_on({&sheets_[n], 1}, x, seed);
      if (!closest || (x - *closest).norm() >= best.distance) continue;
      const double other_value = composed() ? interpolate_value(solid_.fields[n < 2], *closest) : 0.0;
      if (!composed() || solid_.on_boundary(other_value) >= 0) {
        best = {(x - *closest).norm(), *closest};
      } else if (reentrant) {
        // Within the other cut, either of its sheets may be nearer.
        for (const std::size_t side : {0, 1}) {
          if (solid_.morphology == Morphology::open_cell && (other_value < 0) != (side == 1)) continue;
          auto& crease = n < 2 ? off_boundary[n][side] : off_boundary[side][n - 2];
          if (!crease) crease = closest;
        }
      }
    }
    for (const std::size_t n : {0, 1})
      for (const std::size_t m : {0, 1})
        if (const std::optional<Vec3>& start = off_boundary[n][m]) {
          const std::array<Sheet, 2> both = {sheets_[n], sheets_[2 + m]};
          // Along a curved crease either start may lead to the nearer of two minima.
          std::optional<Vec3> closest = closest_on(both, x, seed);
          if (!closest || (*start - seed).squaredNorm() > 0.09) {
            const std::optional<Vec3> other = closest_on(both, x, *start);
            if (other && (!closest || (x - *other).norm() < (x - *closest).norm())) closest = other;
          }
          if (!closest) continue;
          // Between sheets that all but touch there may be one on the other side, too.
          if ((x - *start).norm() < 0.25 * (x - *closest).norm()) {
            const Vec3 across = (2 * *start - *closest).cwiseMax(lower()).cwiseMin(upper());
            const std::optional<Vec3> other = closest_on(both, x, across);
            if (other && (x - *other).norm() < (x - *closest).norm()) closest = other;
          }
          if ((x - *closest).norm() >= best.distance) continue;
          best = {(x - *closest).norm(), *closest};
          // From the crease a sheet may lead nearer.
          for (const std::size_t s : {n, 2 + m}) {
            const std::optional<Vec3> nearer = closest_on({&sheets_[s], 1}, x, *closest);
            if (nearer && (x - *nearer).norm() < best.distance &&
                solid_.on_boundary(interpolate_value(solid_.fields[s < 2], *nearer)) >= 0)
              best = {(x - *nearer).norm(), *nearer};
          }
        }
    return best;
  }

  CutSolid solid_;
  std::vector<Sheet> sheets_;
  ClosestSeeds seeds_;
  ClosestSeeds found_;  // closest points of composed solids
};

// The leaf at `origin`, or nothing if no point of it lies in the band.
std::unique_ptr<Leaf> build_leaf(CappedSolid& solid, const openvdb::Coord& origin, double spacing) {
  const auto background = float(half_width * spacing);
  auto leaf = std::make_unique<Leaf>(origin, background, false);
  for (openvdb::Index offset = 0; offset < Leaf::SIZE; ++offset) {
    const openvdb::Coord voxel = leaf->offsetToGlobalCoord(offset);
    if (!solid.holds(voxel[0], voxel[1], voxel[2])) continue;
    const double distance = solid.signed_distance(voxel[0], voxel[1], voxel[2]);
    if (std::abs(distance) < half_width)
      leaf->setValueOn(offset, float(distance * spacing));
    else
      leaf->setValueOff(offset, distance < 0 ? -background : background);
  }
  return leaf->isEmpty() ? nullptr : std::move(leaf);
}

// Takes the distances of a leaf that the closest points of neighbours shorten.
void shorten_distances(const CappedSolid& solid, double spacing, Leaf& leaf) {
  for (openvdb::Index offset = 0; offset < Leaf::SIZE; ++offset) {
    const openvdb::Coord voxel = leaf.offsetToGlobalCoord(offset);
    if (!solid.holds(voxel[0], voxel[1], voxel[2])) continue;
    const bool is_solid = leaf.getValue(offset) < 0;
    const double before = std::min(std::abs(leaf.getValue(offset)) / spacing, half_width);
    const double distance = solid.shortened_distance(voxel[0], voxel[1], voxel[2], is_solid, before);
    if (distance < before)
      leaf.setValueOn(offset, float(std::max(distance, least_distance) * (is_solid ? -spacing : spacing)));
  }
}

}  // namespace

LevelSet build_level_set(const PaddedField& excess, double spacing, const Watch& watch) {
  return build_level_set(CutSolid{Morphology::single_cut, {&excess, 1}, 0.0}, spacing, watch);
}

LevelSet build_level_set(const CutSolid& cut, double spacing, const Watch& watch) {
  CappedSolid solid(cut);
  const Index3& points = cut.points();
  const LengthUnit unit = length_unit_for(spacing);
  spacing /= unit.metres;

  constexpr int edge = Leaf::DIM;
  Index3 leaves;  // along each axis, from -edge
  for (int axis = 0; axis < 3; ++axis) leaves[axis] = (points[axis] + PaddedField::padding - 1) / edge + 2;
  const std::size_t leaf_count = std::size_t(leaves[0]) * std::size_t(leaves[1]) * std::size_t(leaves[2]);
  std::vector<std::unique_ptr<Leaf>> built(leaf_count);
  const double passes = solid.composed() ? 2 : 1;
  const auto for_each_leaf = [&](int pass, const auto& visit) {
    constexpr std::size_t block = 1024;  // half a million points: a fraction of a second
    for (std::size_t first = 0; first < leaf_count; first += block) {
      if (watch) watch((pass + double(first) / double(leaf_count)) / passes);
      tbb::parallel_for(first, std::min(leaf_count, first + block), visit);
    }
  };
  for_each_leaf(0, [&](std::size_t n) {
    const auto i = int(n % leaves[0]), j = int(n / leaves[0] % leaves[1]), k = int(n / leaves[0] / leaves[1]);
    built[n] = build_leaf(solid, openvdb::Coord(edge * (i - 1), edge * (j - 1), edge * (k - 1)), spacing);
  });
  if (solid.composed())
    for_each_leaf(1, [&](std::size_t n) {
      if (built[n]) shorten_distances(solid, spacing, *built[n]);
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
