#pragma once

#include <array>
#include <span>
#include <vector>

namespace anticrack {

/// Volume rasters of a set of particles in blocks of 8x8x8 voxels; blocks without solid are left out.
///
/// Voxel (i, j, k) is the cube of edge `spacing` centred on spacing * (i + 1/2, j + 1/2, k + 1/2), where a
/// particle of the undeformed lattice sits.
struct SolidRaster {
  static constexpr int edge = 8;
  using Block = std::array<float, edge * edge * edge>;  ///< z fastest, then y, then x

  std::vector<std::array<int, 3>> origin;  ///< lowest voxel of each block, a multiple of 8
  std::vector<Block> solid;  ///< solid volume over voxel volume [-], 1 inside the undeformed solid
  std::vector<Block> kappa;  ///< average over the solid in the voxel; empty without kappa
};

/// Spreads each particle's volume, spacing^3, by the quadratic B-spline. Bits depend on the order of the
/// particles, not on the number of threads.
/// @param position  [m], finite, at most 2^23 spacings from the origin
/// @param kappa     one per particle, finite; or empty
SolidRaster rasterize_solid(std::span<const std::array<float, 3>> position, std::span<const float> kappa,
                            double spacing);

}  // namespace anticrack
