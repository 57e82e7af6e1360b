#pragma once

#include <Eigen/Geometry>
#include <cmath>
#include <span>
#include <vector>

#include "simulation.h"

namespace anticrack {

inline Vec3 centre_of_mass(std::span<const Vec3> positions) {
  Vec3 sum = Vec3::Zero();
  for (const Vec3& x : positions) sum += x;
  return sum / double(positions.size());
}

/// Of the particles about their centre of mass [kg m^2/s]. With APIC their affine motion is part of it: a
/// particle's mass has the second moment dx^2 / 4 along each axis.
inline Vec3 angular_momentum(const Simulation& s) {
  const Particles& p = s.particles();
  const std::vector<Vec3> x = s.positions();
  const Vec3 centre = centre_of_mass(x);
  Vec3 sum = Vec3::Zero();
  for (std::size_t i = 0; i < p.count; ++i) {
    sum += (x[i] - centre).cross(Vec3(p.v[0][i], p.v[1][i], p.v[2][i]));
    if (p.affine[0].size() == 0) continue;
    const auto C = [&](int a, int e) { return p.affine[3 * a + e][i] / s.setup().cell_size; };
    sum +=
        std::pow(s.setup().cell_size, 2) / 4 * Vec3(C(2, 1) - C(1, 2), C(0, 2) - C(2, 0), C(1, 0) - C(0, 1));
  }
  return s.particle_mass() * sum;
}

/// The body at `positions`, at first rigid and unstrained, turning about its centre of mass.
/// @param angular_velocity  [1/s]
inline Simulation spinning_body(const SimulationSetup& setup, std::span<const Vec3> positions,
                                const Vec3& angular_velocity) {
  Mat3 gradient;
  for (int a = 0; a < 3; ++a) gradient.col(a) = angular_velocity.cross(Vec3::Unit(a));
  const Vec3 centre = centre_of_mass(positions);
  std::vector<Vec3> velocities;
  for (const Vec3& x : positions) velocities.push_back(gradient * (x - centre));
  return Simulation(setup, positions, velocities, std::vector<Mat3>(positions.size(), gradient));
}

/// Relative changes over one turn: 0 if all is kept, -1 if all is lost.
struct SpinChange {
  double angular_momentum;  ///< along its first direction
  double kinetic_energy;
};

/// Lets a body spin freely for the time of one turn. It must lie so far from the walls that it never meets
/// them.
inline SpinChange spin_one_turn(const SimulationSetup& setup, std::span<const Vec3> positions,
                                const Vec3& angular_velocity) {
  Simulation s = spinning_body(setup, positions, angular_velocity);
  const Vec3 before = angular_momentum(s);
  const double energy_before = s.kinetic_energy();
  while (s.time() < 2 * M_PI / angular_velocity.norm()) s.step(false);
  return {(angular_momentum(s) - before).dot(before) / before.squaredNorm(),
          s.kinetic_energy() / energy_before - 1};
}

}  // namespace anticrack
