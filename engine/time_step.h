#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include "material/material_parameters.h"
#include "numerics.h"

namespace anticrack {

constexpr double advective_cfl = 0.6;  ///< C_CFL of Algorithm 1: cells a particle may cross in a step

/// Largest stable explicit time step for any particle layout.
///
/// dt = dx sqrt(rho0 / max(3 (3 lambda + 2 mu), 9/2 (lambda + 2 mu))) / sqrt(1 + max(0, -tau_1) / (lambda + 2
/// mu)). Density cancels in the ratio of stiffness and mass of a node, so it is bounded whatever the node's
/// mass. First term: a lone particle, whose strain is all that remembers; with sum_i |dN_i|^2 / N_i <= 6 an
/// axis a step multiplies its volume strain by at least 1 - 6 (3 lambda + 2 mu) dt^2 / (rho dx^2) >= -1.
/// Second term: nodes that remember their velocity, omega^2 <= 18 (lambda + 2 mu) / (rho dx^2) <= 4 / dt^2;
/// it is the larger below nu = 0.2. The Kirchhoff pressure of compression stiffens both. C_el = 0.5 with
/// sqrt(E / rho) is unstable for a lone particle at nu = 0.3.
/// @param dx               grid spacing [m]
/// @param max_compression  largest compressive principal Kirchhoff stress -tau_1 [Pa], >= 0
/// @return                 [s]
inline double safe_time_step(double dx, const Material& material, double max_compression) {
  const double lambda = material.elasticity.lambda(), mu = material.elasticity.mu();
  const double stiffness = std::max(3 * (3 * lambda + 2 * mu), 4.5 * (lambda + 2 * mu));
  return dx * std::sqrt(material.density / stiffness) /
         std::sqrt(1 + std::max(0.0, max_compression) / (lambda + 2 * mu));
}

/// Algorithm 1, line 1: C_el dx / sqrt(E / rho), C_el = 0.5.
inline double paper_time_step(double dx, const Material& material) {
  return 0.5 * dx / std::sqrt(material.elasticity.young_modulus / material.density);
}

/// Line 1 of Algorithm 1 with the chosen elastic rule. At the start max_speed may be 0: the elastic limit
/// then stands alone.
inline double adaptive_time_step(const Numerics& numerics, double dx, const Material& material,
                                 double max_compression, double max_speed) {
  const double elastic = numerics.time_step == TimeStepRule::safe
                             ? safe_time_step(dx, material, max_compression)
                             : paper_time_step(dx, material);
  const double advective =
      max_speed > 0 ? advective_cfl * dx / max_speed : std::numeric_limits<double>::infinity();
  return numerics.time_step_factor * std::min(elastic, advective);
}

/// Speed of a longitudinal elastic wave, sqrt((lambda + 2 mu) / rho) [m/s].
inline double elastic_wave_speed(const Material& material) {
  return std::sqrt((material.elasticity.lambda() + 2 * material.elasticity.mu()) / material.density);
}

}  // namespace anticrack
