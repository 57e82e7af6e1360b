#include "engine/blocks.h"
#include "errors.h"
#include "expect_error.h"
#include "simulation.h"

namespace anticrack {
namespace {

constexpr double h = 0.05;

SimulationSetup setup_of(double speed = 1.0) {
  return {Vec3::Constant(8 * h),
          h * h * h,
          2 * h,
          {1e4, {10e9, 0.3}, {}},
          ConfinedCompression{1, true, speed},
          {}};
}

TEST(Simulation, RefusesWhatCannotBeSimulated) {
  const std::vector<Vec3> positions = block({8, 8, 8}, h);
  EXPECT_ERROR(Simulation(setup_of(), std::vector<Vec3>{}), InputError, "no particles");
  EXPECT_ERROR(Simulation(setup_of(), std::vector<Vec3>{Vec3(0.1, NAN, 0.1)}), InputError,
               "particle position is not finite");
  EXPECT_ERROR(Simulation(setup_of(), std::vector<Vec3>{Vec3(0.1, 1e30, 0.1)}), InputError,
               "too far from the origin");
  EXPECT_ERROR(Simulation(setup_of(2000), positions), InputError,
               "m/s; expected below the elastic wave speed 1160");
  SimulationSetup thin = setup_of();
  thin.box_size[2] = 2 * h;
  EXPECT_ERROR(Simulation(thin, positions), InputError,
               "cells of the sample box along an axis = 1; expected at least 4");
  const std::vector<Vec3> velocities(3, Vec3::Zero());
  EXPECT_ERROR(Simulation(setup_of(), positions, velocities), InputError, "3 velocities for 512 particles");
}

}  // namespace
}  // namespace anticrack
