#include "level_sets/surface_mesh.h"

#include <openvdb/tools/VolumeToMesh.h>

#include "level_sets/level_set.h"
#include "microstructure.h"

namespace anticrack {

SurfaceMesh mesh_surface(const Microstructure& structure) {
  openvdb::tools::VolumeToMesh mesher(0.0);
  mesher(*structure.surface->grid);
  const auto metres = float(structure.surface->unit.metres);

  SurfaceMesh mesh;
  mesh.points.reserve(mesher.pointListSize());
  const Eigen::Vector3f origin = structure.origin.cast<float>();
  for (std::size_t n = 0; n < mesher.pointListSize(); ++n) {
    const openvdb::Vec3s& p = mesher.pointList()[n];
    mesh.points.push_back(metres * Eigen::Vector3f(p[0], p[1], p[2]) - origin);
  }

  // OpenVDB's polygons run clockwise seen from outside.
  const auto add = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
    mesh.triangles.push_back({a, c, b});
  };
  for (std::size_t n = 0; n < mesher.polygonPoolListSize(); ++n) {
    const openvdb::tools::PolygonPool& pool = mesher.polygonPoolList()[n];
    for (std::size_t i = 0; i < pool.numTriangles(); ++i)
      add(pool.triangle(i)[0], pool.triangle(i)[1], pool.triangle(i)[2]);
    for (std::size_t i = 0; i < pool.numQuads(); ++i) {
      const openvdb::Vec4I& quad = pool.quad(i);
      add(quad[0], quad[1], quad[2]);
      add(quad[0], quad[2], quad[3]);
    }
  }
  return mesh;
}

}  // namespace anticrack
