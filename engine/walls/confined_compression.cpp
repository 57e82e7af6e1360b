#include "walls/walls.h"

namespace anticrack {

std::array<Wall, 6> confined_compression_walls(const ConfinedCompression& loading, const Vec3& size) {
  std::array<Wall, 6> walls;
  for (int axis = 0; axis < 3; ++axis)
    for (int upper = 0; upper < 2; ++upper) {
      const bool moves = axis == loading.axis && (upper || loading.both_platens);
      walls[2 * axis + upper] = {axis, bool(upper), upper ? size[axis] : 0.0,
                                 moves ? (upper ? -1 : 1) * loading.speed : 0.0};
    }
  return walls;
}

}  // namespace anticrack
