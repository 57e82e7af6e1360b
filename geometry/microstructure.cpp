#include "microstructure.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_reduce.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>

#include "errors.h"
#include "fields/graded_field.h"
#include "level_sets/level_set.h"

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

PaddedField full_excess(const SampleLattice& lattice) {
  PaddedField field{lattice.points, {}};
  constexpr int p = PaddedField::padding;
  field.values.assign(
      field.offset(p - 1 + lattice.points[0], p - 1 + lattice.points[1], p - 1 + lattice.points[2]) + 1,
      1.0f);
  return field;
}

std::size_t count_solid(const CutSolid& solid) {
  const PaddedField& layout = solid.fields[0];
  return tbb::parallel_reduce(
      tbb::blocked_range<int>(0, layout.points[2]), std::size_t(0),
      [&](const tbb::blocked_range<int>& slabs, std::size_t count) {
        for (int k = slabs.begin(); k < slabs.end(); ++k)
          for (int j = 0; j < layout.points[1]; ++j)
            for (int i = 0; i < layout.points[0]; ++i) count += solid.excess_at(layout.offset(i, j, k)) > 0;
        return count;
      },
      std::plus<>());
}

// What has to be subtracted from the excess so that round(phi N) lattice points are positive: halfway between
// two points.
double order_statistic(const CutSolid& solid, double solid_fraction) {
  const PaddedField& layout = solid.fields[0];
  const auto [nx, ny, nz] = layout.points;
  std::vector<float> sorted(std::size_t(nx) * std::size_t(ny) * std::size_t(nz));
  tbb::parallel_for(0, nz, [&, nx = nx, ny = ny](int k) {
    float* out = &sorted[std::size_t(k) * std::size_t(nx) * std::size_t(ny)];
    for (int j = 0; j < ny; ++j)
      for (int i = 0; i < nx; ++i) *out++ = float(solid.excess_at(layout.offset(i, j, k)));
  });
  const auto wanted = std::ptrdiff_t(std::llround(solid_fraction * double(sorted.size())));
  if (wanted == std::ptrdiff_t(sorted.size()))
    return std::nextafter(*std::ranges::min_element(sorted), -std::numeric_limits<float>::infinity());
  std::nth_element(sorted.begin(), sorted.begin() + wanted, sorted.end(), std::greater<>());
  const float largest_void = sorted[std::size_t(wanted)];
  const float smallest_solid =
      wanted == 0 ? largest_void : *std::min_element(sorted.begin(), sorted.begin() + wanted);
  return 0.5 * (double(largest_void) + double(smallest_solid));
}

// Where single precision rounds from one number to the next: the fields' values lie on the same side of it
// before and after they are rounded.
double between_floats(double value) {
  const auto rounded = float(value);
  const float other = std::nextafter(rounded, double(rounded) <= value ? INFINITY : -INFINITY);
  return 0.5 * (double(rounded) + double(other));
}

// The padded fields of a morphology; that of a single cut less the threshold.
std::vector<PaddedField> sample_fields(const SampleLattice& lattice, const GaussianRandomFieldSpec& spec,
                                       Morphology morphology, double threshold) {
  std::vector<PaddedField> fields;
  const double level = morphology == Morphology::single_cut ? threshold : 0.0;
  for (int number = 0; number < field_count(morphology); ++number)
    fields.push_back({lattice.points, GradedField::sample(spec, lattice, number)
                                          .evaluate_excess_on_lattice(lattice, PaddedField::padding, level)});
  return fields;
}

}  // namespace

// Along the axis and at the height where the wavelength is shortest.
std::string resolution_problem(const SampleLattice& lattice, const GaussianRandomFieldSpec& spec) {
  const int fewest = *std::ranges::min_element(lattice.points);
  const double across = std::cbrt(spec.anisotropy);
  const double factor =
      std::max(across, across / spec.anisotropy) * std::max(1.0, 1.0 / spec.wavelength_gradient);
  const double wavelengths = factor * spec.mean_wave_number(fewest * lattice.spacing) * fewest *
                             lattice.spacing / (2 * std::numbers::pi);
  const double most = 0.5 * fewest;
  if (wavelengths <= most * (1 + 1e-12)) return {};
  return fmt::format(
      "{:g} wavelengths along a side of {} lattice points; expected at most {:g}, two points a wavelength",
      wavelengths, fewest, most);
}

std::map<std::string, MetadataValue> microstructure_metadata(const GaussianRandomFieldSpec& spec,
                                                             double solid_fraction, ThresholdRule rule,
                                                             Morphology morphology) {
  constexpr std::array<const char*, 3> axes = {"x", "y", "z"};
  std::map<std::string, MetadataValue> result = {
      {"source", "gaussian_random_field"},
      {"morphology", std::string(morphology_names[std::size_t(morphology)])},
      {"solid_fraction", solid_fraction},
      {"waves", std::int64_t(spec.waves)},
      {"seed", std::to_string(spec.seed)},
      {"threshold_rule", rule == ThresholdRule::theory ? "theory" : "exact"}};
  if (spec.spectrum) {
    result["spectrum_mean_wave_number"] = spec.spectrum->mean();
    result["spectrum_mean_square_wave_number"] = spec.spectrum->mean_square();
  } else {
    result["wavelengths_per_side"] = spec.wavelengths_per_side;
    result["heterogeneity"] = spec.heterogeneity;
  }
  if (spec.anisotropy != 1.0) {
    result["anisotropy"] = spec.anisotropy;
    result["anisotropy_axis"] = axes[std::size_t(spec.anisotropy_axis)];
  }
  if (spec.wavelength_gradient != 1.0) {
    result["wavelength_gradient"] = spec.wavelength_gradient;
    result["gradient_axis"] = axes[std::size_t(spec.gradient_axis)];
  }
  if (spec.periodic) result["periodic"] = std::int64_t(1);
  return result;
}

Microstructure generate_microstructure(const SampleLattice& lattice, const GaussianRandomFieldSpec& spec,
                                       double solid_fraction, ThresholdRule rule, Morphology morphology) {
  require_valid(lattice);
  if (!(solid_fraction > 0) || !(solid_fraction <= 1))
    throw InputError(fmt::format("solid fraction = {:g}; expected 0 < solid fraction <= 1", solid_fraction));
  if (const std::string problem = resolution_problem(lattice, spec); !problem.empty())
    throw InputError(problem);

  Microstructure result;
  result.lattice = lattice;
  result.metadata = microstructure_metadata(spec, solid_fraction, rule, morphology);

  std::vector<PaddedField> fields;
  CutSolid solid{morphology, {}, 0.0};
  if (solid_fraction == 1) {
    fields = {full_excess(lattice)};
    solid = {Morphology::single_cut, fields, 0.0};
  } else {
    double threshold = theoretical_threshold(morphology, solid_fraction);
    if (morphology == Morphology::single_cut) {
      fields = sample_fields(lattice, spec, morphology, threshold);
      solid.fields = fields;
      if (rule == ThresholdRule::exact) {
        const double shift = order_statistic(solid, solid_fraction);
        std::vector<float>& values = fields[0].values;
        tbb::parallel_for(std::size_t(0), values.size(),
                          [&](std::size_t n) { values[n] = float(double(values[n]) - shift); });
        threshold += shift;
      }
    } else {
      fields = sample_fields(lattice, spec, morphology, threshold);
      solid.fields = fields;
      if (rule == ThresholdRule::exact)
        threshold = -order_statistic(solid, solid_fraction);  // the threshold is still 0
      else
        threshold = between_floats(threshold);
      solid.threshold = threshold;
    }
    result.metadata["threshold"] = threshold;
  }
  result.solid_points = count_solid(solid);
  if (result.solid_points == 0)
    throw InputError(fmt::format(
        "no lattice point is solid: solid fraction {:g}, seed {}, threshold {:g} ({}). Take a larger solid "
        "fraction, a finer "
        "lattice or another seed.",
        solid_fraction, spec.seed, std::get<double>(result.metadata["threshold"]), describe(lattice)));
  result.metadata["solid_fraction_achieved"] = result.solid_fraction();
  result.surface = std::make_shared<LevelSet>(build_level_set(solid, lattice.spacing));
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
