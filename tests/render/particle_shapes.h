#pragma once

#include <cmath>
#include <functional>
#include <vector>

#include "camera.h"
#include "mesh.h"

namespace anticrack::testing_shapes {

/// Particles at lattice points x = h (i + 1/2) that a shape keeps, each with a value.
struct Particles {
  double spacing = 0;
  std::vector<Point> position;
  std::vector<float> scalar;
  Box box;
};

inline Particles make_particles(std::array<int, 3> points, double spacing,
                                const std::function<bool(const Vec3&)>& solid,
                                const std::function<double(const Vec3&)>& value) {
  Particles p;
  p.spacing = spacing;
  p.box = {Vec3::Zero(), spacing * Vec3(points[0], points[1], points[2])};
  for (int k = 0; k < points[2]; ++k) {
    for (int j = 0; j < points[1]; ++j) {
      for (int i = 0; i < points[0]; ++i) {
        const Vec3 x = spacing * Vec3(i + 0.5, j + 0.5, k + 0.5);
        if (!solid(x)) continue;
        p.position.push_back({float(x.x()), float(x.y()), float(x.z())});
        p.scalar.push_back(float(value(x)));
      }
    }
  }
  return p;
}

/// A ball of radius 1 in the middle of a box of edge 2.5, at 40 points along the edge.
inline Particles ball(double value = 0) {
  const Vec3 centre(1.25, 1.25, 1.25);
  return make_particles(
      {40, 40, 40}, 2.5 / 40, [=](const Vec3& x) { return (x - centre).norm() < 1; },
      [=](const Vec3&) { return value; });
}

/// A solid block 1 x 2 x 1.
inline Particles block(const std::function<double(const Vec3&)>& value, int points = 24) {
  return make_particles(
      {points, 2 * points, points}, 1.0 / points, [](const Vec3&) { return true; }, value);
}

/// A porous block 1 x 2 x 1: the level cut of a product of sines, with a band of value 1 across its middle.
inline Particles porous_block(int points = 32) {
  const auto solid = [](const Vec3& x) {
    return std::sin(13 * x.x()) * std::cos(11 * x.y()) + std::sin(12 * x.y()) * std::cos(14 * x.z()) > 0.1;
  };
  return make_particles({points, 2 * points, points}, 1.0 / points, solid,
                        [](const Vec3& x) { return std::exp(-std::pow((x.y() - 1) / 0.2, 4)); });
}

}  // namespace anticrack::testing_shapes
