#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstddef>
#include <vector>

#include "vec3.h"

namespace anticrack {

/// A scalar at the points of a lattice and at `padding` more points beyond each face; x fastest.
///
/// Index space: lattice point (i, j, k) lies at (i, j, k), the sample box is [-1/2, points - 1/2].
struct PaddedField {
  static constexpr int padding = 3;  // what the six-point stencil needs on the faces of the box

  Index3 points;              ///< without the padding
  std::vector<float> values;  ///< (points + 2 padding) of them along each axis

  std::size_t row_stride() const { return std::size_t(points[0] + 2 * padding); }
  std::size_t plane_stride() const { return row_stride() * std::size_t(points[1] + 2 * padding); }
  std::size_t offset(int i, int j, int k) const {
    return std::size_t(k + padding) * plane_stride() + std::size_t(j + padding) * row_stride() +
           std::size_t(i + padding);
  }
  float at(int i, int j, int k) const { return values[offset(i, j, k)]; }
};

/// Value, gradient and second derivatives of a field at a point, index space.
struct FieldJet {
  double value;
  Vec3 gradient;
  Mat3 hessian;
};

/// Cubic Lagrange interpolation on the 4^3 nearest points. Error of the value: 0.023 (eta h)^4 of a wave's
/// amplitude.
/// @param x  in the sample box, index space
FieldJet interpolate_jet(const PaddedField& field, const Vec3& x);

/// Quintic Lagrange interpolation on the 6^3 nearest points; error 0.005 (eta h)^6 of a wave's amplitude.
/// @param x  in the sample box, index space
double interpolate_value(const PaddedField& field, const Vec3& x);

/// Septic Lagrange interpolation on 8^3 points, the nearest but beside the faces of the box, where the
/// stencil is shifted by a point; error 0.0011 (eta h)^8 of a wave's amplitude. Takes some ten times as long
/// as the cubic one.
/// @param field  at least two points along each axis
/// @param x      in the sample box, index space
FieldJet interpolate_jet_finely(const PaddedField& field, const Vec3& x);

}  // namespace anticrack
