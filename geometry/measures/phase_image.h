#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "vec3.h"

namespace anticrack {

enum class Phase : std::uint8_t { pore = 0, solid = 1 };

/// Which voxels of a sample are solid: what every voxel measure works on, wherever the sample comes from.
struct PhaseImage {
  Index3 size;                      ///< voxels along x, y, z; each >= 1
  double voxel_size;                ///< h [m], > 0
  std::vector<std::uint8_t> solid;  ///< 1 solid, 0 pore; x fastest, then y, then z

  std::size_t count() const { return std::size_t(size[0]) * std::size_t(size[1]) * std::size_t(size[2]); }
  std::size_t offset(int i, int j, int k) const {
    return (std::size_t(k) * std::size_t(size[1]) + std::size_t(j)) * std::size_t(size[0]) + std::size_t(i);
  }
  bool is(Phase phase, std::size_t voxel) const { return solid[voxel] == std::uint8_t(phase); }
  Vec3 box() const { return voxel_size * Vec3(size[0], size[1], size[2]); }  ///< edges [m]
};

}  // namespace anticrack
