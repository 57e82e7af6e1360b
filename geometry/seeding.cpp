#include <fmt/format.h>
#include <openvdb/tools/Interpolation.h>
#include <tbb/parallel_for.h>

#include <cmath>

#include "level_sets/level_set.h"
#include "microstructure.h"
#include "solid_lattice.h"

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

void find_solid_points(const Microstructure& structure, const SampleLattice& lattice, int k,
                       std::span<std::uint8_t> solid) {
  const openvdb::FloatGrid& grid = *structure.surface->grid;
  const auto voxels = grid.getConstAccessor();
  const double metres = structure.surface->unit.metres;
  std::uint8_t* to = solid.data();
  for (int j = 0; j < lattice.points[1]; ++j)
    for (int i = 0; i < lattice.points[0]; ++i) {
      const Vec3 world = (structure.origin + lattice.point(i, j, k)) / metres;
      *to++ = sample(voxels, grid.worldToIndex(openvdb::Vec3d(world[0], world[1], world[2]))) < 0;
    }
}

InputError no_solid_point(const SampleLattice& lattice) {
  return InputError(
      fmt::format("no point of the lattice {} x {} x {}, spacing {:g} m, lies in the solid of the level set",
                  lattice.points[0], lattice.points[1], lattice.points[2], lattice.spacing));
}

std::vector<Vec3> seed_particles(const Microstructure& structure, const SampleLattice& lattice) {
  const auto [nx, ny, nz] = lattice.points;
  std::vector<std::vector<Vec3>> slabs(nz);
  tbb::parallel_for(0, nz, [&, nx = nx, ny = ny](int k) {
    std::vector<std::uint8_t> solid(std::size_t(nx) * std::size_t(ny));
    find_solid_points(structure, lattice, k, solid);
    const std::uint8_t* is_solid = solid.data();
    for (int j = 0; j < ny; ++j)
      for (int i = 0; i < nx; ++i)
        if (*is_solid++) slabs[k].push_back(lattice.point(i, j, k));
  });

  std::vector<std::size_t> first(nz + 1, 0);
  for (int k = 0; k < nz; ++k) first[k + 1] = first[k] + slabs[k].size();
  if (first[nz] == 0) throw no_solid_point(lattice);
  std::vector<Vec3> positions(first[nz]);
  tbb::parallel_for(
      0, nz, [&](int k) { std::ranges::copy(slabs[k], positions.begin() + std::ptrdiff_t(first[k])); });
  return positions;
}

}  // namespace anticrack
