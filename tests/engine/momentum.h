#pragma once

#include "simulation.h"

namespace anticrack {

/// Of all particles [kg m/s].
inline Vec3 momentum_of(const Simulation& s) {
  Vec3 sum = Vec3::Zero();
  const Particles& p = s.particles();
  for (std::size_t i = 0; i < p.count; ++i) sum += s.particle_mass() * Vec3(p.v[0][i], p.v[1][i], p.v[2][i]);
  return sum;
}

}  // namespace anticrack
