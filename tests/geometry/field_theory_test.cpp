#include "measures/field_theory.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "errors.h"
#include "expect_error.h"

namespace anticrack {
namespace {

constexpr double pi = std::numbers::pi;

// Nine wavelengths on a side of one metre, as the paper's samples.
GammaSpectrum spectrum_of(double b) {
  return {18 * pi, b};
}

template <typename Function>
double integrate(const Function& function, double from, double to, int intervals) {  // Simpson's rule
  double sum = function(from) + function(to);
  for (int n = 1; n < intervals; ++n) sum += (n % 2 ? 4 : 2) * function(from + (to - from) * n / intervals);
  return sum * (to - from) / intervals / 3;
}

TEST(FieldTheory, SpecificSurfaceHasTheDigitsOfTheClosedForm) {
  // (2/pi) sqrt(<eta^2>/3) exp(-s^2/2) / phi in multiple precision, L = 1, nine wavelengths, b = 50.
  const double expected[][2] = {{0.20, 73.6406}, {0.25, 66.8698}, {0.30, 60.9709}, {0.34, 56.6940},
                                {0.44, 47.1581}, {0.54, 38.6700}, {0.70, 26.1304}, {0.80, 18.4102}};
  for (const auto& [phi, specific_surface] : expected)
    EXPECT_NEAR(minkowski_densities({Morphology::single_cut, phi, spectrum_of(50)}).surface / phi,
                specific_surface, 5.1e-5)
        << phi;
}

TEST(FieldTheory, ThresholdsGiveTheSolidFraction) {
  for (double phi : {1e-6, 0.137, 0.5, 0.8, 0.999}) {
    EXPECT_NEAR(0.5 * std::erfc(theoretical_threshold(Morphology::single_cut, phi)), phi, 1e-14);
    EXPECT_NEAR(std::erf(theoretical_threshold(Morphology::two_cut, phi)), phi, 1e-14);
    EXPECT_NEAR(std::pow(std::erf(theoretical_threshold(Morphology::open_cell, phi)), 2), phi, 1e-14);
    EXPECT_NEAR(1 - std::pow(std::erfc(theoretical_threshold(Morphology::closed_cell, phi)), 2), phi, 1e-14);
  }
}

TEST(FieldTheory, CorrelationIsTheMeanOverTheGammaLaw) {
  for (double b : {0.5, 3.0, 50.0})
    for (double r : {0.01, 0.06, 0.3}) {
      const double mean = integrate(
          [&](double n) {
            if (n == 0) return 0.0;
            const double eta = 2 * pi * n;
            return wavelengths_density(n, 9, b) * std::sin(eta * r) / (eta * r);
          },
          0, 200, 400000);
      // The density of b = 1/2 has a root at 0, where Simpson's rule converges with step^1.5: (5e-4)^1.5 =
      // 1e-5.
      EXPECT_NEAR(field_correlation(spectrum_of(b), r), mean, b < 1 ? 1e-5 : 1e-10) << b << " " << r;
    }
  EXPECT_EQ(field_correlation(spectrum_of(50), 0), 1);
}

TEST(FieldTheory, DensityOfWavelengthsHasMeanAndSecondMoment) {
  for (double b : {1.0, 10.0, 50.0, 500.0}) {
    const auto moment = [&](int power) {
      return integrate([&](double n) { return std::pow(n, power) * wavelengths_density(n, 9, b); }, 0, 200,
                       40000);
    };
    EXPECT_NEAR(moment(0), 1, 1e-6)
        << b;  // b = 1: a kink at 0, Simpson's error is step^2 = 2.5e-5 times its slope
    EXPECT_NEAR(moment(1), 9, 1e-6) << b;
    EXPECT_NEAR(moment(2) * 4 * pi * pi, mean_square_wave_number(spectrum_of(b)),
                1e-7 * mean_square_wave_number(spectrum_of(b)))
        << b;
  }
}

// Probability that |x| or x of two correlated normal variables lie above the threshold, by quadrature over
// one.
double two_point_by_quadrature(Morphology cut, double phi, double rho) {
  const double s = std::numbers::sqrt2 * theoretical_threshold(cut, phi);
  const double width = std::sqrt(2 * (1 - rho * rho));
  const auto normal = [](double x) { return std::exp(-0.5 * x * x) / std::sqrt(2 * pi); };
  if (cut == Morphology::single_cut)
    return integrate([&](double x) { return normal(x) * 0.5 * std::erfc((s - rho * x) / width); }, s, s + 12,
                     20000);
  return integrate(
      [&](double x) {
        return normal(x) * 0.5 * (std::erfc((-s - rho * x) / width) - std::erfc((s - rho * x) / width));
      },
      -s, s, 20000);
}

TEST(FieldTheory, TwoPointProbabilityIsTheIntegralOfTheBivariateNormalLaw) {
  for (double phi : {0.2, 0.5, 0.7})
    for (double r : {0.004, 0.03, 0.055, 0.11}) {
      const double rho = field_correlation(spectrum_of(50), r);
      const auto probability = [&](Morphology cut) {
        return two_point_probability({cut, phi, spectrum_of(50)}, r);
      };
      EXPECT_NEAR(probability(Morphology::single_cut),
                  two_point_by_quadrature(Morphology::single_cut, phi, rho), 1e-10);
      EXPECT_NEAR(probability(Morphology::two_cut), two_point_by_quadrature(Morphology::two_cut, phi, rho),
                  1e-10);
      EXPECT_NEAR(probability(Morphology::open_cell),
                  std::pow(two_point_by_quadrature(Morphology::two_cut, std::sqrt(phi), rho), 2), 1e-10);
      const double p = 1 - std::sqrt(1 - phi);
      const double sheet = two_point_by_quadrature(Morphology::two_cut, p, rho);
      EXPECT_NEAR(probability(Morphology::closed_cell), 2 * phi - 1 + std::pow(1 - 2 * p + sheet, 2), 1e-10);
    }
}

TEST(FieldTheory, TwoPointProbabilityGoesFromPhiToItsSquare) {
  for (Morphology cut :
       {Morphology::single_cut, Morphology::two_cut, Morphology::open_cell, Morphology::closed_cell}) {
    const FieldTheory theory{cut, 0.34, spectrum_of(50)};
    EXPECT_NEAR(two_point_probability(theory, 0), 0.34, 1e-14);
    EXPECT_NEAR(two_point_probability(theory, 20), 0.34 * 0.34, 1e-12);
  }
}

TEST(FieldTheory, SlopeOfTheTwoPointProbabilityIsTheSurface) {
  for (Morphology cut :
       {Morphology::single_cut, Morphology::two_cut, Morphology::open_cell, Morphology::closed_cell}) {
    const FieldTheory theory{cut, 0.34, spectrum_of(50)};
    const auto slope = [&](double r) { return 4 * (0.34 - two_point_probability(theory, r)) / r; };
    // Edges of intersections give a quadratic term, which two steps remove; the cubic one is (eta r)^2 = 3e-7
    // of the slope, times a factor below 10.
    const double surface = 2 * slope(1e-5) - slope(2e-5);
    EXPECT_NEAR(surface, minkowski_densities(theory).surface, 3e-6 * surface);
  }
}

TEST(FieldTheory, ExchangedPhasesHaveTheSameSurfaceAndEulerNumber) {
  for (double phi : {0.2, 0.45}) {
    const auto solid = minkowski_densities({Morphology::single_cut, phi, spectrum_of(50)});
    const auto pores = minkowski_densities({Morphology::single_cut, 1 - phi, spectrum_of(50)});
    EXPECT_NEAR(solid.surface, pores.surface, 1e-12 * solid.surface);
    EXPECT_NEAR(solid.euler, pores.euler, 1e-12 * std::abs(solid.euler));
    EXPECT_NEAR(solid.mean_curvature, -pores.mean_curvature, 1e-12 * solid.mean_curvature);
  }
  EXPECT_NEAR(minkowski_densities({Morphology::single_cut, 0.5, spectrum_of(50)}).mean_curvature, 0, 1e-10);
}

TEST(FieldTheory, UnionsAndIntersectionsObeyInclusionAndExclusion) {
  for (double p : {0.2, 0.55, 0.8}) {  // of one sheet
    const auto one = minkowski_densities({Morphology::two_cut, p, spectrum_of(50)});
    const auto both = minkowski_densities({Morphology::open_cell, p * p, spectrum_of(50)});
    const auto any = minkowski_densities({Morphology::closed_cell, 1 - (1 - p) * (1 - p), spectrum_of(50)});
    EXPECT_NEAR(both.surface + any.surface, 2 * one.surface, 1e-9 * one.surface);
    EXPECT_NEAR(both.mean_curvature + any.mean_curvature, 2 * one.mean_curvature,
                1e-9 * one.surface * one.surface);
    EXPECT_NEAR(both.euler + any.euler, 2 * one.euler, 1e-9 * std::abs(one.euler));
    // The edges of the intersection: pi/4 S_V^2 of length a volume, turning by a right angle in the mean.
    const double edges = 0.5 * (pi / 4 * one.surface * one.surface) * (pi / 2);
    EXPECT_NEAR(both.mean_curvature, 2 * p * one.mean_curvature + edges, 1e-9 * edges);
  }
}

TEST(FieldTheory, VarianceOfManyPointsFollowsTheIntegralRange) {
  // The faces and edges of a cube lose pairs, which are terms in 1/edge and 1/edge^2: three edges remove
  // them. The lattice adds the tail of the spectrum, 2 pi S_V / k^4 at 18 wave vectors k >= 2 pi 120 / m: 0.3
  // %.
  const FieldTheory theory{Morphology::single_cut, 0.3, {18 * pi, 8}};
  const double point = 0.3 * 0.7, spacing = 1.0 / 120, range = integral_range(theory);
  const auto ranged = [&](int edge) {
    return solid_fraction_variance(theory, edge, spacing) * std::pow(edge * spacing, 3) / point;
  };
  EXPECT_NEAR(0.5 * ranged(80) - 4 * ranged(160) + 4.5 * ranged(240), range, 0.01 * range);
  EXPECT_NEAR(solid_fraction_variance(theory, 1, spacing), point, 1e-14);
}

TEST(FieldTheory, RefusesSolidFractionsWithoutAThreshold) {
  EXPECT_ERROR(two_point_probability({Morphology::single_cut, 0, spectrum_of(50)}, 1), InputError,
               "solid fraction = 0;");
  EXPECT_ERROR(integral_range({Morphology::single_cut, 0.5, spectrum_of(2)}), InputError,
               "b = 2; expected b > 2");
  EXPECT_ERROR(solid_fraction_variance({Morphology::single_cut, 0.5, spectrum_of(50)}, 0, 1), InputError,
               "edge = 0");
}

}  // namespace
}  // namespace anticrack
