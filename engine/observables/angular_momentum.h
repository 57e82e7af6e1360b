#pragma once

#include <span>

#include "simulation.h"

namespace anticrack {

Vec3 centre_of_mass(std::span<const Vec3> positions);  ///< of equal particles [m]

/// Of the particles about their centre of mass [kg m^2/s]. With APIC their affine motion is part of it: a
/// particle's mass has the second moment dx^2 / 4 along each axis (Jiang et al. 2015).
Vec3 angular_momentum(const Simulation& simulation);

}  // namespace anticrack
