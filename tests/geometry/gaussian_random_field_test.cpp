#include "fields/gaussian_random_field.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>
#include <numbers>

#include "errors.h"
#include "expect_error.h"
#include "fields/random_stream.h"

namespace anticrack {
namespace {

constexpr double pi = std::numbers::pi;

GaussianRandomFieldSpec spec_of(int waves, double wavelengths, double heterogeneity, std::uint64_t seed) {
  return {.waves = waves, .wavelengths_per_side = wavelengths, .heterogeneity = heterogeneity, .seed = seed};
}

// Covariance of the field over its variance at distance r: the mean of sin(eta r)/(eta r) over the gamma law.
double correlation(double r, double mean_wave_number, double b) {
  const double u = mean_wave_number * r / (b + 1);
  return std::sin(b * std::atan(u)) / (b * u * std::pow(1 + u * u, 0.5 * b));
}

TEST(Philox, ReproducesThePublishedVectors) {  // Random123 1.14, kat_vectors, philox4x32 10
  using Words = std::array<std::uint32_t, 4>;
  EXPECT_EQ(philox({0, 0, 0, 0}, {0, 0}), (Words{0x6627e8d5, 0xe169c58d, 0xbc57ac4c, 0x9b00dbd8}));
  EXPECT_EQ(philox({~0u, ~0u, ~0u, ~0u}, {~0u, ~0u}),
            (Words{0x408f276d, 0x41c83b0e, 0xa20bc7c6, 0x6d5451fd}));
  EXPECT_EQ(philox({0x243f6a88, 0x85a308d3, 0x13198a2e, 0x03707344}, {0xa4093822, 0x299f31d0}),
            (Words{0xd16cfe09, 0x94fdcceb, 0x5001e420, 0x24126ea1}));
}

TEST(GaussianRandomField, WaveNumbersFollowTheGammaLaw) {
  constexpr int waves = 100000;
  constexpr double side = 0.5, wavelengths = 9;
  const double mean_expected = 2 * pi * wavelengths / side;
  for (double b : {0.5, 3.0, 50.0}) {
    const auto field = GaussianRandomField::sample(spec_of(waves, wavelengths, b, 7), side);
    double mean = 0, squares = 0;
    for (const PlaneWave& wave : field.waves()) mean += wave.eta.norm() / waves;
    for (const PlaneWave& wave : field.waves()) squares += std::pow(wave.eta.norm() - mean, 2) / waves;
    const double variance = mean_expected * mean_expected / (b + 1);
    // Five standard errors; the fourth central moment of the gamma law is variance^2 (3 + 6/(b+1)).
    EXPECT_NEAR(mean, mean_expected, 5 * std::sqrt(variance / waves)) << b;
    EXPECT_NEAR(squares, variance, 5 * variance * std::sqrt((2 + 6 / (b + 1)) / waves)) << b;
  }
}

TEST(GaussianRandomField, DirectionsAndPhasesAreUniform) {
  constexpr int waves = 100000;
  const auto field = GaussianRandomField::sample(spec_of(waves, 9, 50, 3), 1.0);
  Vec3 mean = Vec3::Zero();
  Mat3 second = Mat3::Zero();
  double cosine = 0, sine = 0;
  for (const PlaneWave& wave : field.waves()) {
    const Vec3 n = wave.eta.normalized();
    mean += n / waves;
    second += n * n.transpose() / waves;
    cosine += std::cos(wave.phase) / waves;
    sine += std::sin(wave.phase) / waves;
    ASSERT_TRUE(wave.phase >= 0 && wave.phase < 2 * pi);
  }
  // Five standard errors: variances 1/3 of n_i, 4/45 of n_i^2, 1/15 of n_i n_j, 1/2 of cosine and sine.
  const double root = std::sqrt(double(waves));
  EXPECT_LT(mean.cwiseAbs().maxCoeff(), 5 * std::sqrt(1.0 / 3) / root);
  EXPECT_LT((second - Mat3::Identity() / 3).cwiseAbs().maxCoeff(), 5 * std::sqrt(4.0 / 45) / root);
  EXPECT_LT(std::max(std::abs(cosine), std::abs(sine)), 5 * std::sqrt(0.5) / root);
}

TEST(GaussianRandomField, CharacteristicFunctionOfTheWavesIsTheCorrelation) {
  constexpr int waves = 200000;
  for (double b : {2.0, 50.0}) {
    const auto field = GaussianRandomField::sample(spec_of(waves, 9, b, 11), 1.0);
    for (double r : {0.02, 0.05, 0.1, 0.2}) {
      const Vec3 shift = r * Vec3(2, -1, 2) / 3;
      double mean = 0;
      for (const PlaneWave& wave : field.waves()) mean += std::cos(wave.eta.dot(shift)) / waves;
      // Five standard errors of a cosine, whose variance is at most 1.
      EXPECT_NEAR(mean, correlation(r, 2 * pi * 9, b), 5 / std::sqrt(double(waves))) << b << " " << r;
    }
  }
}

TEST(GaussianRandomField, CovarianceInSpaceIsHalfTheCorrelation) {
  constexpr int realizations = 10, points = 48;
  constexpr double wavelengths = 4, b = 50;
  const SampleLattice lattice{{points, points, points}, 1.0 / points};
  for (int shift : {0, 3, 6, 9}) {
    double sum = 0, squares = 0;
    for (int seed = 0; seed < realizations; ++seed) {
      const auto values = GaussianRandomField::sample(spec_of(1000, wavelengths, b, seed), 1.0)
                              .evaluate_on_lattice(lattice, 0);
      double covariance = 0;
      for (int row = 0; row < points * points; ++row)
        for (int i = 0; i + shift < points; ++i)
          covariance += values[row * points + i] * values[row * points + i + shift];
      covariance /= double(points) * points * (points - shift);
      sum += covariance;
      squares += covariance * covariance;
    }
    const double mean = sum / realizations;
    const double error = std::sqrt((squares / realizations - mean * mean) / (realizations - 1));
    const double expected =
        shift == 0 ? 0.5 : 0.5 * correlation(double(shift) / points, 2 * pi * wavelengths, b);
    EXPECT_LT(error, 0.02) << shift;                  // else the next line says nothing
    EXPECT_NEAR(mean, expected, 4 * error) << shift;  // standard errors, from the scatter of the realizations
  }
}

TEST(GaussianRandomField, LatticeValuesAreTheDirectSum) {
  struct Case {
    Index3 points;
    int padding;
    double wavelengths, b;
  };
  for (const auto& [points, padding, wavelengths, b] :
       {Case{{40, 40, 40}, 3, 9, 50}, Case{{17, 64, 23}, 0, 5, 1}, Case{{31, 8, 1}, 2, 0.2, 50},
        Case{{1, 1, 1}, 0, 0.5, 50}, Case{{24, 24, 48}, 3, 12, 0.5}}) {
    const SampleLattice lattice{points, 0.01};
    const auto field =
        GaussianRandomField::sample(spec_of(2000, wavelengths, b, 5), lattice.size().minCoeff());
    const std::vector<double> values = field.evaluate_on_lattice(lattice, padding);
    const Index3 padded = {points[0] + 2 * padding, points[1] + 2 * padding, points[2] + 2 * padding};
    ASSERT_EQ(values.size(), std::size_t(padded[0]) * padded[1] * padded[2]);
    // Both ends, where the kernel's transform is smallest, and a stride that meets every plane.
    for (std::size_t offset = 0; offset < values.size(); offset += offset + 97 < values.size() ? 97 : 1) {
      if (offset > 0 && offset + 40 < values.size() && offset % 5 != 0) continue;
      const int i = int(offset % padded[0]), j = int(offset / padded[0] % padded[1]),
                k = int(offset / padded[0] / padded[1]);
      ASSERT_NEAR(values[offset], field.evaluate(lattice.point(i - padding, j - padding, k - padding)), 1e-10)
          << i << " " << j << " " << k;
    }
  }
}

TEST(GaussianRandomField, SameBitsForAnyNumberOfThreads) {
  const SampleLattice lattice{{37, 52, 41}, 0.02};
  std::vector<std::vector<double>> values;
  for (int threads : {1, 2, 5}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    values.push_back(
        GaussianRandomField::sample(spec_of(3000, 6, 50, 1), 0.7).evaluate_on_lattice(lattice, 3));
  }
  EXPECT_EQ(values[0], values[1]);
  EXPECT_EQ(values[0], values[2]);
}

TEST(GaussianRandomField, WaveDependsOnSeedAndIndexAlone) {
  const auto few = GaussianRandomField::sample(spec_of(10, 9, 50, 1ull << 40), 1.0).waves();
  const auto many = GaussianRandomField::sample(spec_of(1000, 9, 50, 1ull << 40), 1.0).waves();
  const auto other = GaussianRandomField::sample(spec_of(10, 9, 50, 0), 1.0).waves();
  for (std::size_t n = 0; n < few.size(); ++n) {
    EXPECT_EQ(few[n].eta, many[n].eta);
    EXPECT_EQ(few[n].phase, many[n].phase);
    EXPECT_NE(few[n].phase, other[n].phase);
  }
}

TEST(GaussianRandomField, ExcessIsRoundedAfterTheSubtraction) {
  const SampleLattice lattice{{20, 20, 20}, 0.05};
  const auto field = GaussianRandomField::sample(spec_of(500, 3, 50, 2), 1.0);
  const auto values = field.evaluate_on_lattice(lattice, 1);
  const auto excess = field.evaluate_excess_on_lattice(lattice, 1, 0.3);
  ASSERT_EQ(values.size(), excess.size());
  for (std::size_t i = 0; i < values.size(); ++i) ASSERT_EQ(excess[i], float(values[i] - 0.3));
}

TEST(GaussianRandomField, RefusesParametersOutOfRange) {
  const double nan = std::nan(""), infinity = INFINITY;
  EXPECT_ERROR(GaussianRandomField::sample(spec_of(0, 9, 50, 1), 1), InputError, "waves = 0; expected >= 1");
  EXPECT_ERROR(GaussianRandomField::sample(spec_of(10, 0, 50, 1), 1), InputError,
               "wavelengths_per_side = 0; expected a finite number > 0");
  EXPECT_ERROR(GaussianRandomField::sample(spec_of(10, nan, 50, 1), 1), InputError,
               "wavelengths_per_side = nan; expected a finite number > 0");
  EXPECT_ERROR(GaussianRandomField::sample(spec_of(10, 9, -1, 1), 1), InputError,
               "heterogeneity = -1; expected a finite number > 0");
  EXPECT_ERROR(GaussianRandomField::sample(spec_of(10, 9, infinity, 1), 1), InputError,
               "heterogeneity = inf; expected a finite number > 0");
  EXPECT_ERROR(GaussianRandomField::sample(spec_of(10, 9, 50, 1), -2), InputError,
               "shortest side = -2; expected a finite number > 0");
  EXPECT_ERROR(GaussianRandomField({}), InputError, "no waves; expected at least one");
}

}  // namespace
}  // namespace anticrack
