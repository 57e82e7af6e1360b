#pragma once

#include <cstdint>
#include <span>

#include "errors.h"
#include "microstructure.h"

namespace anticrack {

/// Which points of plane k of a lattice in the sample box lie in the solid: 1 or 0 each, x fastest. The level
/// set is read at `origin` + point, trilinearly, which is the voxel's own value where a voxel lies.
void find_solid_points(const Microstructure& structure, const SampleLattice& lattice, int k,
                       std::span<std::uint8_t> solid);

/// What to throw where no point of a lattice is solid.
InputError no_solid_point(const SampleLattice& lattice);

}  // namespace anticrack
