#include "walls/walls.h"

namespace anticrack {

std::array<Wall, 6> triaxial_walls(const TriaxialLoading& loading, const Vec3& size, double cell_size) {
  const Vec3 rate =
      loading.strain_rate * Vec3(loading.beta2 + loading.beta1, loading.beta2 - loading.beta1, loading.beta2);
  std::array<Wall, 6> walls;
  for (int axis = 0; axis < 3; ++axis)
    for (int upper = 0; upper < 2; ++upper) {
      // Each wall moves at rate * L, so that eps_V = 6 t beta2 strain_rate as the paper counts it.
      Wall wall{axis, bool(upper), upper ? size[axis] : 0.0, (upper ? 1 : -1) * rate[axis] * size[axis]};
      const bool pulls = rate[axis] > 0;
      switch (loading.walls) {
        case WallKind::sticky:
          wall.tangential = Tangential::fixed;
          break;
        case WallKind::slip:
          break;
        case WallKind::affine:
          wall.tangential = Tangential::affine;
          break;
        case WallKind::paper:
          if (pulls) wall.tangential = Tangential::fixed, wall.grip_depth = cell_size;
          break;
      }
      walls[2 * axis + upper] = wall;
    }
  return walls;
}

}  // namespace anticrack
