#include "fields/graded_field.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "errors.h"

namespace anticrack {
namespace {

// Neighbours differ by at most this in log(wavelength). Fewer fields blend more slowly: less is added to the
// gradient along the axis; more of them follow the wavelength more closely.
constexpr double largest_step = 0.35;
constexpr int most_steps = 255;

}  // namespace

GradedField GradedField::sample(const GaussianRandomFieldSpec& spec, const SampleLattice& lattice,
                                int number) {
  const double ratio = spec.wavelength_gradient;
  if (!(ratio > 0) || !std::isfinite(ratio))
    throw InputError(
        fmt::format("Gaussian random field: wavelength_gradient = {}; expected a finite number > 0", ratio));
  if (ratio != 1.0 && spec.periodic)
    throw InputError("Gaussian random field: periodic with a wavelength gradient; expected one of them");
  const auto steps = int(std::min(double(most_steps), std::ceil(std::abs(std::log(ratio)) / largest_step)));
  GradedField result;
  result.axis_ = spec.gradient_axis;
  result.extent_ = lattice.size()[spec.gradient_axis];
  for (int m = 0; m <= steps; ++m) {
    const double scale = m == 0 ? 1.0 : std::pow(ratio, -double(m) / steps);
    result.fields_.push_back(
        GaussianRandomField::sample(spec, lattice.size(), number * (most_steps + 1) + m, scale));
  }
  return result;
}

std::vector<double> GradedField::weights(double height) const {
  std::vector<double> result(fields_.size(), 0.0);
  const double steps = double(fields_.size() - 1);
  const double node = std::clamp(height / extent_, 0.0, 1.0) * steps;
  const auto m = std::size_t(std::min(node, std::max(0.0, steps - 1)));
  const double s = node - double(m), smooth = s * s * s * (10 + s * (6 * s - 15));  // level at the nodes
  const double turn = 0.5 * std::numbers::pi * smooth;
  result[m] = std::cos(turn);
  if (m + 1 < result.size()) result[m + 1] = std::sin(turn);
  return result;
}

double GradedField::evaluate(const Vec3& r) const {
  const std::vector<double> weight = weights(r[axis_]);
  double sum = 0;
  for (std::size_t m = 0; m < fields_.size(); ++m)
    if (weight[m] != 0) sum += weight[m] * fields_[m].evaluate(r);
  return sum;
}

std::vector<float> GradedField::evaluate_excess_on_lattice(const SampleLattice& lattice, int padding,
                                                           double level) const {
  if (fields_.size() == 1) return fields_[0].evaluate_excess_on_lattice(lattice, padding, level);
  const std::size_t width = std::size_t(lattice.points[0] + 2 * padding),
                    height = std::size_t(lattice.points[1] + 2 * padding);
  std::vector<std::vector<double>> weight;  // of each field, by lattice point along the axis
  for (int point = -padding; point < lattice.points[axis_] + padding; ++point)
    weight.push_back(weights(lattice.spacing * (point + 0.5)));

  std::vector<double> sum;
  for (std::size_t m = 0; m < fields_.size(); ++m) {
    const std::vector<double> values = fields_[m].evaluate_on_lattice(lattice, padding);
    if (sum.empty()) sum.resize(values.size(), 0.0);
    tbb::parallel_for(std::size_t(0), values.size() / width, [&](std::size_t row) {
      for (std::size_t i = 0; i < width; ++i) {
        const std::array<std::size_t, 3> index = {i, row % height, row / height};
        sum[row * width + i] += weight[index[std::size_t(axis_)]][m] * values[row * width + i];
      }
    });
  }
  std::vector<float> excess(sum.size());
  tbb::parallel_for(std::size_t(0), sum.size() / width, [&](std::size_t row) {
    for (std::size_t n = row * width; n < (row + 1) * width; ++n) excess[n] = float(sum[n] - level);
  });
  return excess;
}

}  // namespace anticrack
