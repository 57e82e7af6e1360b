#include "surface.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

#include "errors.h"
#include "expect_error.h"
#include "particle_shapes.h"

namespace anticrack {
namespace {

using namespace testing_shapes;

Mesh surface_of(const Particles& p) {
  return extract_surface(SolidField(p.position, p.scalar, p.spacing));
}

Vec3 vec(const Point& p) {
  return {p[0], p[1], p[2]};
}

double volume(const Mesh& mesh) {
  double sum = 0;
  for (const auto& t : mesh.triangle) {
    sum += vec(mesh.position[t[0]]).dot(vec(mesh.position[t[1]]).cross(vec(mesh.position[t[2]]))) / 6;
  }
  return sum;
}

TEST(Surface, OfABallOfParticlesIsTheBall) {
  const Particles p = ball();
  const Mesh mesh = surface_of(p);
  const Vec3 centre(1.25, 1.25, 1.25);
  for (std::size_t i = 0; i < mesh.position.size(); ++i) {
    const Vec3 d = vec(mesh.position[i]) - centre;
    // A lattice of points knows its surface to half a spacing.
    ASSERT_NEAR(d.norm(), 1, 0.5 * p.spacing);
    ASSERT_GT(vec(mesh.normal[i]).dot(d.normalized()), 0.97);
    ASSERT_NEAR(vec(mesh.normal[i]).norm(), 1, 1e-5);
  }
  // Smoothing moves a surface of curvature 1/R by about spacing^2 / R, 0.4 % of R here: 1.2 % of the volume.
  EXPECT_NEAR(volume(mesh), 4 * std::numbers::pi / 3, 0.03);
}

TEST(Surface, KeepsTheVolumeOfThinLigaments) {
  const Particles p = porous_block();
  const double particles = double(p.position.size()) * std::pow(p.spacing, 3);
  // Some ligaments are two particles thick: 3.6 % are lost, an isosurface at one half loses 9.0 % (measured).
  EXPECT_NEAR(volume(surface_of(p)) / particles, 1, 0.05);
}

TEST(Surface, OfABlockLiesOnItsFaces) {
  const Particles p = block([](const Vec3&) { return 0; });
  const Mesh mesh = surface_of(p);
  int on_front = 0;
  for (std::size_t i = 0; i < mesh.position.size(); ++i) {
    const Point& x = mesh.position[i];
    const auto inside = [](float c, double length) { return c > 0.2 && c < length - 0.2; };
    if (!inside(x[0], 1) || !inside(x[1], 2) || x[2] < 0.5) continue;
    // The isovalue lies 0.001 below one half, which moves a face by about that part of a spacing.
    EXPECT_NEAR(x[2], 1, 0.01 * p.spacing);
    EXPECT_NEAR(mesh.normal[i][2], 1, 1e-4);
    ++on_front;
  }
  EXPECT_GT(on_front, 100);
}

TEST(Surface, IsClosed) {
  // Every edge lies between as many triangles that run along it as run against it.
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> balance;
  for (const auto& t : surface_of(porous_block(20)).triangle) {
    for (int e = 0; e < 3; ++e) {
      const std::uint32_t a = t[std::size_t(e)];
      const std::uint32_t b = t[std::size_t((e + 1) % 3)];
      balance[{std::min(a, b), std::max(a, b)}] += a < b ? 1 : -1;
    }
  }
  EXPECT_TRUE(std::all_of(balance.begin(), balance.end(), [](const auto& edge) { return edge.second == 0; }));
}

TEST(Surface, CarriesTheParticlesScalar) {
  const Particles p = block([](const Vec3& x) { return 3 + x.y(); });
  const Mesh mesh = surface_of(p);
  for (std::size_t i = 0; i < mesh.position.size(); ++i) {
    // At the two ends only particles on one side weigh in: half a kernel, about a spacing.
    ASSERT_NEAR(mesh.scalar[i], 3 + mesh.position[i][1], 1.2 * p.spacing);
  }
}

TEST(Surface, IsTheSameForAnyNumberOfThreads) {
  const Particles p = porous_block();
  const Mesh reference = surface_of(p);
  for (const std::size_t threads : {1, 2, 5}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    const Mesh mesh = surface_of(p);
    EXPECT_EQ(mesh.position, reference.position);
    EXPECT_EQ(mesh.normal, reference.normal);
    EXPECT_EQ(mesh.scalar, reference.scalar);
    EXPECT_EQ(mesh.triangle, reference.triangle);
  }
}

TEST(SolidField, HoldsTheParticlesMassAndScalar) {
  const Particles p = porous_block(20);
  const SolidField field(p.position, p.scalar, p.spacing);
  double fraction = 0;
  double weighted = 0;
  for (const auto& block : field.blocks()) {
    for (const float f : block.fraction) fraction += double(f);
    for (const float w : block.weighted) weighted += double(w);
  }
  double sum = 0;
  for (const float s : p.scalar) sum += double(s);
  // Single-precision weights: relative rounding of 1e-7 each.
  EXPECT_NEAR(fraction, double(p.position.size()), 1e-5 * fraction);
  EXPECT_NEAR(weighted, sum, 1e-5 * sum);
}

TEST(SolidField, IsOneInsideAndZeroFarAway) {
  const Particles p = block([](const Vec3& x) { return x.x(); });
  const SolidField field(p.position, p.scalar, p.spacing);
  EXPECT_NEAR(field.at({0.5f, 1, 0.5f}).fraction, 1, 1e-5);
  EXPECT_NEAR(field.at({0.4f, 1, 0.5f}).scalar, 0.4, 1e-5);  // splines reproduce linear fields
  EXPECT_EQ(field.at({9, 9, 9}).fraction, 0);
  EXPECT_EQ(field.at({1e30f, 0, 0}).fraction, 0);
}

TEST(SolidField, OfAFarStrayStaysSmall) {
  Particles p = ball();
  const std::size_t before = SolidField(p.position, p.scalar, p.spacing).blocks().size();
  p.position.push_back({4000, 4000, 4000});
  p.scalar.push_back(0);
  EXPECT_LE(SolidField(p.position, p.scalar, p.spacing).blocks().size(), before + 27);
}

TEST(SolidField, RefusesBadInput) {
  const std::vector<Point> one{{0, 0, 0}};
  const std::vector<float> value{1};
  EXPECT_ERROR(SolidField({}, {}, 1), InputError, "no particles to draw");
  EXPECT_ERROR(SolidField(one, {}, 1), InputError, "got 0 values for 1 particles; expected one a particle");
  EXPECT_ERROR(SolidField(one, value, 0), InputError, "particle spacing = 0.000000 m; expected > 0");
  EXPECT_ERROR(SolidField(std::vector<Point>{{NAN, 0, 0}}, value, 1), InputError,
               "position of particle 0 is nan m; expected a finite number below");
  EXPECT_ERROR(SolidField(std::vector<Point>{{1e30f, 0, 0}}, value, 1), InputError,
               "position of particle 0 is ");
  EXPECT_ERROR(SolidField(one, std::vector<float>{NAN}, 1), InputError, "value of particle 0 is not finite");
}

}  // namespace
}  // namespace anticrack
