#pragma once

#include <cstddef>

#include "vec3.h"

namespace anticrack {

/// The regular lattice on which a sample is resolved: one point at the centre of each cube of edge `spacing`.
///
/// The sample box is [0, points * spacing]. Cell centres, not corners: 131 corner points at spacing L/130
/// would carry 2.3 % too much solid.
struct SampleLattice {
  Index3 points;   ///< lattice points along x, y, z; each >= 1
  double spacing;  ///< h [m], > 0

  Vec3 size() const { return spacing * Vec3(points[0], points[1], points[2]); }  ///< box edges [m]
  Vec3 point(int i, int j, int k) const { return spacing * Vec3(i + 0.5, j + 0.5, k + 0.5); }  ///< [m]
  std::size_t count() const {
    return std::size_t(points[0]) * std::size_t(points[1]) * std::size_t(points[2]);
  }
};

}  // namespace anticrack
