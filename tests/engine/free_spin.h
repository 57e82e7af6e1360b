#pragma once

#include <Eigen/Geometry>
#include <cmath>
#include <span>
#include <vector>

#include "observables/angular_momentum.h"
#include "simulation.h"

namespace anticrack {

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
