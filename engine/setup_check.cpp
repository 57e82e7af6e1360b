#include "setup_check.h"

#include <cmath>
#include <sstream>
#include <string>

#include "errors.h"
#include "simulation.h"

namespace anticrack {

namespace {

/// @param allowed  false for NaN too, as every comparison with it is
void require(bool allowed, const char* quantity, double value, const char* expected) {
  if (allowed) return;
  std::ostringstream message;
  message.precision(10);
  message << quantity << " = " << value << "; expected " << expected;
  throw InputError(message.str());
}

bool positive(double value) {
  return value > 0 && std::isfinite(value);
}
bool not_negative(double value) {
  return value >= 0 && std::isfinite(value);
}

void check_material(const Material& material) {
  const HenckyElasticity& elasticity = material.elasticity;
  require(positive(material.density), "density", material.density, "rho > 0 [kg/m^3]");
  require(positive(elasticity.young_modulus), "Young's modulus", elasticity.young_modulus, "E > 0 [Pa]");
  require(elasticity.poisson_ratio > -1 && elasticity.poisson_ratio < 0.5, "Poisson's ratio",
          elasticity.poisson_ratio, "-1 < nu < 0.5");
  if (!material.plasticity) return;
  require(not_negative(material.plasticity->friction), "friction", material.plasticity->friction,
          "gamma >= 0");
  require(not_negative(material.plasticity->cohesion), "cohesion", material.plasticity->cohesion,
          "c >= 0 [Pa]");
  require(not_negative(material.plasticity->softening), "softening", material.plasticity->softening,
          "xi >= 0");
}

void check_loading(const Loading& loading) {
  if (const auto* confined = std::get_if<ConfinedCompression>(&loading)) {
    require(confined->axis >= 0 && confined->axis < 3, "axis", confined->axis, "0, 1 or 2");
    require(positive(confined->speed), "speed", confined->speed, "> 0 [m/s]");
    require(not_negative(confined->ramp_time), "ramp time", confined->ramp_time, ">= 0 [s]");
    return;
  }
  const auto& triaxial = std::get<TriaxialLoading>(loading);
  require(not_negative(triaxial.strain_rate), "strain rate", triaxial.strain_rate,
          ">= 0 [1/s]; 0 keeps the walls at rest");
  require(std::isfinite(triaxial.beta1), "beta1", triaxial.beta1, "a finite number");
  require(std::isfinite(triaxial.beta2), "beta2", triaxial.beta2, "a finite number");
  require(not_negative(triaxial.ramp_time), "ramp time", triaxial.ramp_time, ">= 0 [s]");
}

void check_numerics(const Numerics& numerics) {
  require(numerics.time_step_factor > 0 && numerics.time_step_factor <= 1, "time step factor",
          numerics.time_step_factor, "in (0, 1]");
  require(numerics.flip >= 0 && numerics.flip <= 1, "flip", numerics.flip, "in [0, 1]");
  if (numerics.flip_time) require(positive(*numerics.flip_time), "flip time", *numerics.flip_time, "> 0 [s]");
  for (const double offset : numerics.grid_offset)
    require(std::isfinite(offset), "grid offset", offset, "a finite number of cells");
}

}  // namespace

const SimulationSetup& checked(const SimulationSetup& setup) {
  check_material(setup.material);
  check_loading(setup.loading);
  check_numerics(setup.numerics);
  require(positive(setup.particle_volume), "particle volume", setup.particle_volume, "> 0 [m^3]");
  require(positive(setup.cell_size), "cell size", setup.cell_size, "> 0 [m]");
  for (int a = 0; a < 3; ++a)
    require(setup.box_size[a] >= 4 * setup.cell_size && std::isfinite(setup.box_size[a]),
            "cells of the sample box along an axis", setup.box_size[a] / setup.cell_size,
            "at least 4, so that opposite walls do not act on the same nodes");
  return setup;
}

}  // namespace anticrack
