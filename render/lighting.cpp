#include "lighting.h"

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>
#include <vector>

#include "vec3.h"

namespace anticrack {

namespace {

constexpr double golden_angle = std::numbers::pi * (3 - 2.2360679774997896964);  // pi (3 - sqrt 5)

/// Fibonacci spiral over the cap of directions whose cosine to `axis` is at least `cosine`.
std::vector<Point> spiral(const Vec3& axis, double cosine, int count) {
  const Vec3 side = axis.unitOrthogonal();
  const Vec3 other = axis.cross(side);
  std::vector<Point> directions;
  for (int i = 0; i < count; ++i) {
    const double z = 1 - (1 - cosine) * (i + 0.5) / count;
    const double r = std::sqrt(1 - z * z);
    const Vec3 d = z * axis + r * (std::cos(golden_angle * i) * side + std::sin(golden_angle * i) * other);
    directions.push_back({float(d.x()), float(d.y()), float(d.z())});
  }
  return directions;
}

}  // namespace

std::span<const Point> sky_directions() {
  static const std::vector<Point> directions = spiral(Vec3(0.36, 0.8, 0.48), -1, 64);
  return directions;
}

std::span<const Point> key_directions() {
  static const std::vector<Point> directions = spiral(
      Vec3(key_direction[0], key_direction[1], key_direction[2]), std::cos(10 * std::numbers::pi / 180), 16);
  return directions;
}

}  // namespace anticrack
