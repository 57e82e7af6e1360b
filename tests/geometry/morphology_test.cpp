#include <gtest/gtest.h>
#include <tbb/global_control.h>
#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <random>

#include "errors.h"
#include "expect_error.h"
#include "fields/graded_field.h"
#include "level_sets/level_set.h"
#include "microstructure.h"

namespace anticrack {
namespace {

constexpr double pi = std::numbers::pi;
constexpr std::array all = {Morphology::single_cut, Morphology::two_cut, Morphology::open_cell,
                            Morphology::closed_cell};
constexpr std::array names = {"single_cut", "two_cut", "open_cell", "closed_cell"};

const char* name_of(Morphology morphology) {
  return names[std::size_t(morphology)];
}

// The composed excess of the analytic fields, index space; nothing of the level set's method.
struct AnalyticSolid {
  Morphology morphology;
  double spacing, threshold;
  std::vector<GradedField> fields;

  AnalyticSolid(const Microstructure& structure, const GaussianRandomFieldSpec& spec, Morphology which)
      : morphology(which),
        spacing(structure.lattice.spacing),
        threshold(std::get<double>(structure.metadata.at("threshold"))) {
    for (int number : {0, 1}) fields.push_back(GradedField::sample(spec, structure.lattice, number));
  }

  double excess(const Vec3& y) const {
    const Vec3 r = spacing * (y + Vec3::Constant(0.5));
    const double first = fields[0].evaluate(r);
    if (morphology == Morphology::single_cut) return first - threshold;
    if (morphology == Morphology::two_cut) return threshold - std::abs(first);
    const double second = fields[1].evaluate(r);
    return threshold - (morphology == Morphology::open_cell ? std::max(std::abs(first), std::abs(second))
                                                            : std::min(std::abs(first), std::abs(second)));
  }

  // How far a ray from x runs before the phase changes; `reach` if it does not until then.
  double free_path(const Vec3& x, const Vec3& direction, bool solid, double reach) const {
    constexpr double stride = 0.12;
    for (double far = stride;; far += stride) {
      far = std::min(far, reach);
      if ((excess(x + far * direction) > 0) != solid) {
        double near = std::max(0.0, far - stride);
        for (int halving = 0; halving < 24; ++halving) {
          const double middle = 0.5 * (near + far);
          ((excess(x + middle * direction) > 0) != solid ? far : near) = middle;
        }
        return far;
      }
      if (far >= reach) return reach;
    }
  }

  // The shortest way out over all directions: many rays, then ever finer ones about the best.
  double distance(const Vec3& x, double reach) const {
    const bool solid = excess(x) > 0;
    constexpr int rays = 600, descents = 6;
    std::vector<std::pair<double, Vec3>> found;
    for (int n = 0; n < rays; ++n) {  // a spiral of golden angles
      const double z = 1 - (2 * n + 1.0) / rays, turn = pi * (3 - std::sqrt(5.0)) * n,
                   radius = std::sqrt(1 - z * z);
      const Vec3 direction(radius * std::cos(turn), radius * std::sin(turn), z);
      found.emplace_back(free_path(x, direction, solid, reach), direction);
    }
    std::ranges::sort(found, {}, [](const auto& ray) { return ray.first; });
    double best = reach;
    for (int start = 0; start < descents; ++start) {
      auto [length, direction] = found[std::size_t(start)];
      // Beside a crease only few ways lead on: many are tried, each turned by the golden angle.
      constexpr int ways = 24;
      double turn = 0;
      for (double angle = 0.1; angle > 2e-5;) {
        const Vec3 t0 = direction.unitOrthogonal(), t1 = direction.cross(t0);
        bool better = false;
        for (int way = 0; way < ways && !better; ++way) {
          turn += pi * (3 - std::sqrt(5.0));
          const Vec3 other = (direction + angle * (std::cos(turn) * t0 + std::sin(turn) * t1)).normalized();
          const double path = free_path(x, other, solid, length);
          if (path < length) length = path, direction = other, better = true;
        }
        if (!better) angle *= 0.5;
      }
      best = std::min(best, length);
    }
    return best;
  }
};

struct Errors {
  int tested = 0, near = 0, beyond = 0, near_beyond = 0;
  double near_squares = 0, squares = 0, largest = 0, largest_near = 0;
};

// Errors of the distance, in voxels, at random points of the band away from the faces.
Errors distance_errors(Morphology morphology, double points_a_wavelength, double phi, int count) {
  constexpr double wavelengths = 4;
  const int points = int(std::lround(wavelengths * points_a_wavelength));
  const SampleLattice lattice{{points, points, points}, 1.0 / points};
  const GaussianRandomFieldSpec spec{60, wavelengths, 50, 3};
  const Microstructure structure =
      generate_microstructure(lattice, spec, phi, ThresholdRule::theory, morphology);
  const AnalyticSolid solid(structure, spec, morphology);

  struct Point {
    Vec3 at;
    double distance, error;
  };
  std::mt19937 random(1);
  std::uniform_int_distribution<int> inner(4, points - 5);  // farther from the faces than the band is wide
  std::vector<Point> tested;
  while (int(tested.size()) < count) {
    const openvdb::Coord at(inner(random), inner(random), inner(random));
    const double distance = std::abs(structure.surface->grid->tree().getValue(at)) / lattice.spacing;
    if (distance <= 2.9) tested.push_back({Vec3(at[0], at[1], at[2]), distance, 0});
  }
  tbb::parallel_for(std::size_t(0), tested.size(), [&](std::size_t n) {
    Point& point = tested[n];
    point.error = std::abs(point.distance - solid.distance(point.at, point.distance + 0.3));
  });

  Errors errors;
  errors.tested = count;
  for (const Point& point : tested) {
    errors.squares += point.error * point.error;
    errors.largest = std::max(errors.largest, point.error);
    errors.beyond += point.error > 0.02;
    if (point.distance > 1) continue;
    ++errors.near;
    errors.near_squares += point.error * point.error;
    errors.largest_near = std::max(errors.largest_near, point.error);
    errors.near_beyond += point.error > 1e-3;
  }
  return errors;
}

TEST(Morphology, DistanceIsThatToTheClosestPointOfTheAnalyticFields) {
  for (const Morphology morphology : all) {
    const Errors errors = distance_errors(morphology, 14.5, 0.5, 150);
    EXPECT_LT(std::sqrt(errors.near_squares / errors.near), 1e-3) << name_of(morphology);
    EXPECT_LT(std::sqrt(errors.squares / errors.tested), 0.02) << name_of(morphology);
    EXPECT_GT(errors.near, 30) << name_of(morphology);
  }
}

// The table of geometry/README.md: ANTICRACK_SWEEP=1000 geometry_tests
// --gtest_filter='*FallWithTheResolution'
TEST(Morphology, DistanceErrorsFallWithTheResolution) {
  const char* points_tested = std::getenv("ANTICRACK_SWEEP");
  const bool sweep = points_tested != nullptr;
  if (sweep)
    std::puts(
        "morphology   points/wavelength  rms |d|<1   largest     > 1e-3       rms band    largest     > "
        "0.02");
  for (const Morphology morphology : all) {
    double coarsest = 0, finest = 0;
    for (const double points : sweep ? std::vector{5.0, 7.0, 10.0, 14.5} : std::vector{7.0, 14.0}) {
      const Errors errors = distance_errors(morphology, points, 0.5, sweep ? std::atoi(points_tested) : 60);
      const double near = std::sqrt(errors.near_squares / errors.near);
      if (sweep)
        std::printf("%-12s %-18g %-11.1e %-11.1e %3d of %-5d %-11.1e %-11.1e %d of %d\n", name_of(morphology),
                    points, near, errors.largest_near, errors.near_beyond, errors.near,
                    std::sqrt(errors.squares / errors.tested), errors.largest, errors.beyond, errors.tested);
      if (coarsest == 0) coarsest = near;
      finest = near;
    }
    EXPECT_LT(finest, 0.2 * coarsest) << name_of(morphology);  // fourth order promises (7/14)^4 = 0.06
  }
}

TEST(Morphology, SolidFractionOfTheTheoreticalThresholdHoldsOnAverage) {
  constexpr int realizations = 8;
  const SampleLattice lattice{{24, 24, 24}, 1.0 / 24};
  for (const Morphology morphology : all) {
    for (double phi : {0.2, 0.5, 0.8}) {
      double sum = 0, squares = 0;
      for (int seed = 0; seed < realizations; ++seed) {
        const double achieved = generate_microstructure(lattice, {1000, 5, 50, std::uint64_t(seed)}, phi,
                                                        ThresholdRule::theory, morphology)
                                    .solid_fraction();
        sum += achieved, squares += achieved * achieved;
      }
      const double mean = sum / realizations;
      const double error = std::sqrt((squares / realizations - mean * mean) / (realizations - 1));
      EXPECT_LT(error, 0.01) << name_of(morphology) << phi;             // else the next line says nothing
      EXPECT_NEAR(mean, phi, 4 * error) << name_of(morphology) << phi;  // standard errors, from the scatter
    }
  }
}

TEST(Morphology, ExactRuleMeetsTheSolidFractionToOnePointAndTheSignsSaySo) {
  const SampleLattice lattice{{24, 31, 20}, 0.05};
  for (const Morphology morphology : all) {
    for (double phi : {1e-3, 0.15, 0.5, 0.97, 1.0}) {
      const Microstructure structure =
          generate_microstructure(lattice, {400, 3, 50, 9}, phi, ThresholdRule::exact, morphology);
      EXPECT_EQ(structure.solid_points, std::size_t(std::llround(phi * double(lattice.count())))) << phi;
      EXPECT_EQ(seed_particles(structure, lattice).size(), structure.solid_points) << phi;
    }
  }
}

TEST(Morphology, SignsAreThoseOfTheFieldsInDoublePrecision) {
  const SampleLattice lattice{{30, 21, 26}, 0.01};
  const GaussianRandomFieldSpec spec{300, 3, 50, 8};
  for (const Morphology morphology : all) {
    const Microstructure structure =
        generate_microstructure(lattice, spec, 0.4, ThresholdRule::theory, morphology);
    const AnalyticSolid solid(structure, spec, morphology);
    for (int k = 0; k < 26; ++k)
      for (int j = 0; j < 21; ++j)
        for (int i = 0; i < 30; ++i) {
          const double excess = solid.excess(Vec3(i, j, k));
          if (std::abs(excess) < 1e-10) continue;  // the error of the fast sum
          ASSERT_EQ(structure.surface->grid->tree().getValue({i, j, k}) < 0, excess > 0)
              << name_of(morphology) << " " << i << " " << j << " " << k;
        }
  }
}

TEST(Morphology, TheTwoFieldsAreIndependent) {
  constexpr int points = 48, realizations = 12;
  const SampleLattice lattice{{points, points, points}, 1.0 / points};
  double sum = 0, squares = 0;
  for (int seed = 0; seed < realizations; ++seed) {
    const GaussianRandomFieldSpec spec{1000, 5, 50, std::uint64_t(seed)};
    const auto first = GradedField::sample(spec, lattice, 0).evaluate_excess_on_lattice(lattice, 0, 0);
    const auto second = GradedField::sample(spec, lattice, 1).evaluate_excess_on_lattice(lattice, 0, 0);
    double covariance = 0;
    for (std::size_t n = 0; n < first.size(); ++n) covariance += double(first[n]) * second[n];
    covariance /= double(first.size());
    sum += covariance, squares += covariance * covariance;
  }
  const double mean = sum / realizations, error = std::sqrt(squares) / realizations;
  EXPECT_LT(error, 0.01);
  EXPECT_LT(std::abs(mean), 4 * error);
}

TEST(Morphology, HasTheSameBitsOnAnyNumberOfThreads) {
  const SampleLattice lattice{{30, 24, 27}, 0.02};
  for (const Morphology morphology : all) {
    std::vector<std::vector<float>> values;
    for (int threads : {1, 2, 5}) {
      const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
      const Microstructure structure =
          generate_microstructure(lattice, {300, 3, 50, 4}, 0.4, ThresholdRule::exact, morphology);
      values.emplace_back();
      for (auto value = structure.surface->grid->cbeginValueAll(); value; ++value)
        values.back().push_back(*value);
    }
    EXPECT_EQ(values[0], values[1]) << name_of(morphology);
    EXPECT_EQ(values[0], values[2]) << name_of(morphology);
  }
}

TEST(Morphology, CapsTheSheetsAtTheFacesOfTheBox) {
  // A field that grows along x: the cut |x - 10| < 4.3 is a slab, whose distance is known.
  const Index3 points = {21, 12, 14};
  constexpr int p = PaddedField::padding;
  PaddedField field{points, {}};
  for (int k = -p; k < points[2] + p; ++k)
    for (int j = -p; j < points[1] + p; ++j)
      for (int i = -p; i < points[0] + p; ++i) field.values.push_back(float(0.1 * (i - 10)));
  const LevelSet level_set = build_level_set(CutSolid{Morphology::two_cut, {&field, 1}, 0.43}, 1.0);
  const Vec3 lower(5.7, -0.5, -0.5), upper(14.3, 11.5, 13.5);
  for (int k = -3; k < points[2] + 3; ++k)
    for (int j = -3; j < points[1] + 3; ++j)
      for (int i = 0; i < points[0]; ++i) {
        const Vec3 x(i, j, k);
        double exact = (x - x.cwiseMax(lower).cwiseMin(upper)).norm();
        if (exact == 0) exact = -std::min((x - lower).minCoeff(), (upper - x).minCoeff());
        // Single precision of the field.
        ASSERT_NEAR(level_set.grid->tree().getValue({i, j, k}), std::clamp(exact, -3.0, 3.0), 1e-4)
            << x.transpose();
      }
}

// Two slabs that cross: the distance to a wedge or a strut has a closed form.
void expect_exact_distances(const std::array<double, 2>& angles, double half) {
  const Index3 points = {40, 40, 12};
  constexpr int p = PaddedField::padding;
  std::array<Vec3, 2> normal;
  const Vec3 centre(19.6, 19.3, 0);
  std::vector<PaddedField> fields;
  for (std::size_t n : {0, 1}) {
    normal[n] = Vec3(std::cos(angles[n]), std::sin(angles[n]), 0);
    fields.push_back({points, {}});
    for (int k = -p; k < points[2] + p; ++k)
      for (int j = -p; j < points[1] + p; ++j)
        for (int i = -p; i < points[0] + p; ++i)
          fields.back().values.push_back(float(normal[n].dot(Vec3(i, j, k) - centre)));
  }
  // The corners of the parallelogram where the slabs' faces cross.
  std::array<Vec3, 4> corners;
  for (int n = 0; n < 4; ++n) {
    Mat3 m = Mat3::Identity();
    m.row(0) = normal[0], m.row(1) = normal[1];
    corners[std::size_t(n)] = centre + m.inverse() * Vec3(n & 1 ? half : -half, n & 2 ? half : -half, 0);
  }
  for (const Morphology morphology : {Morphology::open_cell, Morphology::closed_cell}) {
    const LevelSet level_set = build_level_set(CutSolid{morphology, fields, half}, 1.0);
    const bool open = morphology == Morphology::open_cell;
    for (int j = 4; j < 36; ++j)
      for (int i = 4; i < 36; ++i) {
        const Vec3 x(i, j, 6);  // the faces along z are farther than the band is wide
        const Vec3 flat = Vec3(i, j, 0);
        double exact = 100;
        for (const Vec3& corner : corners) exact = std::min(exact, (flat - corner).norm());
        for (std::size_t n : {0, 1})
          for (int side : {-1, 1}) {
            const double away = normal[n].dot(flat - centre) - side * half;
            const Vec3 foot = flat - away * normal[n];
            const double other = std::abs(normal[1 - n].dot(foot - centre)) - half;
            if (open ? other <= 0 : other >= 0) exact = std::min(exact, std::abs(away));
          }
        const double got = std::abs(level_set.grid->tree().getValue({i, j, 6}));
        ASSERT_NEAR(got, std::min(exact, 3.0), 1e-3)
            << name_of(morphology) << " " << x.transpose() << ", angles " << angles[0] << " " << angles[1];
      }
  }
}

TEST(Morphology, CreasesHaveTheirExactDistance) {
  expect_exact_distances({0.3, 0.5 + pi / 2}, 4.2);
}

TEST(Morphology, CreasesOfSheetsThatAreNearlyParallelHaveTheirExactDistance) {
  expect_exact_distances({0.3, 0.65}, 1.2);
  expect_exact_distances({0.3, 0.5}, 0.9);
}

TEST(Anisotropy, StretchesTheSecondMomentsOfTheWaveVectors) {
  constexpr int waves = 100000;
  const double square = std::pow(2 * pi * 9, 2) * 52 / 51;  // <eta^2> = <eta>^2 (b+2)/(b+1)
  for (double ratio : {0.4, 1.0, 3.0}) {
    for (int axis = 0; axis < 3; ++axis) {
      GaussianRandomFieldSpec spec{waves, 9, 50, 4};
      spec.anisotropy = ratio, spec.anisotropy_axis = axis;
      const auto field = GaussianRandomField::sample(spec, Vec3::Ones(), 0);
      Vec3 second = Vec3::Zero();
      for (const PlaneWave& wave : field.waves()) second += wave.eta.cwiseAbs2() / waves;
      for (int a = 0; a < 3; ++a) {
        const double factor = std::pow(ratio, a == axis ? -4.0 / 3 : 2.0 / 3);
        // Five standard errors: eta_a^2 / <eta_a^2> has variance 9/5 <eta^4>/<eta^2>^2 - 1 = 0.95.
        EXPECT_NEAR(second[a] / (factor * square / 3), 1, 5 * std::sqrt(0.95 / waves)) << ratio << axis << a;
      }
    }
  }
}

// Crossings of the surface along lines parallel to an axis, for each lattice edge.
Vec3 crossings(const Microstructure& structure, int first_plane = 0, int end_plane = -1) {
  const auto [nx, ny, nz] = structure.lattice.points;
  const auto voxels = structure.surface->grid->getConstAccessor();
  const auto solid = [&](int i, int j, int k) { return voxels.getValue({i, j, k}) < 0; };
  Vec3 count = Vec3::Zero(), edges = Vec3::Zero();
  for (int k = first_plane; k < (end_plane < 0 ? nz : end_plane); ++k)
    for (int j = 0; j + 1 < ny; ++j)
      for (int i = 0; i + 1 < nx; ++i) {
        const bool here = solid(i, j, k);
        count += Vec3(here != solid(i + 1, j, k), here != solid(i, j + 1, k),
                      k + 1 < nz && here != solid(i, j, k + 1));
        edges += Vec3(1, 1, k + 1 < nz);
      }
  return count.cwiseQuotient(edges);
}

TEST(Anisotropy, LengthensTheChordsAlongItsAxis) {
  const SampleLattice lattice{{64, 64, 64}, 1.0 / 64};
  Vec3 sum = Vec3::Zero();
  for (std::uint64_t seed = 0; seed < 4; ++seed) {
    GaussianRandomFieldSpec spec{2000, 5, 50, seed};
    spec.anisotropy = 2;
    sum += crossings(generate_microstructure(lattice, spec, 0.5));
  }
  // Chord lengths are inverse to the crossings. Four samples of 125 wavelengths cubed: about 2 % each.
  EXPECT_NEAR(sum[0] / sum[2], 2, 0.1);
  EXPECT_NEAR(sum[1] / sum[2], 2, 0.1);
}

TEST(WavelengthGradient, ScalesTheLocalWavelengthAndKeepsTheSolidFraction) {
  const SampleLattice lattice{{64, 64, 96}, 1.0 / 64};
  double low = 0, high = 0, low_solid = 0, high_solid = 0;
  constexpr int realizations = 6, slab = 12;
  for (std::uint64_t seed = 0; seed < realizations; ++seed) {
    GaussianRandomFieldSpec spec{2000, 9, 50, seed};
    spec.wavelength_gradient = 2;
    const Microstructure structure = generate_microstructure(lattice, spec, 0.4);
    low += crossings(structure, 0, slab)[0];
    high += crossings(structure, 96 - slab, 96)[0];
    const auto voxels = structure.surface->grid->getConstAccessor();
    for (int k = 0; k < slab; ++k)
      for (int j = 0; j < 64; ++j)
        for (int i = 0; i < 64; ++i) {
          low_solid += voxels.getValue({i, j, k}) < 0;
          high_solid += voxels.getValue({i, j, 95 - k}) < 0;
        }
  }
  const double count = realizations * slab * 64.0 * 64.0;
  // Crossings per length across are inverse to the wavelength; the slabs are an eighth of the height, where
  // the wavelength has hardly begun to turn. A few hundred wavelengths squared in all: 3 %.
  EXPECT_NEAR(low / high, 2, 0.12);
  // One slab scatters by 0.02 (low) and 0.04 (high).
  EXPECT_NEAR(low_solid / count, 0.4, 4 * 0.02 / std::sqrt(realizations));
  EXPECT_NEAR(high_solid / count, 0.4, 4 * 0.04 / std::sqrt(realizations));
}

TEST(WavelengthGradient, KeepsTheVarianceAtEveryHeight) {
  const SampleLattice lattice{{8, 8, 40}, 1.0 / 8};
  GaussianRandomFieldSpec spec{300, 2, 50, 0};
  spec.wavelength_gradient = 3;
  std::vector<double> squares(40);
  constexpr int realizations = 400;
  for (int seed = 0; seed < realizations; ++seed) {
    spec.seed = std::uint64_t(seed);
    const auto values = GradedField::sample(spec, lattice, 0).evaluate_excess_on_lattice(lattice, 0, 0);
    for (int k = 0; k < 40; ++k)
      squares[std::size_t(k)] += std::pow(values[std::size_t(k) * 64 + 27], 2) / realizations;
  }
  // Five standard errors of a chi-squared mean: variance 1/2, so that of the square is 1/2.
  for (int k = 0; k < 40; ++k)
    EXPECT_NEAR(squares[std::size_t(k)], 0.5, 5 * std::sqrt(0.5 / realizations)) << k;
}

TEST(WavelengthGradient, LatticeValuesAreTheDirectSum) {
  const SampleLattice lattice{{12, 14, 16}, 0.05};
  for (int axis = 0; axis < 3; ++axis) {
    GaussianRandomFieldSpec spec{200, 3, 50, 5};
    spec.wavelength_gradient = 0.6, spec.gradient_axis = axis, spec.anisotropy = 1.5;
    const auto field = GradedField::sample(spec, lattice, 1);
    const auto values = field.evaluate_excess_on_lattice(lattice, 1, 0.25);
    std::size_t n = 0;
    for (int k = -1; k <= 16; ++k)
      for (int j = -1; j <= 14; ++j)
        for (int i = -1; i <= 12; ++i, ++n)  // single precision
          ASSERT_NEAR(values[n], field.evaluate(lattice.point(i, j, k)) - 0.25, 1e-6)
              << i << " " << j << " " << k;
  }
}

TEST(PeriodicField, GoesOnAcrossOppositeFaces) {
  const SampleLattice lattice{{20, 26, 33}, 0.05};
  GaussianRandomFieldSpec spec{500, 4, 50, 2};
  spec.periodic = true, spec.anisotropy = 1.3;
  const auto field = GaussianRandomField::sample(spec, lattice.size(), 0);
  const auto values = field.evaluate_on_lattice(lattice, 1);
  const auto at = [&](int i, int j, int k) {
    return values[(std::size_t(k + 1) * 28 + std::size_t(j + 1)) * 22 + std::size_t(i + 1)];
  };
  for (int k = 0; k < 33; ++k)
    for (int j = 0; j < 26; ++j)
      for (int i = 0; i < 20; ++i) {  // 1e-10: the error of the fast sum
        if (i == 0) {
          ASSERT_NEAR(at(-1, j, k), at(19, j, k), 1e-10);
        }
        if (j == 0) {
          ASSERT_NEAR(at(i, -1, k), at(i, 25, k), 1e-10);
        }
        if (k == 0) {
          ASSERT_NEAR(at(i, j, -1), at(i, j, 32), 1e-10);
        }
      }
  EXPECT_GT(std::abs(at(0, 5, 5) - at(19, 5, 5)), 1e-3);
}

TEST(PeriodicField, AddsTheRoundingToTheSecondMoments) {
  GaussianRandomFieldSpec spec{200000, 4, 50, 2};
  const auto free = GaussianRandomField::sample(spec, Vec3::Ones(), 0);
  spec.periodic = true;
  const auto periodic = GaussianRandomField::sample(spec, Vec3::Ones(), 0);
  double difference = 0, scale = 0;
  for (std::size_t n = 0; n < free.waves().size(); ++n) {
    difference += periodic.waves()[n].eta.squaredNorm() - free.waves()[n].eta.squaredNorm();
    scale += free.waves()[n].eta.squaredNorm();
    ASSERT_LE((periodic.waves()[n].eta - free.waves()[n].eta).cwiseAbs().maxCoeff(), pi * (1 + 1e-9));
  }
  // 1/(4 N_w^2) = 1/64. Each difference is 2 eta . e + e^2, so that its deviation is about 2/N_w/sqrt(12) of
  // <eta^2>; five standard errors, and the rounding errors of components near 0 are not quite uniform.
  EXPECT_NEAR(difference / scale, 1.0 / 64, 5 * 0.15 / std::sqrt(200000.0) + 5e-4);
}

TEST(Microstructure, RefusesWhatContradictsItself) {
  const SampleLattice lattice{{10, 10, 10}, 0.1};
  GaussianRandomFieldSpec spec{10, 2, 50, 1};
  spec.wavelength_gradient = 1.5, spec.periodic = true;
  EXPECT_ERROR(generate_microstructure(lattice, spec, 0.5), InputError,
               "periodic with a wavelength gradient");
  spec.periodic = false, spec.wavelength_gradient = 0.2;
  EXPECT_ERROR(generate_microstructure(lattice, spec, 0.5), InputError, "10 wavelengths along a side");
  for (const auto& [gradient, text] : {std::pair(-1.0, "-1"), {std::nan(""), "nan"}}) {
    spec.wavelength_gradient = gradient;
    EXPECT_ERROR(generate_microstructure(lattice, spec, 0.5), InputError,
                 std::string("wavelength_gradient = ") + text + "; expected a finite number > 0");
  }
  spec.wavelength_gradient = 1, spec.anisotropy = 0;
  EXPECT_ERROR(generate_microstructure(lattice, spec, 0.5), InputError, "anisotropy = 0; expected a finite");
}

}  // namespace
}  // namespace anticrack
