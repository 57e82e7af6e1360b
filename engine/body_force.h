#pragma once

#include <functional>
#include <span>
#include <vector>

#include "activation.h"
#include "particles.h"
#include "sparse_grid.h"
#include "vec3.h"

namespace anticrack {

/// Acceleration of a body force [m/s^2] at a place [m] and time [s]; called from several threads.
using BodyAcceleration = std::function<Vec3(const Vec3& x, double time)>;

/// Adds m b(x, time) of every particle to the force sums of the nodes that it reaches, line 4 of Algorithm 1.
/// By particles: b taken at the nodes instead would be smoothed once less than the stress divergence that it
/// balances, an error of (1 - smoothing) times either of the two.
/// @param mass  of a particle [kg]
void add_body_force(const BodyAcceleration& b, double time, double mass, double cell_size,
                    const Vec3& grid_offset, const Particles& particles, std::span<const Stray> strays,
                    const std::vector<CellRanges>& cells, const SparseGrid& grid);

}  // namespace anticrack
