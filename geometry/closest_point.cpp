#include "closest_point.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>

namespace anticrack {
namespace {

// Axes along which the point is held on a face of the box: -1 lower, +1 upper, 0 free.
using Held = std::array<int, 3>;

// An orthonormal basis of the directions that are free and normal to `gradient` (itself free); missing ones
// are zero.
std::array<Vec3, 2> tangents(const Vec3& gradient, const Held& held) {
  const int held_axes = std::abs(held[0]) + std::abs(held[1]) + std::abs(held[2]);
  if (held_axes == 0) {
    const Vec3 first = gradient.unitOrthogonal();
    return {first, gradient.cross(first).normalized()};
  }
  if (held_axes == 1) {
    const Vec3 face(std::abs(held[0]), std::abs(held[1]), std::abs(held[2]));
    return {gradient.cross(face).normalized(), Vec3::Zero()};
  }
  return {Vec3::Zero(), Vec3::Zero()};
}

// Newton's step to the minimum of |y - x|^2 / 2 on {field = 0} from y, within the free axes; x_y = x - y.
// With the Lagrangian |y - x|^2 / 2 - lambda f, the part along the gradient solves the constraint, and the
// part along the tangents T solves (T^t M T) s = T^t (x - y - M normal), M = I - lambda H; T^t M T is kept
// positive, so that the step heads for a minimum.
Vec3 newton_step(const FieldJet& jet, const Vec3& free_gradient, const Vec3& x_y, const Held& held) {
  const double squared = free_gradient.squaredNorm();
  const Vec3 normal = free_gradient * (-jet.value / squared);
  const double lambda = -x_y.dot(free_gradient) / squared;
  const Mat3 m = Mat3::Identity() - lambda * jet.hessian;
  const auto [t0, t1] = tangents(free_gradient, held);
  const Vec3 residual = x_y - m * normal;
  double a = t0.dot(m * t0), b = t0.dot(m * t1), c = t1.isZero() ? 1.0 : t1.dot(m * t1);
  const double r0 = t0.dot(residual), r1 = t1.dot(residual);
  constexpr double least = 0.2;
  const double smallest = 0.5 * (a + c) - std::sqrt(0.25 * (a - c) * (a - c) + b * b);
  if (smallest < least) a += least - smallest, c += least - smallest;
  const double determinant = a * c - b * b;
  Vec3 step = normal + t0 * ((c * r0 - b * r1) / determinant) + t1 * ((a * r1 - b * r0) / determinant);
  const double length = step.norm();
  if (length > 1.0) step /= length;
  return step;
}

}  // namespace

std::optional<Vec3> find_closest_point(const PaddedField& field, const Vec3& x, const Vec3& start) {
  const Vec3 lower = Vec3::Constant(-0.5);
  const Vec3 upper = Vec3(field.points[0], field.points[1], field.points[2]) - Vec3::Constant(0.5);
  constexpr int most_iterations = 12;
  // The tangential error is then about its square, and the error of the distance the square of that.
  constexpr double settled = 0.15;

  Vec3 y = start;
  Held held{};
  bool released = false;
  for (int iteration = 0; iteration < most_iterations; ++iteration) {
    const FieldJet jet = interpolate_jet(field, y);
    Vec3 gradient = jet.gradient;
    for (int axis = 0; axis < 3; ++axis)
      if (held[axis] != 0) gradient[axis] = 0.0;
    const double squared = gradient.squaredNorm();
    if (!(squared > 1e-12)) return std::nullopt;
    const Vec3 step = newton_step(jet, gradient, x - y, held);

    // Stop at the faces.
    bool stopped = false;
    Vec3 next = y + step;
    for (int axis = 0; axis < 3; ++axis) {
      if (next[axis] < lower[axis] || next[axis] > upper[axis]) {
        held[axis] = next[axis] < lower[axis] ? -1 : 1;
        next[axis] = std::clamp(next[axis], lower[axis], upper[axis]);
        stopped = true;
      }
    }
    y = next;
    if (stopped || step.squaredNorm() > settled * settled) continue;

    // A face binds only while the way to the minimum leads out through it.
    if (!released) {
      const Vec3 pull = (x - y) + jet.gradient * (-(x - y).dot(gradient) / squared);
      for (int axis = 0; axis < 3; ++axis) {
        if (held[axis] * pull[axis] < 0) held[axis] = 0, released = true;
      }
      if (released) continue;
    }
    y -= gradient * (interpolate_value(field, y) / squared);
    return y.cwiseMax(lower).cwiseMin(upper);
  }
  return std::nullopt;
}

}  // namespace anticrack
