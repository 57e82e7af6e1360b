#include <fmt/format.h>
#include <openvdb/tools/Interpolation.h>
#include <tbb/parallel_for.h>

#include <cmath>

#include "errors.h"
#include "level_set.h"
#include "microstructure.h"

namespace anticrack {
namespace {

// The voxel's own value at a voxel, up to the rounding of the transform; else trilinear.
double sample(const openvdb::FloatGrid::ConstAccessor& voxels, const openvdb::Vec3d& index) {
  const openvdb::Vec3d nearest(std::round(index[0]), std::round(index[1]), std::round(index[2]));
  constexpr double rounding = 1e-6;
  if ((index - nearest).length() < rounding)
    return voxels.getValue(openvdb::Coord(int(nearest[0]), int(nearest[1]), int(nearest[2])));
  return openvdb::tools::BoxSampler::sample(voxels, index);
}

}  // namespace

std::vector<Vec3> seed_particles(const Microstructure& structure, const SampleLattice& lattice) {
  const openvdb::FloatGrid& grid = *structure.surface->grid;
  const double metres = structure.surface->unit.metres;
  const auto [nx, ny, nz] = lattice.points;
  std::vector<std::vector<Vec3>> slabs(nz);
  tbb::parallel_for(0, nz, [&, nx = nx, ny = ny](int k) {
    const auto voxels = grid.getConstAccessor();
    for (int j = 0; j < ny; ++j) {
      for (int i = 0; i < nx; ++i) {
        const Vec3 position = lattice.point(i, j, k), world = (structure.origin + position) / metres;
        if (sample(voxels, grid.worldToIndex(openvdb::Vec3d(world[0], world[1], world[2]))) < 0)
          slabs[k].push_back(position);
      }
    }
  });

  std::vector<std::size_t> first(nz + 1, 0);
  for (int k = 0; k < nz; ++k) first[k + 1] = first[k] + slabs[k].size();
  if (first[nz] == 0)
    throw InputError(fmt::format(
        "no point of the lattice {} x {} x {}, spacing {:g} m, lies in the solid of the level set", nx, ny,
        nz, lattice.spacing));
  std::vector<Vec3> positions(first[nz]);
  tbb::parallel_for(
      0, nz, [&](int k) { std::ranges::copy(slabs[k], positions.begin() + std::ptrdiff_t(first[k])); });
  return positions;
}

}  // namespace anticrack
