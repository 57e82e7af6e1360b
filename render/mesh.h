#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

namespace anticrack {

using Point = std::array<float, 3>;  ///< world space [m]

/// Triangles with what shading needs at each vertex; normals point out of the solid.
struct Mesh {
  std::vector<Point> position;
  std::vector<Point> normal;                           ///< unit length
  std::vector<float> scalar;                           ///< the coloured quantity
  std::vector<std::array<std::uint32_t, 3>> triangle;  ///< counter-clockwise seen from outside
  float spacing = 0;                                   ///< [m] of the lattice it was made on
};

/// Particles drawn as spheres of one radius.
struct SphereCloud {
  std::vector<Point> position;
  std::vector<float> scalar;
  float radius = 0;  ///< [m]
};

/// Removes the half space normal . x > offset, to look inside.
struct CutPlane {
  Point normal{};    ///< unit length
  float offset = 0;  ///< [m]

  float distance(const Point& x) const {
    return normal[0] * x[0] + normal[1] * x[1] + normal[2] * x[2] - offset;
  }
};

}  // namespace anticrack
