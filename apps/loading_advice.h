#pragma once

#include <string>

#include "simulation.h"

namespace anticrack {

/// Rate of Observer::loading_strain at full wall speed [1/s].
double strain_rate(const SimulationSetup& setup);

/// Nominal strain at which a porous sample of a plastic solid fails, to about a factor of two.
double expected_failure_strain(const Material& material, const Loading& loading);

/// How far a loading is from a quasi-static one, and which rates are near enough, for `anticrack run
/// --dry-run`. Several lines; the law behind it is loading_law.h.
/// @param seconds  that the run will take as it stands, to `until_strain`
std::string loading_advice(const SimulationSetup& setup, double until_strain, double seconds);

}  // namespace anticrack
