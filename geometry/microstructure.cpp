#include "microstructure.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_reduce.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

#include "errors.h"
#include "level_set.h"

namespace anticrack {
namespace {

std::string describe(const SampleLattice& lattice) {
  return fmt::format("lattice {} x {} x {}, spacing {:g} m", lattice.points[0], lattice.points[1],
                     lattice.points[2], lattice.spacing);
}

void require_valid(const SampleLattice& lattice) {
  const int fewest = *std::ranges::min_element(lattice.points);
  if (fewest < 1 || !(lattice.spacing > 0) || !std::isfinite(lattice.spacing))
    throw InputError(describe(lattice) +
                     "; expected at least one point along each axis and a finite spacing > 0");
}

// erf(t) = 1 - 2 phi by bisection of erfc(t) = 2 phi, which keeps its digits for small phi.
double threshold_of(double solid_fraction) {
  double low = -7.0, high = 30.0;
  for (;;) {
    const double middle = 0.5 * (low + high);
    if (middle <= low || middle >= high) return middle;
    (std::erfc(middle) > 2.0 * solid_fraction ? low : high) = middle;
  }
}

PaddedField full_excess(const SampleLattice& lattice) {
  PaddedField field{lattice.points, {}};
  constexpr int p = PaddedField::padding;
  field.values.assign(
      field.offset(p - 1 + lattice.points[0], p - 1 + lattice.points[1], p - 1 + lattice.points[2]) + 1,
      1.0f);
  return field;
}

std::size_t count_solid(const PaddedField& excess) {
  return tbb::parallel_reduce(
      tbb::blocked_range<int>(0, excess.points[2]), std::size_t(0),
      [&](const tbb::blocked_range<int>& slabs, std::size_t count) {
        for (int k = slabs.begin(); k < slabs.end(); ++k)
          for (int j = 0; j < excess.points[1]; ++j) {
            const float* row = &excess.values[excess.offset(0, j, k)];
            count += std::size_t(
                std::count_if(row, row + excess.points[0], [](float value) { return value > 0; }));
          }
        return count;
      },
      std::plus<>());
}

// Subtracts what makes round(phi N) lattice points positive; returns it. The threshold lies halfway between
// two points.
double shift_to_order_statistic(PaddedField& excess, double solid_fraction) {
  const auto [nx, ny, nz] = excess.points;
  std::vector<float> sorted;
  sorted.reserve(std::size_t(nx) * std::size_t(ny) * std::size_t(nz));
  for (int k = 0; k < nz; ++k)
    for (int j = 0; j < ny; ++j) {
      const float* row = &excess.values[excess.offset(0, j, k)];
      sorted.insert(sorted.end(), row, row + nx);
    }
  const auto solid = std::ptrdiff_t(std::llround(solid_fraction * double(sorted.size())));
  const auto all = std::ptrdiff_t(sorted.size());
  double shift;
  if (solid == all) {
    shift = std::nextafter(*std::ranges::min_element(sorted), -std::numeric_limits<float>::infinity());
  } else {
    std::nth_element(sorted.begin(), sorted.begin() + solid, sorted.end(), std::greater<>());
    const float largest_void = sorted[solid];
    const float smallest_solid =
        solid == 0 ? largest_void : *std::min_element(sorted.begin(), sorted.begin() + solid);
    shift = 0.5 * (double(largest_void) + double(smallest_solid));
  }
  tbb::parallel_for(std::size_t(0), excess.values.size(),
                    [&](std::size_t i) { excess.values[i] = float(double(excess.values[i]) - shift); });
  return shift;
}

}  // namespace

Microstructure generate_microstructure(const SampleLattice& lattice, const GaussianRandomFieldSpec& spec,
                                       double solid_fraction, ThresholdRule rule) {
  require_valid(lattice);
  if (!(solid_fraction > 0) || !(solid_fraction <= 1))
    throw InputError(fmt::format("solid fraction = {:g}; expected 0 < solid fraction <= 1", solid_fraction));
  const int fewest = *std::ranges::min_element(lattice.points);
  if (spec.wavelengths_per_side > 0.5 * fewest)
    throw InputError(
        fmt::format("{:g} wavelengths along a side of {} lattice points; expected at most {:g}, two points a "
                    "wavelength",
                    spec.wavelengths_per_side, fewest, 0.5 * fewest));
  const auto field = GaussianRandomField::sample(spec, fewest * lattice.spacing);

  Microstructure result;
  result.lattice = lattice;
  result.metadata = {{"source", "gaussian_random_field"},
                     {"solid_fraction", solid_fraction},
                     {"waves", std::int64_t(spec.waves)},
                     {"wavelengths_per_side", spec.wavelengths_per_side},
                     {"heterogeneity", spec.heterogeneity},
                     {"seed", std::to_string(spec.seed)},
                     {"threshold_rule", rule == ThresholdRule::theory ? "theory" : "exact"}};

  PaddedField excess;
  if (solid_fraction == 1) {
    excess = full_excess(lattice);
  } else {
    double threshold = threshold_of(solid_fraction);
    excess = {lattice.points, field.evaluate_excess_on_lattice(lattice, PaddedField::padding, threshold)};
    if (rule == ThresholdRule::exact) threshold += shift_to_order_statistic(excess, solid_fraction);
    result.metadata["threshold"] = threshold;
  }
  result.solid_points = count_solid(excess);
  if (result.solid_points == 0)
    throw InputError(fmt::format(
        "no lattice point is solid: solid fraction {:g}, seed {}, threshold {:g} ({}). Take a larger solid "
        "fraction, a finer "
        "lattice or another seed.",
        solid_fraction, spec.seed, std::get<double>(result.metadata["threshold"]), describe(lattice)));
  result.metadata["solid_fraction_achieved"] = result.solid_fraction();
  result.surface = std::make_shared<LevelSet>(build_level_set(excess, lattice.spacing));
  return result;
}

Microstructure full_block(const SampleLattice& lattice) {
  require_valid(lattice);
  Microstructure result;
  result.surface = std::make_shared<LevelSet>(build_level_set(full_excess(lattice), lattice.spacing));
  result.lattice = lattice;
  result.solid_points = lattice.count();
  result.metadata = {{"source", "full"}, {"solid_fraction", 1.0}, {"solid_fraction_achieved", 1.0}};
  return result;
}

}  // namespace anticrack
