#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <random>
#include <string>
#include <vector>

#include "blocks.h"
#include "errors.h"
#include "io_test_folder.h"
#include "simulation.h"
#include "time_step.h"

// What the stability suite's cases are made of. `engine_tests --gtest_filter=Stability.*` prints the table of
// the README: what survives, with which property, what is refused before step 1, and what aborts cleanly.

namespace anticrack::stability {

constexpr double h = 0.05;  ///< [m] particle spacing; two a cell

inline Material brittle(double E = 10e9, double nu = 0.3) {
  return {1e4, {E, nu}, DruckerPragerSoftening{1.2, 2.5e-4 * E, 1e6}};
}
inline Material elastic(double E = 10e9, double nu = 0.3) {
  return {1e4, {E, nu}, std::nullopt};
}

inline SimulationSetup between_platens(const Index3& points, const Material& material, double speed) {
  return {h * Vec3(points[0], points[1], points[2]), h * h * h, 2 * h, material,
          ConfinedCompression{1, true, speed},       {}};
}

/// Far from all walls.
inline SimulationSetup free_body(const Material& material) {
  return {100 * h * Vec3(1, 1, 1), h * h * h, 2 * h, material, ConfinedCompression{1, false, 1e-30}, {}};
}

inline std::vector<Vec3> random_velocities(std::size_t count, double size) {
  std::mt19937 random(5);
  std::normal_distribution<> normal(0, size);
  std::vector<Vec3> v;
  for (std::size_t i = 0; i < count; ++i) v.push_back({normal(random), normal(random), normal(random)});
  return v;
}

inline double energy(const Simulation& s) {
  return s.kinetic_energy() + s.setup().particle_volume * s.observed().elastic_energy;
}

inline bool is_finite(const Simulation& s) {
  const Particles& p = s.particles();
  double sum = 0;
  for (std::size_t i = 0; i < p.count; ++i) {
    for (int a = 0; a < 3; ++a) sum += std::abs(p.s[a][i]) + std::abs(p.v[a][i]);
    for (int e = 0; e < 6; ++e) sum += std::abs(p.h[e][i]);
    if (p.kappa.size()) sum += std::abs(p.kappa[i]);
  }
  return std::isfinite(sum);
}

inline void print(const char* name, const char* outcome, const std::string& what) {
  std::printf("| %-58s | %-8s | %s |\n", name, outcome, what.c_str());
}
inline std::string text(const char* format, double value) {
  char buffer[100];
  std::snprintf(buffer, sizeof buffer, format, value);
  return buffer;
}

inline std::string abort_message(Simulation& s, int steps) {
  try {
    for (int n = 0; n < steps; ++n) s.step(false);
  } catch (const NumericalError& error) {
    return error.what();
  }
  return {};
}

/// Prints the table's head before the first case.
class Stability : public IoTest {
 protected:
  static void SetUpTestSuite() { print("case", "outcome", "property, or message"); }
};

}  // namespace anticrack::stability
