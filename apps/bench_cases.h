#pragma once

#include <functional>
#include <string>
#include <vector>

#include "scene.h"
#include "simulation.h"

namespace anticrack {

/// One simulation to time.
struct BenchCase {
  std::string series;  ///< what the series of cases varies
  double value;        ///< of what it varies
  SimulationSetup setup;
  std::vector<Vec3> positions, velocities = {};  ///< [m], [m/s]
  int history_every = 20;                        ///< steps; 0: no history
};

/// Builds a case when it is its turn, so that only one lies in memory.
using BenchCaseMaker = std::function<BenchCase()>;

/// 131^3 lattice, solid fraction phi, six sticky walls, Table 1 of Blatny et al. (2021).
Scene paper_scene(double phi = 0.44);

/// What a scene does not need: the paper's scene with one thing left out each, or another transfer.
std::vector<BenchCaseMaker> option_cases();

/// How throughput depends on the number of particles (up to `most`), the solid fraction, the crowding of
/// cells, the share of particles that yield and the share that changes cell in a step.
std::vector<BenchCaseMaker> curve_cases(double most);

}  // namespace anticrack
