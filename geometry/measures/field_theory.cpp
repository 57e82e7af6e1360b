#include "measures/field_theory.h"

#include <fmt/format.h>

#include <boost/math/special_functions/owens_t.hpp>
#include <cmath>
#include <numbers>
#include <vector>

#include "errors.h"

namespace anticrack {
namespace {

constexpr double pi = std::numbers::pi;

// The fraction of one field's cut that gives the whole its solid fraction.
double fraction_of_one(Morphology morphology, double solid_fraction) {
  if (!(solid_fraction > 0 && solid_fraction < 1))
    throw InputError(fmt::format(
        "theory of Gaussian cuts: solid fraction = {:g}; expected 0 < solid fraction < 1", solid_fraction));
  return fraction_of_one_cut(morphology, solid_fraction);
}

// Two standard normal variables of correlation rho are both above s.
double both_above(double s, double rho) {
  if (rho <= -1) return s < 0 ? std::erf(-s / std::numbers::sqrt2) : 0;
  return 0.5 * std::erfc(s / std::numbers::sqrt2) -
         2 * boost::math::owens_t(s, std::sqrt((1 - rho) / (1 + rho)));
}

// S2 of the whole by the field's correlation.
double two_point_of_correlation(Morphology morphology, double solid_fraction, double rho) {
  const double p = fraction_of_one(morphology, solid_fraction);
  const double s = std::numbers::sqrt2 * theoretical_threshold(morphology, solid_fraction);
  if (morphology == Morphology::single_cut) return both_above(s, rho);
  const double both = 2 * p - 1 + 2 * both_above(s, rho) + 2 * both_above(s, -rho);  // |x| < s and |y| < s
  if (morphology == Morphology::two_cut) return both;
  if (morphology == Morphology::open_cell) return both * both;
  const double neither = 1 - 2 * p + both;  // of one field; the pores are outside of both sheets
  return 2 * solid_fraction - 1 + neither * neither;
}

double covariance(const FieldTheory& theory, double r) {
  return two_point_probability(theory, r) - theory.solid_fraction * theory.solid_fraction;
}

}  // namespace

GammaSpectrum GammaSpectrum::of(const GaussianRandomFieldSpec& spec, double shortest_side) {
  return {2 * pi * spec.wavelengths_per_side / shortest_side, spec.heterogeneity};
}

double field_correlation(const GammaSpectrum& spectrum, double r) {
  const double b = spectrum.heterogeneity;
  const double u = spectrum.mean_wave_number * r / (b + 1);
  if (u == 0) return 1;
  return std::sin(b * std::atan(u)) / (b * u) * std::exp(-0.5 * b * std::log1p(u * u));
}

double mean_square_wave_number(const GammaSpectrum& spectrum) {
  const double b = spectrum.heterogeneity;
  return spectrum.mean_wave_number * spectrum.mean_wave_number * (b + 2) / (b + 1);
}

double wavelengths_density(double wavelengths, double mean_wavelengths, double heterogeneity) {
  if (wavelengths <= 0) return 0;
  const double shape = heterogeneity + 1, x = shape * wavelengths / mean_wavelengths;
  return shape / mean_wavelengths * std::exp(heterogeneity * std::log(x) - x - std::lgamma(shape));
}

double two_point_probability(const FieldTheory& theory, double r) {
  return two_point_of_correlation(theory.morphology, theory.solid_fraction,
                                  field_correlation(theory.spectrum, r));
}

MinkowskiDensities minkowski_densities(const FieldTheory& theory) {
  const double p = fraction_of_one(theory.morphology, theory.solid_fraction);
  const double s = std::numbers::sqrt2 * theoretical_threshold(theory.morphology, theory.solid_fraction);
  const double l = mean_square_wave_number(theory.spectrum) / 3, weight = std::exp(-0.5 * s * s);

  MinkowskiDensities one{.surface = 2 / pi * std::sqrt(l) * weight,
                         .mean_curvature = l * s * weight / std::sqrt(2 * pi),
                         .euler = std::pow(l, 1.5) * (s * s - 1) * weight / (4 * pi * pi)};
  if (theory.morphology == Morphology::single_cut) return one;

  // The sheet between -s and s: above -s, and not above s. Curvatures turn their sign with the side.
  one = {2 * one.surface, -2 * one.mean_curvature, 2 * one.euler};
  if (theory.morphology == Morphology::two_cut) return one;

  // Both of two independent sets of fraction q. For a union: the complement of both complements, whose mean
  // curvature has the other sign.
  const double side = theory.morphology == Morphology::open_cell ? 1 : -1;
  const double q = theory.morphology == Morphology::open_cell ? p : 1 - p;
  const double surface = one.surface, mean_curvature = side * one.mean_curvature;
  return {.surface = 2 * q * surface,
          .mean_curvature = side * (2 * q * mean_curvature + pi * pi / 16 * surface * surface),
          .euler = 2 * q * one.euler + surface * mean_curvature / (2 * pi)};
}

double integral_range(const FieldTheory& theory) {
  if (!(theory.spectrum.heterogeneity > 2))
    throw InputError(
        fmt::format("integral range: heterogeneity b = {:g}; expected b > 2, below which correlations "
                    "have no integral",
                    theory.spectrum.heterogeneity));
  const double phi = theory.solid_fraction, step = 2 * pi / theory.spectrum.mean_wave_number / 40;
  constexpr int intervals = 40000;
  double sum = 0;
  for (int n = 1; n <= intervals; ++n) {
    const double r = n * step, weight = n == intervals ? 1 : n % 2 ? 4 : 2;
    sum += weight * r * r * covariance(theory, r);
  }
  return 4 * pi * sum * step / 3 / (phi - phi * phi);
}

double solid_fraction_variance(const FieldTheory& theory, int edge, double voxel_size) {
  if (edge < 1)
    throw InputError(fmt::format("variance of the solid fraction: edge = {} voxels; expected >= 1", edge));
  // Vectors between points by their squared length, with the number of pairs that each joins.
  const auto n = std::size_t(edge);
  std::vector<double> pairs(3 * (n - 1) * (n - 1) + 1, 0.0);
  for (std::size_t k = 0; k < n; ++k)
    for (std::size_t j = 0; j < n; ++j)
      for (std::size_t i = 0; i < n; ++i)
        pairs[i * i + j * j + k * k] +=
            double((n - i) * (i ? 2 : 1)) * double((n - j) * (j ? 2 : 1)) * double((n - k) * (k ? 2 : 1));
  double sum = 0;
  for (std::size_t square = 0; square < pairs.size(); ++square)
    if (pairs[square] > 0) sum += pairs[square] * covariance(theory, voxel_size * std::sqrt(double(square)));
  return sum / std::pow(double(edge), 6);
}

}  // namespace anticrack
