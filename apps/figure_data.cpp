#include "figure_data.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "fields/gaussian_random_field.h"
#include "measures/clusters.h"
#include "measures/field_theory.h"
#include "measures/geodesic.h"
#include "measures/two_point_correlation.h"

namespace anticrack {

namespace {

constexpr double mean_wavelengths = 9;      // N_w, Table 1
constexpr double paper_heterogeneity = 50;  // b, Table 1
constexpr std::array solid_fractions = {0.20, 0.25, 0.30, 0.34, 0.44, 0.54, 0.70, 0.80};

/// A field on a cube of side 1 that is cut at several levels.
class CubeField {
 public:
  CubeField(const FigureSamples& samples, int resolution, double heterogeneity, int realization)
      : lattice_{{resolution, resolution, resolution}, 1.0 / resolution},
        values_(GaussianRandomField::sample(
                    {samples.waves, mean_wavelengths, heterogeneity, std::uint64_t(realization + 1)}, 1.0)
                    .evaluate_on_lattice(lattice_, 0)) {}

  /// The sample of the paper: the level of theory, so that phi holds on average only.
  PhaseImage cut(double solid_fraction) const {
    const double t = theoretical_threshold(Morphology::single_cut, solid_fraction);
    PhaseImage image{lattice_.points, lattice_.spacing, std::vector<std::uint8_t>(values_.size())};
    for (std::size_t n = 0; n < values_.size(); ++n) image.solid[n] = values_[n] > t;
    return image;
  }

 private:
  SampleLattice lattice_;
  std::vector<double> values_;
};

FieldTheory theory(double solid_fraction, double heterogeneity = paper_heterogeneity) {
  return {Morphology::single_cut, solid_fraction,
          GammaSpectrum::of({1, mean_wavelengths, heterogeneity, 0}, 1.0)};
}

/// Mean and deviation over realizations, point by point.
class Average {
 public:
  void add(std::size_t point, double x, double y) {
    if (point >= x_.size()) {
      x_.resize(point + 1);
      values_.resize(point + 1);
    }
    x_[point] = x;
    values_[point].push_back(y);
  }
  FigureCurve curve(const std::string& label) const {
    FigureCurve curve{label, x_, {}, {}};
    for (const std::vector<double>& values : values_) {
      double sum = 0, squares = 0;
      for (const double v : values) sum += v;
      const double mean = sum / double(values.size());
      for (const double v : values) squares += (v - mean) * (v - mean);
      curve.mean.push_back(mean);
      curve.deviation.push_back(values.size() > 1 ? std::sqrt(squares / double(values.size() - 1)) : 0);
    }
    return curve;
  }

 private:
  std::vector<double> x_;
  std::vector<std::vector<double>> values_;
};

FigureCurve exact(const std::string& label, const std::vector<double>& x,
                  const std::function<double(double)>& y) {
  FigureCurve curve{label, x, {}, std::vector<double>(x.size(), 0.0)};
  for (const double value : x) curve.mean.push_back(y(value));
  return curve;
}

std::vector<double> steps(double low, double high, int count) {
  std::vector<double> x(std::size_t(count) + 1);
  for (int i = 0; i <= count; ++i) x[std::size_t(i)] = low + (high - low) * i / count;
  return x;
}

/// Specific surface in three ways from one sample.
struct SpecificSurfaces {
  Average paper, faces, slope;

  void add(std::size_t point, double x, const PhaseImage& image) {
    const auto inside = correlate_solid(image, PairRule::inside_box, 2);
    const auto periodic = correlate_solid(image, PairRule::periodic, 2);
    const SlopeSurface s = surface_by_slope(inside);
    const double phi = inside.solid_fraction;
    paper.add(point, x, surface_by_slope(periodic).radial / phi);
    faces.add(point, x, s.axes_first_difference / phi);
    slope.add(point, x, s.axes_extrapolated / phi);
  }
  std::vector<FigureCurve> curves() const {
    return {paper.curve("paper: periodic, radial"), faces.curve("voxel faces"),
            slope.curve("slope without bias")};
  }
};

double ssa(const FieldTheory& theory) {
  return minkowski_densities(theory).surface / theory.solid_fraction;
}

}  // namespace

std::vector<FigurePart> figure_b14(const FigureSamples& samples, const FigureWatch& watch) {
  constexpr std::array heterogeneities = {5.0, 10.0, 25.0, 50.0, 100.0};
  constexpr double phi = 0.34;
  FigurePart a{"b14a", "Distribution of wavelengths", "wavelengths along a side, L / \u03c9", "density", {}};
  FigurePart b{"b14b", "Two-point correlation, solid fraction 0.34", "r / L", "g_{norm}", {}};
  int done = 0;
  for (const double heterogeneity : heterogeneities) {
    const std::string label = fmt::format("b = {:g}", heterogeneity);
    a.curves.push_back(exact(label, steps(0, 20, 200), [&](double n) {
      return wavelengths_density(n, mean_wavelengths, heterogeneity);
    }));
    Average inside, periodic;
    for (int realization = 0; realization < samples.realizations; ++realization) {
      watch(done++ / double(heterogeneities.size() * std::size_t(samples.realizations)));
      const PhaseImage image = CubeField(samples, samples.resolution, heterogeneity, realization).cut(phi);
      const int largest_lag = samples.resolution / 3;
      const auto correlation = correlate_solid(image, PairRule::inside_box, largest_lag);
      for (std::size_t n = 0; n < correlation.radial.size(); ++n)
        inside.add(n, correlation.radial[n].r, correlation.normalized(correlation.radial[n].g()));
      if (heterogeneity != paper_heterogeneity) continue;
      const auto wrapped = correlate_solid(image, PairRule::periodic, largest_lag);
      for (std::size_t n = 0; n < wrapped.radial.size(); ++n)
        periodic.add(n, wrapped.radial[n].r, wrapped.normalized(wrapped.radial[n].g()));
    }
    b.curves.push_back(inside.curve(label));
    if (heterogeneity == paper_heterogeneity) {
      b.curves.push_back(periodic.curve(label + ", periodic (paper)"));
      const FieldTheory t = theory(phi, heterogeneity);
      b.curves.push_back(exact(label + ", theory", steps(0, 1.0 / 3, 200), [&](double r) {
        return (two_point_probability(t, r) - phi * phi) / (phi - phi * phi);
      }));
    }
  }
  return {a, b};
}

std::vector<FigurePart> figure_b15(const FigureSamples& samples, const FigureWatch& watch) {
  constexpr double phi = 0.34;
  const std::vector<double> shares = {0.25, 0.375, 0.5, 0.75, 1.0, 1.5};
  const double all = double(solid_fractions.size() + shares.size()) * samples.realizations;
  int done = 0;

  SpecificSurfaces by_fraction;
  for (int realization = 0; realization < samples.realizations; ++realization) {
    const CubeField field(samples, samples.resolution, paper_heterogeneity, realization);
    for (std::size_t n = 0; n < solid_fractions.size(); ++n) {
      watch(done++ / all);
      by_fraction.add(n, solid_fractions[n], field.cut(solid_fractions[n]));
    }
  }
  FigurePart a{"b15a", "Specific surface", "solid fraction \u03d5", "SSA L", by_fraction.curves()};
  a.curves.push_back(exact("theory", steps(0.18, 0.82, 64), [](double f) { return ssa(theory(f)); }));

  SpecificSurfaces by_resolution;
  std::vector<double> resolutions;
  for (std::size_t n = 0; n < shares.size(); ++n) {
    const int resolution = int(std::lround(shares[n] * samples.resolution));
    resolutions.push_back(resolution);
    for (int realization = 0; realization < samples.realizations; ++realization) {
      watch(done++ / all);
      by_resolution.add(n, resolution,
                        CubeField(samples, resolution, paper_heterogeneity, realization).cut(phi));
    }
  }
  FigurePart b{"b15b", "Specific surface, solid fraction 0.34", "lattice points along a side", "SSA L",
               by_resolution.curves()};
  b.curves.push_back(exact("theory", resolutions, [](double) { return ssa(theory(phi)); }));
  return {a, b};
}

std::vector<FigurePart> figure_b16(const FigureSamples& samples, const FigureWatch& watch) {
  const std::vector<double> fractions = {0.14, 0.15, 0.16, 0.18, 0.20, 0.25,
                                         0.30, 0.34, 0.44, 0.54, 0.70, 0.80};
  const double all = double(fractions.size()) * samples.realizations;
  int done = 0;
  Average percolating, spanning;
  std::array<Average, 4> tortuosity;  // pore by steps, solid by steps, both again by fast marching
  std::array<std::size_t, 4> points{};
  for (std::size_t n = 0; n < fractions.size(); ++n) {
    std::array<bool, 4> percolates{};
    for (int realization = 0; realization < samples.realizations; ++realization) {
      watch(done++ / all);
      const PhaseImage image =
          CubeField(samples, samples.resolution, paper_heterogeneity, realization).cut(fractions[n]);
      const Clusters solid = find_clusters(image, Phase::solid, Connectivity::faces);
      const auto voxels = solid.spanning_voxels(SpanningRule::six_faces);
      const auto solid_voxels = std::ranges::count(image.solid, std::uint8_t(1));
      percolating.add(n, fractions[n], double(voxels) / double(solid_voxels));
      spanning.add(n, fractions[n], voxels > 0);
      for (std::size_t way = 0; way < 4; ++way) {
        const Phase phase = way % 2 == 0 ? Phase::pore : Phase::solid;
        const auto t =
            way < 2 ? tortuosity_by_steps(image, phase, 1) : tortuosity_by_fast_marching(image, phase, 1);
        if (!t) continue;
        percolates[way] = true;
        tortuosity[way].add(points[way], fractions[n], t->mean);
      }
    }
    for (std::size_t way = 0; way < 4; ++way) points[way] += percolates[way];
  }
  FigurePart a{"b16a",
               "Percolating solid",
               "solid fraction \u03d5",
               "\u03d5_p / \u03d5",
               {percolating.curve("\u03d5_p / \u03d5"), spanning.curve("share of samples that percolate")}};
  FigurePart b{"b16b",
               "Geodesic tortuosity",
               "solid fraction \u03d5",
               "mean shortest path / L",
               {tortuosity[0].curve("pores, steps (paper)"), tortuosity[1].curve("solid, steps (paper)"),
                tortuosity[2].curve("pores, fast marching"), tortuosity[3].curve("solid, fast marching")}};
  return {a, b};
}

std::string to_csv(const FigurePart& part) {
  std::string csv = "curve,x,mean,deviation\n";
  for (const FigureCurve& curve : part.curves)
    for (std::size_t i = 0; i < curve.x.size(); ++i)
      csv += fmt::format("\"{}\",{:.17g},{:.17g},{:.17g}\n", curve.label, curve.x[i], curve.mean[i],
                         curve.deviation[i]);
  return csv;
}

}  // namespace anticrack
