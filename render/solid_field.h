#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "mesh.h"

namespace anticrack {

/// Solid fraction and a mass-weighted scalar on a sparse lattice of blocks, rastered from particles.
///
/// Each particle stands for a cube of edge `spacing`; its mass and mass x scalar are spread with the
/// quadratic B-spline of that width onto nodes at multiples of `spacing`, then smoothed by the binomial
/// filter (1, 2, 1)/4 along each axis: without it the steps of the particle lattice show on every slope.
/// Features thinner than two particles, the cell of the usual background grid, fade; spheres show them. Only
/// blocks near particles exist.
class SolidField {
 public:
  static constexpr int edge = 8;  ///< nodes along a block
  static constexpr int nodes = edge * edge * edge;

  struct Block {
    std::array<int, 3> origin;          ///< node index of its first node
    std::array<float, nodes> fraction;  ///< solid fraction [-], x fastest
    std::array<float, nodes> weighted;  ///< solid fraction times scalar
    std::array<std::int32_t, 27> near;  ///< blocks around it, x fastest; 13 is itself, -1 does not exist
  };

  struct Sample {
    float fraction = 0;
    float scalar = 0;  ///< 0 where there is no solid
  };

  /// @param positions  [m]
  /// @param scalar     one a particle
  /// @param spacing    [m] edge of the cube a particle stood for at the start
  /// @throws InputError  for no particles, unequal sizes, spacing <= 0, or a position or value that is not
  /// finite
  SolidField(std::span<const Point> positions, std::span<const float> scalar, double spacing);

  /// Trilinear between nodes.
  Sample at(const Point& x) const;

  /// Copies the nodes from `margin` before a block's first node to `margin` + 1 behind its last, x fastest,
  /// so that all cells of the block and `margin` nodes around them are there. 0 where no block exists.
  /// @param out  (edge + 1 + 2 margin)^3 values
  void gather(const Block& block, const std::array<float, nodes> Block::*channel, int margin,
              float* out) const;

  /// Solid fraction at which the surface lies: the one that encloses the particles' volume, counted in nodes.
  /// One half would lose a fifth of a sample whose ligaments are two or three particles thick. In [0.3,
  /// 0.499]: just below one half at most, since a flat face of a particle lattice leaves nodes at exactly
  /// that and rounding would decide.
  float surface_fraction() const { return surface_fraction_; }

  double spacing() const { return spacing_; }
  const std::vector<Block>& blocks() const { return blocks_; }

 private:
  void smooth();
  float find_surface_fraction() const;
  const Block* find(const std::array<int, 3>& block) const;

  double spacing_;
  float surface_fraction_ = 0;
  std::vector<std::uint64_t> keys_;  ///< of blocks_, ascending
  std::vector<Block> blocks_;
};

}  // namespace anticrack
