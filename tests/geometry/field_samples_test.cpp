// Reference values of level cuts with nine wavelengths a side, b = 50, against several samples. Tolerances
// are standard errors, from the scatter of the samples themselves. Where the reference was measured, it is
// taken to rest on three samples as scattered as these, and on its rounding.

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <map>
#include <vector>

#include "measures/clusters.h"
#include "measures/field_theory.h"
#include "measures/geodesic.h"
#include "measures/minkowski.h"

namespace anticrack {
namespace {

constexpr int samples = 6, edge = 130;
constexpr double wavelengths = 9, heterogeneity = 50;

/// Values of G on the lattice, one a sample; cut at as many levels as wanted.
const std::vector<std::vector<double>>& fields() {
  static const std::vector<std::vector<double>> all = [] {
    std::vector<std::vector<double>> values;
    for (std::uint64_t seed = 1; seed <= samples; ++seed)
      values.push_back(GaussianRandomField::sample({10000, wavelengths, heterogeneity, seed}, 1.0)
                           .evaluate_on_lattice({{edge, edge, edge}, 1.0 / edge}, 0));
    return values;
  }();
  return all;
}

PhaseImage cut(int sample, double solid_fraction) {
  const double t = theoretical_threshold(Morphology::single_cut, solid_fraction);
  PhaseImage image{{edge, edge, edge}, 1.0 / edge, {}};
  for (const double value : fields()[std::size_t(sample)]) image.solid.push_back(value > t);
  return image;
}

struct Mean {
  double value, scatter;  ///< standard deviation of one sample
};

template <class Measure>
Mean mean_over_samples(double solid_fraction, const Measure& measure) {
  std::vector<double> values;
  double sum = 0, squares = 0;
  for (int sample = 0; sample < samples; ++sample) values.push_back(measure(cut(sample, solid_fraction)));
  for (const double value : values) sum += value;
  for (const double value : values) squares += std::pow(value - sum / samples, 2);
  return {sum / samples, std::sqrt(squares / (samples - 1))};
}

void expect_measured_reference(const Mean& mean, double reference, double rounding, double phi) {
  EXPECT_NEAR(mean.value, reference, 3 * mean.scatter * std::sqrt(1.0 / samples + 1.0 / 3) + rounding)
      << "phi = " << phi << ", scatter of a sample " << mean.scatter;
}

void expect_theory(const Mean& mean, double theory, double phi) {
  EXPECT_NEAR(mean.value, theory, 3.5 * mean.scatter / std::sqrt(samples))
      << "phi = " << phi << ", scatter of a sample " << mean.scatter;
}

TEST(FieldSamples, HaveTheTortuosityOfTheReference) {
  const std::map<double, double> reference = {{0.20, 1.972}, {0.25, 1.641}, {0.30, 1.462}, {0.34, 1.373},
                                              {0.44, 1.242}, {0.54, 1.169}, {0.70, 1.092}, {0.80, 1.059}};
  for (const auto& [phi, tortuosity] : reference) {
    const Mean mean = mean_over_samples(phi, [](const PhaseImage& image) {
      double sum = 0;
      for (int axis = 0; axis < 3; ++axis) sum += tortuosity_by_steps(image, Phase::solid, axis)->mean;
      return sum / 3;
    });
    expect_measured_reference(mean, tortuosity, 5e-4, phi);
  }
}

TEST(FieldSamples, PercolateAsMuchAsTheReference) {
  const std::map<double, double> reference = {
      {0.16, 0.54}, {0.18, 0.80}, {0.20, 0.90}, {0.25, 0.98}, {0.30, 0.995}};
  for (const auto& [phi, share] : reference) {
    const Mean mean = mean_over_samples(phi, [](const PhaseImage& image) {
      const Clusters solid = find_clusters(image, Phase::solid, Connectivity::faces);
      double all = 0;
      for (const Cluster& cluster : solid.clusters) all += double(cluster.voxels);
      return double(solid.spanning_voxels(SpanningRule::six_faces)) / all;
    });
    expect_measured_reference(mean, share, 5e-3, phi);
  }
}

// The threshold of an endless sample is 0.137; nine wavelengths round it off to some hundredths.
TEST(FieldSamples, StartToPercolateBetweenTwelveAndEighteenPercent) {
  const auto spanning = [](double phi) {
    int count = 0;
    for (int sample = 0; sample < samples; ++sample)
      count += find_clusters(cut(sample, phi), Phase::solid, Connectivity::faces)
                   .spanning_voxels(SpanningRule::six_faces) > 0;
    return count;
  };
  EXPECT_EQ(spanning(0.12), 0);
  EXPECT_EQ(spanning(0.18), samples);
}

// What Crofton's formula must see on average follows from theory: N_d, changes of phase along a direction, is
// twice phi - S2(d). Weights of the directions: Lang, Ohser & Hilfer 2001.
TEST(FieldSamples, HaveTheSurfaceThatTheoryExpectsOfTheirVoxels) {
  const GammaSpectrum spectrum = GammaSpectrum::of({1, wavelengths, heterogeneity, 0}, 1.0);
  for (const double phi : {0.25, 0.44, 0.70}) {
    const FieldTheory theory{Morphology::single_cut, phi, spectrum};
    const auto along = [&](double length) {  // 4 (phi - S2(r)) / r
      const double r = length / edge;
      return 4 * (phi - two_point_probability(theory, r)) / r;
    };
    const double expected = 6 * 0.0457789 * along(1) + 12 * 0.0369806 * along(std::sqrt(2.0)) +
                            8 * 0.0351956 * along(std::sqrt(3.0));
    const Mean mean = mean_over_samples(phi, [](const PhaseImage& image) {
      const auto counts = count_neighbourhoods(image, BoxBoundary::open);
      return surface_area(counts, CroftonDirections::thirteen) / counts.volume();
    });
    expect_theory(mean, expected, phi);
    EXPECT_NEAR(expected / minkowski_densities(theory).surface, 1, 0.01) << phi;  // what voxels lose
  }
}

// The mean over both neighbourhoods treats solid and pores alike; the lattice of 14 points a wavelength
// adds 1.8 +- 0.4 % at phi = 0.44.
TEST(FieldSamples, HaveTheEulerNumberOfTheory) {
  const GammaSpectrum spectrum = GammaSpectrum::of({1, wavelengths, heterogeneity, 0}, 1.0);
  for (const double phi : {0.25, 0.44, 0.70}) {
    const double theory = minkowski_densities({Morphology::single_cut, phi, spectrum}).euler;
    const Mean mean = mean_over_samples(phi, [&](const PhaseImage& image) {
      const auto counts = count_neighbourhoods(image, BoxBoundary::open);
      return 0.5 *
             (euler_density(counts, Connectivity::faces) + euler_density(counts, Connectivity::corners));
    });
    EXPECT_NEAR(mean.value, theory, 3.5 * mean.scatter / std::sqrt(samples) + 0.025 * std::abs(theory))
        << phi;
  }
}

}  // namespace
}  // namespace anticrack
