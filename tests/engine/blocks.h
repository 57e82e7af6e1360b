#pragma once

#include <random>
#include <vector>

#include "vec3.h"

namespace anticrack {

/// Centres of `points` lattice cells of edge `h`, from `corner` on.
inline std::vector<Vec3> block(const Index3& points, double h, const Vec3& corner = Vec3::Zero()) {
  std::vector<Vec3> x;
  for (int i = 0; i < points[0]; ++i)
    for (int j = 0; j < points[1]; ++j)
      for (int k = 0; k < points[2]; ++k) x.push_back(corner + h * Vec3(i + 0.5, j + 0.5, k + 0.5));
  return x;
}

/// Those of a block that remain if each is kept with probability `share`: holes, fragments, lone particles,
/// and nodes of all masses.
inline std::vector<Vec3> porous_block(const Index3& points, double h, double share,
                                      const Vec3& corner = Vec3::Zero()) {
  std::mt19937 random(7);
  std::uniform_real_distribution<> uniform(0, 1);
  std::vector<Vec3> x;
  for (const Vec3& p : block(points, h, corner))
    if (uniform(random) < share) x.push_back(p);
  return x;
}

}  // namespace anticrack
