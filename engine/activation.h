#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "kernels.h"
#include "particles.h"
#include "sparse_grid.h"
#include "vec3.h"

namespace anticrack {

/// Where the particles of each block lie: those of cell c are [begin[c], begin[c + 1]).
using CellRanges = std::array<std::uint32_t, block_cells + 1>;

/// Creates the particles at `positions` [m], at rest and unstrained, sorted by block and cell, and activates
/// the grid.
/// @throws InputError  if a coordinate is not finite or the sample spans more than 2^19 blocks along an axis
void place_particles(std::span<const Vec3> positions, double cell_size, const Vec3& grid_offset,
                     ParticleFields fields, Particles& particles, SparseGrid& grid,
                     std::vector<CellRanges>& cells);

/// The strays that a pass has listed, in order of their true cells; activates what they reach. Returns the
/// first whose position is not finite.
std::optional<std::uint32_t> locate_strays(std::span<const BlockResult> results, const Particles& particles,
                                           SparseGrid& grid, std::vector<CellRanges>& cells,
                                           std::vector<Stray>& strays);

/// Moves every stray, in the order of `locate_strays`, to its true cell, keeps the order of all others, and
/// releases what is no longer reached.
void sort_particles(std::vector<Stray>& strays, Particles& particles, SparseGrid& grid,
                    std::vector<CellRanges>& cells);

/// World position [m] of every particle, in storage order.
std::vector<Vec3> world_positions(const Particles& particles, const SparseGrid& grid,
                                  const std::vector<CellRanges>& cells, double cell_size,
                                  const Vec3& grid_offset);

/// Bytes that a run of these particles will take: state, sort buffers, leaves, tiles.
struct MemoryEstimate {
  std::size_t particles, blocks, leaves, bytes;
};
MemoryEstimate estimate_memory(std::span<const Vec3> positions, double cell_size, const Vec3& grid_offset,
                               ParticleFields fields);

}  // namespace anticrack
