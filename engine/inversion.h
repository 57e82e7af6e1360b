#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "activation.h"

namespace anticrack {

/// Whether a step may turn some particle inside out, told by speeds alone: with Sum |dN/ds| <= 2 no row of
/// dt grad v reaches 1 below a sixth of a cell a step, so I + dt grad v is diagonally dominant.
inline bool may_invert(double cells_a_step) {
  return cells_a_step >= 1.0 / 6;
}

/// The first particle, in storage order, that a step with the nodal velocities of `grid` would turn inside
/// out: det(I + dt grad v) <= 0. Only blocks are looked at in which velocities differ by enough.
/// @param dt_over_dx  [s/m]
std::optional<std::uint32_t> find_inverted_particle(const Particles& particles, const SparseGrid& grid,
                                                    const std::vector<CellRanges>& cells,
                                                    std::span<const Stray> strays, double dt_over_dx);

}  // namespace anticrack
