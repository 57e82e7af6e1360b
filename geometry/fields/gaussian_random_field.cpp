#include "fields/gaussian_random_field.h"

#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "errors.h"
#include "fields/random_stream.h"
#include "fields/wave_transform.h"

namespace anticrack {
namespace {

constexpr double two_pi = 2.0 * std::numbers::pi;

void require_positive(const char* quantity, double value) {
  if (!(value > 0) || !std::isfinite(value))
    throw InputError(
        fmt::format("Gaussian random field: {} = {}; expected a finite number > 0", quantity, value));
}

// Uniform on the sphere: its projection on an axis is uniform (Archimedes).
Vec3 sample_direction(RandomStream& random) {
  const double z = 2.0 * random.uniform() - 1.0, azimuth = two_pi * random.uniform();
  const double radius = std::sqrt(1.0 - z * z);
  return {radius * std::cos(azimuth), radius * std::sin(azimuth), z};
}

// The nearest wave vector of which whole periods fit into the box; never the one that does not wave.
Vec3 to_reciprocal_lattice(const Vec3& eta, const Vec3& box) {
  const Vec3 periods = eta.cwiseProduct(box) / two_pi;
  Vec3 whole = periods.array().round();
  if (whole.isZero()) {
    int axis;
    periods.cwiseAbs().maxCoeff(&axis);
    whole[axis] = periods[axis] < 0 ? -1 : 1;
  }
  return two_pi * whole.cwiseQuotient(box);
}

std::size_t padded_count(const SampleLattice& lattice, int padding) {
  std::size_t count = 1;
  for (int points : lattice.points) count *= std::size_t(points + 2 * padding);
  return count;
}

}  // namespace

double GaussianRandomFieldSpec::mean_wave_number(double shortest_side) const {
  return spectrum ? spectrum->mean() : two_pi * wavelengths_per_side / shortest_side;
}

GaussianRandomField GaussianRandomField::sample(const GaussianRandomFieldSpec& spec, double shortest_side) {
  return sample(spec, Vec3::Constant(shortest_side), 0);
}

GaussianRandomField GaussianRandomField::sample(const GaussianRandomFieldSpec& spec, const Vec3& box,
                                                int stream, double scale) {
  if (spec.waves < 1)
    throw InputError(fmt::format("Gaussian random field: waves = {}; expected >= 1", spec.waves));
  if (!spec.spectrum) {
    require_positive("wavelengths_per_side", spec.wavelengths_per_side);
    require_positive("heterogeneity", spec.heterogeneity);
  }
  require_positive("shortest side", box.minCoeff());
  require_positive("anisotropy", spec.anisotropy);

  const double shape = spec.heterogeneity + 1.0;
  const double gamma_scale = two_pi * spec.wavelengths_per_side / box.minCoeff() / shape;
  Vec3 stretch = Vec3::Constant(std::cbrt(spec.anisotropy));
  stretch[spec.anisotropy_axis] /= spec.anisotropy;
  std::vector<PlaneWave> waves(spec.waves);
  for (std::size_t n = 0; n < waves.size(); ++n) {
    RandomStream random(spec.seed, std::uint64_t(stream) << 32 | n);
    const Vec3 direction = sample_direction(random);
    waves[n].phase = two_pi * random.uniform();
    const double wave_number =
        spec.spectrum ? spec.spectrum->quantile(random.uniform()) : gamma_scale * random.gamma(shape);
    waves[n].eta = wave_number * direction;
    if (spec.anisotropy != 1.0) waves[n].eta = waves[n].eta.cwiseProduct(stretch);
    if (scale != 1.0) waves[n].eta *= scale;
    if (spec.periodic) waves[n].eta = to_reciprocal_lattice(waves[n].eta, box);
  }
  return GaussianRandomField(std::move(waves));
}

GaussianRandomField::GaussianRandomField(std::vector<PlaneWave> waves) : waves_(std::move(waves)) {
  if (waves_.empty()) throw InputError("Gaussian random field: no waves; expected at least one");
}

double GaussianRandomField::evaluate(const Vec3& r) const {
  double sum = 0.0;
  for (const PlaneWave& wave : waves_) sum += std::cos(wave.eta.dot(r) + wave.phase);
  return sum / std::sqrt(double(waves_.size()));
}

std::vector<double> GaussianRandomField::evaluate_on_lattice(const SampleLattice& lattice,
                                                             int padding) const {
  std::vector<double> values(padded_count(lattice, padding));
  const double scale = 1.0 / std::sqrt(double(waves_.size()));
  sum_waves_on_lattice(waves_, lattice, padding, [&](std::size_t first, std::span<const double> sums) {
    for (std::size_t i = 0; i < sums.size(); ++i) values[first + i] = scale * sums[i];
  });
  return values;
}

std::vector<float> GaussianRandomField::evaluate_excess_on_lattice(const SampleLattice& lattice, int padding,
                                                                   double level) const {
  std::vector<float> values(padded_count(lattice, padding));
  const double scale = 1.0 / std::sqrt(double(waves_.size()));
  sum_waves_on_lattice(waves_, lattice, padding, [&](std::size_t first, std::span<const double> sums) {
    for (std::size_t i = 0; i < sums.size(); ++i) values[first + i] = float(scale * sums[i] - level);
  });
  return values;
}

}  // namespace anticrack
