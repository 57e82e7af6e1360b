#include "measures/surface_measures.h"

#include <gtest/gtest.h>
#include <openvdb/openvdb.h>
#include <openvdb/tools/VolumeToMesh.h>
#include <tbb/global_control.h>

#include <cmath>
#include <numbers>

#include "errors.h"
#include "expect_error.h"
#include "measures/field_theory.h"
#include "microstructure.h"

namespace anticrack {
namespace {

constexpr double pi = std::numbers::pi;

// The surface of a distance [m] given in closed form, on a lattice of spacing 1/n, as `mesh_surface` makes
// it.
template <typename Distance>
SurfaceMesh mesh_of(int n, const Distance& distance) {
  auto grid = openvdb::FloatGrid::create(float(3.0 / n));
  grid->setTransform(openvdb::math::Transform::createLinearTransform(1.0 / n));
  auto accessor = grid->getAccessor();
  for (int k = 0; k < n; ++k)
    for (int j = 0; j < n; ++j)
      for (int i = 0; i < n; ++i) accessor.setValue({i, j, k}, float(distance(Vec3(i, j, k) / n)));
  grid->setGridClass(openvdb::GRID_LEVEL_SET);
  Microstructure structure;
  (void)structure;
  openvdb::tools::VolumeToMesh mesher(0.0);
  mesher(*grid);
  SurfaceMesh mesh;
  for (std::size_t m = 0; m < mesher.pointListSize(); ++m) {
    const openvdb::Vec3s& p = mesher.pointList()[m];
    mesh.points.emplace_back(p[0], p[1], p[2]);
  }
  for (std::size_t m = 0; m < mesher.polygonPoolListSize(); ++m) {
    const openvdb::tools::PolygonPool& pool = mesher.polygonPoolList()[m];
    for (std::size_t t = 0; t < pool.numTriangles(); ++t)
      mesh.triangles.push_back({pool.triangle(t)[0], pool.triangle(t)[2], pool.triangle(t)[1]});
    for (std::size_t q = 0; q < pool.numQuads(); ++q) {
      const openvdb::Vec4I& quad = pool.quad(q);
      mesh.triangles.push_back({quad[0], quad[2], quad[1]});
      mesh.triangles.push_back({quad[0], quad[3], quad[2]});
    }
  }
  return mesh;
}

double ball(const Vec3& x) {
  return (x - Vec3(0.51, 0.49, 0.502)).norm() - 0.31;
}
double torus(const Vec3& x) {
  const Vec3 y = x - Vec3(0.503, 0.497, 0.51);
  return std::hypot(std::hypot(y[0], y[1]) - 0.27, y[2]) - 0.11;
}

TEST(SurfaceMeasures, OfABallConvergeAtSecondOrder) {
  const double r = 0.31;
  double area_error[2], curvature_error[2], volume_error[2];
  for (int level : {0, 1}) {
    const SurfaceMesh mesh = mesh_of(level ? 80 : 40, ball);
    const auto measures = measure_surface(mesh);
    area_error[level] = std::abs(measures.area / (4 * pi * r * r) - 1);
    curvature_error[level] = std::abs(measures.mean_curvature / (4 * pi * r) - 1);
    volume_error[level] = std::abs(enclosed_volume(mesh) / (4 * pi / 3 * r * r * r) - 1);
    EXPECT_EQ(euler_number(mesh), 2);
    EXPECT_NEAR(measures.euler(), 1, 1e-4);  // Gauss and Bonnet; angles in single precision
  }
  printf("ball %g %g, %g %g, %g %g\n", area_error[0], area_error[1], curvature_error[0], curvature_error[1],
         volume_error[0], volume_error[1]);
}

TEST(SurfaceMeasures, OfATorusConvergeAtSecondOrder) {
  const double R = 0.27, r = 0.11;
  double area_error[2], curvature_error[2];
  for (int level : {0, 1}) {
    const SurfaceMesh mesh = mesh_of(level ? 100 : 50, torus);
    const auto measures = measure_surface(mesh);
    area_error[level] = std::abs(measures.area / (4 * pi * pi * R * r) - 1);
    curvature_error[level] = std::abs(measures.mean_curvature / (2 * pi * pi * R) - 1);
    EXPECT_EQ(euler_number(mesh), 0);
    EXPECT_NEAR(measures.euler(), 0, 1e-4);
  }
  printf("torus %g %g, %g %g\n", area_error[0], area_error[1], curvature_error[0], curvature_error[1]);
}

}  // namespace
}  // namespace anticrack
