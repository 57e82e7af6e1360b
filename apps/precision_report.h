#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "precision_problems.h"

namespace anticrack {

/// A solved case; `failure` says why it has no solution, and is empty otherwise.
struct PrecisionResult {
  PrecisionCase c;
  Solution solution;
  int runs = 0;  ///< `solution.seconds` is the least of so many
  std::string failure;

  bool operator==(const std::string& name) const { return c.name() == name; }
};

/// What a solution costs.
enum class Cost { seconds, particle_steps };

/// A result in a work-precision diagram.
struct WorkPoint {
  const PrecisionResult* result;
  double cost;
  double error;   ///< relative; infinite where the case failed or misses by more than 100 %
  bool on_front;  ///< no other point is both cheaper and more exact
};

/// Relative error of a measure: of a modulus against `exact`, else the value itself.
double error_of(const Measure& measure);

/// Fills in what only finer grids can tell: a modulus of the porous sample extrapolated from 12, 24 and 48
/// cells of the default variant, f = f48 + (f48 - f24) / (r - 1), r = (f24 - f12) / (f48 - f24) (Richardson).
/// Leaves it open where the three do not converge.
void extrapolate_references(std::span<PrecisionResult> results);

/// The results of a problem by one of its measures, cheapest first.
std::vector<WorkPoint> work_points(std::span<const PrecisionResult> results, const std::string& problem,
                                   const std::string& measure, Cost cost = Cost::seconds);

/// Order p of error ~ cells^-p by least squares over the three finest grids of a variant; nothing where there
/// are fewer, or one of them failed.
std::optional<double> observed_order(std::span<const WorkPoint> points, const std::string& variant);

/// Cost on the front at which the error falls below `error`, between two points of it by the straight line
/// through their logarithms; nothing where no point is that exact.
std::optional<double> cost_for(std::span<const WorkPoint> points, double error);

/// Problems, and the measures of each, in the order of the results.
std::vector<std::pair<std::string, std::vector<std::string>>> problems_and_measures(
    std::span<const PrecisionResult> results);

std::string to_csv(std::span<const PrecisionResult> results);
std::string to_json(std::span<const PrecisionResult> results, bool quick);
/// What `to_json` wrote. @throws FileError  if it did not
std::vector<PrecisionResult> from_json(const std::string& text, const std::string& file, bool& quick);

/// Orders, finest errors, and "1 % in K costs X s", as lines of text.
std::string summary(std::span<const PrecisionResult> results);

}  // namespace anticrack
