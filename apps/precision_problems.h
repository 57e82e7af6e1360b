#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "numerics.h"

namespace anticrack {

/// What a user of the engine may turn.
struct Knobs {
  int cells = 24;         ///< along a length of 1 m
  int per_direction = 2;  ///< particles along a cell
  double transits =
      6;  ///< loading time over the time in which an elastic wave crosses 1 m; quasi-static problems
  Numerics numerics = {};
};

/// A problem, and one way of solving it.
struct PrecisionCase {
  std::string problem;  ///< names it in files
  std::string variant;  ///< what is turned against the defaults, "" for nothing but the number of cells
  Knobs knobs;

  std::string name() const;  ///< unique: "void 0.3, APIC, 24 cells, ..."
};

/// One measured number of a solution.
struct Measure {
  std::string name;  ///< "displacement", "stress", "K", "G"
  double value;      ///< relative L2 error over the particles; or the modulus over the solid's
  double exact;      ///< what it should be: 0 for an error; nan where only finer grids can tell
};

struct Solution {
  std::vector<Measure> measures;
  std::int64_t particles = 0, steps = 0;
  double seconds = 0;  ///< wall time of the steps [s]
};

/// Sets the case up, takes its steps and measures. @throws NumericalError  if the scheme fails
Solution solve(const PrecisionCase& c);

/// The whole study; `quick`: the coarse half of it.
std::vector<PrecisionCase> precision_cases(bool quick);

/// What solving a case takes on one thread of a processor of the 2020s, roughly; for progress.
double expected_seconds(const PrecisionCase& c);

}  // namespace anticrack
