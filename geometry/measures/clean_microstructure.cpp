#include "measures/clean_microstructure.h"

#include <fmt/format.h>
#include <openvdb/tools/Dense.h>
#include <openvdb/tools/Prune.h>
#include <tbb/parallel_for.h>

#include <cmath>
#include <utility>
#include <vector>

#include "errors.h"
#include "level_sets/level_set.h"

namespace anticrack {
namespace {

using openvdb::Coord;
using openvdb::CoordBBox;

constexpr float rebuilt_error = 0.05f;   // voxels, of a distance that is put together from others
constexpr float least_distance = 1e-6f;  // voxels; a removed voxel is outside

// Doubtful: outside, but a removed piece may be the nearest solid.
enum class State : std::uint8_t { kept, doubtful, removed };

// The voxels of the sample and of the band around it, x fastest.
struct Voxels {
  CoordBBox box;
  int reach;                     // voxels; as far as the band and some way into the solid
  std::vector<float> distances;  // in voxels
  std::vector<State> states;

  std::size_t offset(const Coord& at) const {
    const Coord size = box.dim(), from = at - box.min();
    return (std::size_t(from[2]) * std::size_t(size[1]) + std::size_t(from[1])) * std::size_t(size[0]) +
           std::size_t(from[0]);
  }

  // action(offset, way from the centre in voxels)
  template <class Action>
  void for_each_around(const Coord& centre, const Action& action) const {
    CoordBBox around(centre.offsetBy(-reach), centre.offsetBy(reach));
    around.intersect(box);
    for (int k = around.min()[2]; k <= around.max()[2]; ++k)
      for (int j = around.min()[1]; j <= around.max()[1]; ++j)
        for (int i = around.min()[0]; i <= around.max()[0]; ++i) {
          const Coord at(i, j, k), step = at - centre;
          action(offset(at), float(step.asVec3d().length()));
        }
  }

  template <class Action>
  void for_each(const CoordBBox& part, const Action& action) const {
    for (int k = part.min()[2]; k <= part.max()[2]; ++k)
      for (int j = part.min()[1]; j <= part.max()[1]; ++j)
        for (int i = part.min()[0]; i <= part.max()[0]; ++i) action(Coord(i, j, k));
  }
};

// The voxels of the grid that are the lattice points of the sample.
CoordBBox sample_voxels(const Microstructure& structure) {
  const openvdb::FloatGrid& grid = *structure.surface->grid;
  const auto index_of = [&](const Index3& point) {
    const Vec3 at = (structure.origin + structure.lattice.point(point[0], point[1], point[2])) /
                    structure.surface->unit.metres;
    return grid.worldToIndex(openvdb::Vec3d(at[0], at[1], at[2]));
  };
  const Index3& points = structure.lattice.points;
  const openvdb::Vec3d first = index_of({0, 0, 0}),
                       last = index_of({points[0] - 1, points[1] - 1, points[2] - 1});
  const CoordBBox box(Coord::round(first), Coord::round(last));
  constexpr double most_offset = 0.01;  // voxels
  if ((first - box.min().asVec3d()).length() > most_offset ||
      (last - box.max().asVec3d()).length() > most_offset ||
      box.dim() != Coord(points[0], points[1], points[2]))
    throw InputError(fmt::format(
        "cleaning: the {} x {} x {} lattice points of the sample are not voxels of its level set; expected "
        "equal spacing along equal axes",
        points[0], points[1], points[2]));
  return box;
}

Voxels read_voxels(const openvdb::FloatGrid& grid, const CoordBBox& sample) {
  const auto voxel_size = float(grid.voxelSize()[0]);
  const int band = int(std::ceil(grid.background() / voxel_size)) + 1;
  Voxels voxels{sample, band + 1, {}, {}};
  voxels.box.expand(band);
  voxels.distances.resize(voxels.box.volume());
  voxels.states.assign(voxels.box.volume(), State::kept);
  openvdb::tools::Dense<float, openvdb::tools::LayoutXYZ> dense(voxels.box, voxels.distances.data());
  openvdb::tools::copyToDense(grid, dense);
  for (float& distance : voxels.distances) distance /= voxel_size;
  return voxels;
}

// A surface point of a removed piece has a voxel of the piece among the eight around it.
void mark_removed(Voxels& voxels, const CoordBBox& sample, const PhaseImage& before,
                  const PhaseImage& after) {
  constexpr float cell_diagonal = 1.7321f;
  std::size_t voxel = 0;
  voxels.for_each(sample, [&](const Coord& at) {
    const bool stays = before.solid[voxel] == after.solid[voxel];
    ++voxel;
    if (stays) return;
    voxels.states[voxels.offset(at)] = State::removed;
    if (voxels.distances[voxels.offset(at)] < -cell_diagonal - rebuilt_error) return;
    voxels.for_each_around(at, [&](std::size_t other, float way) {
      const float distance = voxels.distances[other];
      if (distance >= 0 && way <= distance + cell_diagonal + rebuilt_error)
        voxels.states[other] = State::doubtful;
    });
  });
}

// Distance to the solid that stays, of a voxel outside it.
float rebuilt_distance(const Voxels& voxels, const Coord& at) {
  float least = HUGE_VALF;
  voxels.for_each_around(at, [&](std::size_t other, float way) {
    if (voxels.states[other] == State::kept) least = std::min(least, voxels.distances[other] + way);
  });
  return std::max(least, least_distance);
}

LevelSet rebuild(const LevelSet& surface, const Voxels& voxels) {
  const auto grid = surface.grid->deepCopy();
  const float background = grid->background(), voxel_size = float(grid->voxelSize()[0]);
  const Coord &low = voxels.box.min(), &high = voxels.box.max();
  std::vector<std::vector<std::pair<Coord, float>>> changes(std::size_t(high[2] - low[2] + 1));
  tbb::parallel_for(low[2], high[2] + 1, [&](int k) {
    voxels.for_each(CoordBBox(low[0], low[1], k, high[0], high[1], k), [&](const Coord& at) {
      const std::size_t voxel = voxels.offset(at);
      if (voxels.states[voxel] == State::kept) return;
      const float distance = rebuilt_distance(voxels, at);
      if (voxels.states[voxel] == State::removed || distance > voxels.distances[voxel] + rebuilt_error)
        changes[std::size_t(k - low[2])].emplace_back(at, distance * voxel_size);
    });
  });
  auto values = grid->getAccessor();
  for (const auto& plane : changes)
    for (const auto& [at, distance] : plane) {
      if (distance < background)
        values.setValue(at, distance);
      else
        values.setValueOff(at, background);
    }
  openvdb::tools::pruneLevelSet(grid->tree());
  return {grid, surface.unit};
}

}  // namespace

CleanedMicrostructure remove_unconnected(const Microstructure& structure, SpanningRule rule,
                                         Connectivity connectivity) {
  const openvdb::FloatGrid& grid = *structure.surface->grid;
  const CoordBBox sample = sample_voxels(structure);
  Voxels voxels = read_voxels(grid, sample);
  PhaseImage image{structure.lattice.points, structure.lattice.spacing, {}};
  image.solid.reserve(image.count());
  voxels.for_each(sample, [&](const Coord& at) {
    image.solid.push_back(voxels.distances[voxels.offset(at)] < 0 ? 1 : 0);
  });

  const CleanedImage cleaned = remove_unconnected(image, rule, connectivity);
  mark_removed(voxels, sample, image, cleaned.image);
  CleanedMicrostructure result{structure, cleaned.solid_voxels, cleaned.connected_voxels,
                               cleaned.removed_clusters};
  result.structure.surface = std::make_shared<LevelSet>(rebuild(*structure.surface, voxels));
  result.structure.solid_points = cleaned.connected_voxels;
  result.structure.metadata["solid_fraction_achieved"] = cleaned.connected_solid_fraction;
  result.structure.metadata["clean"] = name_of(rule);
  result.structure.metadata["clean_connectivity"] = std::int64_t(connectivity);
  return result;
}

}  // namespace anticrack
