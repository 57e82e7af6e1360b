#include "level_sets/surface_mesh.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "microstructure.h"

namespace anticrack {
namespace {

double volume(const SurfaceMesh& mesh) {
  double six_volumes = 0;
  for (const auto& [a, b, c] : mesh.triangles) {
    const Vec3 p = mesh.points[a].cast<double>();
    six_volumes += p.dot(mesh.points[b].cast<double>().cross(mesh.points[c].cast<double>()));
  }
  return six_volumes / 6;
}

TEST(SurfaceMesh, OfABlockEnclosesItsVolumeAndFacesOutwards) {
  const SampleLattice lattice{{20, 30, 24}, 0.05};
  // Dual contouring of a distance cuts edges and corners: less than a tenth of a voxel square along each
  // edge.
  const double full = lattice.size().prod(), edges = 4 * lattice.size().sum() * 0.05 * 0.05;
  const double enclosed = volume(mesh_surface(full_block(lattice)));
  EXPECT_LE(enclosed, full * (1 + 1e-6));
  EXPECT_GE(enclosed, full - 0.25 * edges);
}

}  // namespace
}  // namespace anticrack
