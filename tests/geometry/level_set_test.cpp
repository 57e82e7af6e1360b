#include "level_sets/level_set.h"

#include <gtest/gtest.h>
#include <openvdb/tools/LevelSetSphere.h>
#include <tbb/global_control.h>

#include <Eigen/Geometry>
#include <cmath>
#include <random>

#include "errors.h"
#include "expect_error.h"
#include "level_sets/closest_point.h"
#include "microstructure.h"

namespace anticrack {
namespace {

PaddedField field_of(Index3 points, const std::function<double(const Vec3&)>& function) {
  constexpr int p = PaddedField::padding;
  PaddedField field{points, {}};
  for (int k = -p; k < points[2] + p; ++k)
    for (int j = -p; j < points[1] + p; ++j)
      for (int i = -p; i < points[0] + p; ++i) field.values.push_back(float(function(Vec3(i, j, k))));
  return field;
}

double value_at(const LevelSet& level_set, int i, int j, int k) {
  return level_set.grid->tree().getValue(openvdb::Coord(i, j, k));
}

// Value, gradient and curvature of the field less the threshold, in index space.
struct CutField {
  GaussianRandomField field;
  double spacing, threshold;

  double jet(const Vec3& y, Vec3& gradient, Mat3& hessian) const {
    const Vec3 r = spacing * (y + Vec3::Constant(0.5));
    const double scale = 1 / std::sqrt(double(field.waves().size()));
    double value = -threshold;
    gradient.setZero(), hessian.setZero();
    for (const PlaneWave& wave : field.waves()) {
      const double angle = wave.eta.dot(r) + wave.phase, c = scale * std::cos(angle),
                   s = scale * std::sin(angle);
      const Vec3 k = spacing * wave.eta;
      value += c;
      gradient -= s * k;
      hessian -= c * k * k.transpose();
    }
    return value;
  }

  // Distance from x to the stationary point of the distance that is found from y; infinite if there is none.
  double descend(const Vec3& x, Vec3 y) const {
    Vec3 gradient;
    Mat3 hessian;
    for (int iteration = 0; iteration < 50; ++iteration) {
      const double value = jet(y, gradient, hessian);
      const Vec3 n = gradient.normalized(), t0 = n.unitOrthogonal(), t1 = n.cross(t0);
      const Vec3 normal = gradient * (-value / gradient.squaredNorm());
      const Mat3 m = Mat3::Identity() + (x - y).dot(gradient) / gradient.squaredNorm() * hessian;
      const Vec3 residual = x - y - m * normal;
      double a = t0.dot(m * t0), b = t0.dot(m * t1), c = t1.dot(m * t1);
      const double shift = std::max(0.0, 0.2 - (0.5 * (a + c) - std::hypot(0.5 * (a - c), b)));
      a += shift, c += shift;
      const double r0 = t0.dot(residual), r1 = t1.dot(residual), determinant = a * c - b * b;
      Vec3 step = normal + t0 * (c * r0 - b * r1) / determinant + t1 * (a * r1 - b * r0) / determinant;
      if (step.norm() > 0.5) step *= 0.5 / step.norm();
      y += step;
      if (step.norm() < 1e-9) return (x - y).norm();
    }
    return INFINITY;
  }

  double distance(const Vec3& x, double guess, std::mt19937& random) const {
    double best = descend(x, x);
    std::normal_distribution<double> normal;
    for (int start = 0; start < 30; ++start) {
      const Vec3 direction(normal(random), normal(random), normal(random));
      best = std::min(best, descend(x, x + guess * direction.normalized()));
    }
    return best;
  }
};

TEST(LevelSet, DistanceIsThatToTheClosestPointOfTheField) {
  constexpr int points = 58;
  const SampleLattice lattice{{points, points, points}, 1.0 / points};
  const CutField cut{GaussianRandomField::sample({60, 4, 50, 3}, 1.0), lattice.spacing, 0.2};
  const LevelSet level_set = build_level_set(
      {lattice.points, cut.field.evaluate_excess_on_lattice(lattice, PaddedField::padding, 0.2)},
      lattice.spacing);

  std::mt19937 random(1);
  std::uniform_int_distribution<int> inner(4, points - 5);  // farther from the faces than the band is wide
  int tested = 0, missed = 0;
  while (tested < 300) {
    const int i = inner(random), j = inner(random), k = inner(random);
    const double got = std::abs(value_at(level_set, i, j, k)) / lattice.spacing;
    const double exact = got < 2.99 ? cut.distance(Vec3(i, j, k), got, random) : INFINITY;
    if (!std::isfinite(exact)) continue;
    // 14.5 lattice points a wavelength, as in the paper: measured 4e-5 in the mean square, 5e-4 at most ...
    const double error = std::abs(got - exact);
    missed += error > 1e-3;
    // ... but where two sheets of the surface are about equally near, the farther may be taken.
    ASSERT_LT(error, 0.05) << i << " " << j << " " << k;
    ++tested;
  }
  EXPECT_LE(missed, 1);
}

// Closest point of {n . y <= c} within the box by Dykstra's alternating projections.
Vec3 project(const Vec3& x, const Vec3& n, double c, const Vec3& lower, const Vec3& upper) {
  Vec3 y = x, plane_correction = Vec3::Zero(), box_correction = Vec3::Zero();
  for (int iteration = 0; iteration < 500; ++iteration) {
    const Vec3 a = y + plane_correction, on_plane = a - std::max(0.0, n.dot(a) - c) * n;
    plane_correction = a - on_plane;
    const Vec3 b = on_plane + box_correction;
    y = b.cwiseMax(lower).cwiseMin(upper);
    box_correction = b - y;
  }
  return y;
}

TEST(LevelSet, CapsTheCutByTheFacesOfTheBox) {
  // A half space within the box: convex, so that inside the distance is to the nearest plane and outside to
  // the projection.
  const Index3 points = {20, 17, 25};
  const Vec3 lower = Vec3::Constant(-0.5), upper(19.5, 16.5, 24.5);
  for (const Vec3& direction : {Vec3(1, 0, 0), Vec3(2, -1, 2), Vec3(-1, 3, 0.4)}) {
    const Vec3 n = direction.normalized();
    const double c = n.dot(Vec3(9.7, 8.2, 11.9));
    const LevelSet level_set =
        build_level_set(field_of(points, [&](const Vec3& x) { return c - n.dot(x); }), 1.0);
    for (int k = -3; k < points[2] + 3; ++k) {
      for (int j = -3; j < points[1] + 3; ++j) {
        for (int i = -3; i < points[0] + 3; ++i) {
          const Vec3 x(i, j, k);
          double exact = (x - project(x, n, c, lower, upper)).norm();
          if (exact == 0) exact = -std::min({c - n.dot(x), (x - lower).minCoeff(), (upper - x).minCoeff()});
          exact = std::clamp(exact, -3.0, 3.0);
          // Single precision of the field; Dykstra's method converges slowly in acute corners.
          ASSERT_NEAR(value_at(level_set, i, j, k), exact, 2e-3)
              << direction.transpose() << " at " << x.transpose();
        }
      }
    }
  }
}

TEST(LevelSet, FacesOfTheFullBlockAreExactPlanes) {
  const Microstructure block = full_block({{9, 12, 10}, 0.25});
  const LevelSet& level_set = *block.surface;
  EXPECT_EQ(value_at(level_set, 0, 5, 5), -0.125f);
  EXPECT_EQ(value_at(level_set, -1, 5, 5), 0.125f);
  EXPECT_EQ(value_at(level_set, 9, 5, 5), 0.125f);
  EXPECT_EQ(value_at(level_set, 1, 5, 5), -0.375f);
  EXPECT_FLOAT_EQ(value_at(level_set, -1, -1, -1), 0.125 * std::sqrt(3.0));
  EXPECT_FLOAT_EQ(value_at(level_set, 4, 12, 10), 0.125 * std::sqrt(2.0));
  EXPECT_EQ(value_at(level_set, 4, 5, 4), -0.75f);  // beyond the band
  EXPECT_EQ(level_set.grid->getGridClass(), openvdb::GRID_LEVEL_SET);
  EXPECT_EQ(level_set.grid->getName(), "surface");
  EXPECT_EQ(level_set.grid->indexToWorld(openvdb::Coord(0, 1, 2)), openvdb::Vec3d(0.125, 0.375, 0.625));
}

TEST(LevelSet, SignAtLatticePointsIsThatOfTheFieldLessTheThreshold) {
  const SampleLattice lattice{{30, 41, 26}, 0.01};
  const GaussianRandomFieldSpec spec{300, 3, 50, 8};
  const Microstructure structure = generate_microstructure(lattice, spec, 0.4);
  const double threshold = std::get<double>(structure.metadata.at("threshold"));
  EXPECT_NEAR(std::erf(threshold), 1 - 2 * 0.4, 1e-14);
  const auto values = GaussianRandomField::sample(spec, 0.26).evaluate_on_lattice(lattice, 0);
  std::size_t n = 0, solid = 0;
  for (int k = 0; k < 26; ++k)
    for (int j = 0; j < 41; ++j)
      for (int i = 0; i < 30; ++i, ++n) {
        ASSERT_EQ(value_at(*structure.surface, i, j, k) < 0, values[n] > threshold)
            << i << " " << j << " " << k;
        solid += values[n] > threshold;
      }
  EXPECT_EQ(structure.solid_points, solid);
}

TEST(LevelSet, SameBitsForAnyNumberOfThreads) {
  const SampleLattice lattice{{50, 33, 40}, 0.02};
  std::vector<std::vector<float>> values;
  for (int threads : {1, 2, 5}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    const Microstructure structure = generate_microstructure(lattice, {500, 4, 50, 1}, 0.3);
    values.emplace_back();
    for (auto value = structure.surface->grid->cbeginValueAll(); value; ++value)
      values.back().push_back(*value);
  }
  EXPECT_EQ(values[0], values[1]);
  EXPECT_EQ(values[0], values[2]);
}

TEST(SeedParticles, FillTheFullBlockInOrder) {
  const SampleLattice lattice{{7, 5, 6}, 0.3};
  const std::vector<Vec3> positions = seed_particles(full_block(lattice), lattice);
  ASSERT_EQ(positions.size(), lattice.count());
  std::size_t n = 0;
  for (int k = 0; k < 6; ++k)
    for (int j = 0; j < 5; ++j)
      for (int i = 0; i < 7; ++i) ASSERT_EQ(positions[n++], lattice.point(i, j, k));
}

TEST(SeedParticles, CarryTheVolumeOfTheAchievedSolidFraction) {
  const SampleLattice lattice{{40, 60, 35}, 1.0 / 35};
  const Microstructure structure = generate_microstructure(lattice, {2000, 4, 50, 6}, 0.34);
  const double volume = double(seed_particles(structure, lattice).size()) * std::pow(lattice.spacing, 3);
  EXPECT_NEAR(volume, structure.solid_fraction() * lattice.size().prod(),
              1e-12 * volume);  // rounding of the products
  EXPECT_EQ(std::get<double>(structure.metadata.at("solid_fraction_achieved")), structure.solid_fraction());
}

TEST(SeedParticles, SampleAForeignLevelSetOnAnotherLattice) {
  openvdb::initialize();
  Microstructure sphere;
  sphere.surface =
      std::make_shared<LevelSet>(LevelSet{openvdb::tools::createLevelSetSphere<openvdb::FloatGrid>(
          0.3f, openvdb::Vec3f(1.4f, 1.5f, 1.6f), 0.021f)});
  sphere.origin = {1, 1, 1};
  const SampleLattice lattice{{80, 80, 80}, 1.0 / 80};
  const std::vector<Vec3> positions = seed_particles(sphere, lattice);
  // Radius to 2 % of a voxel of either grid changes the volume by 0.3 %; so does the lattice's own count.
  const double volume = 4.0 / 3 * M_PI * std::pow(0.3, 3);
  EXPECT_NEAR(double(positions.size()) * std::pow(lattice.spacing, 3), volume, 0.006 * volume);
  for (const Vec3& x : positions) ASSERT_LT((x - Vec3(0.4, 0.5, 0.6)).norm(), 0.3 + 0.001);

  EXPECT_ERROR(
      seed_particles(sphere, {{4, 4, 4}, 0.01}), InputError,
      "no point of the lattice 4 x 4 x 4, spacing 0.01 m, lies in the solid");  // a corner without solid
}

TEST(Microstructure, SolidFractionOfTheTheoreticalThresholdHoldsOnAverage) {
  constexpr int realizations = 8;
  const SampleLattice lattice{{24, 24, 24}, 1.0 / 24};
  for (double phi : {0.2, 0.5, 0.8}) {
    double sum = 0, squares = 0;
    for (int seed = 0; seed < realizations; ++seed) {
      const double achieved =
          generate_microstructure(lattice, {1000, 5, 50, std::uint64_t(seed)}, phi).solid_fraction();
      sum += achieved, squares += achieved * achieved;
    }
    const double mean = sum / realizations;
    const double error = std::sqrt((squares / realizations - mean * mean) / (realizations - 1));
    EXPECT_LT(error, 0.01) << phi;             // else the next line says nothing
    EXPECT_NEAR(mean, phi, 4 * error) << phi;  // standard errors, from the scatter of the realizations
  }
}

TEST(Microstructure, ExactRuleMeetsTheSolidFractionToOnePoint) {
  const SampleLattice lattice{{24, 31, 20}, 0.05};
  for (double phi : {1e-3, 0.15, 0.5, 0.97}) {
    const Microstructure structure =
        generate_microstructure(lattice, {400, 3, 50, 9}, phi, ThresholdRule::exact);
    EXPECT_EQ(structure.solid_points, std::size_t(std::llround(phi * double(lattice.count())))) << phi;
    EXPECT_EQ(seed_particles(structure, lattice).size(), structure.solid_points) << phi;
  }
}

TEST(Microstructure, SolidFractionOneIsTheFullBlock) {
  const SampleLattice lattice{{10, 10, 10}, 0.1};
  EXPECT_EQ(generate_microstructure(lattice, {10, 3, 50, 1}, 1.0).solid_points, lattice.count());
}

TEST(Microstructure, WithoutSolidIsRefusedByItsParameters) {
  try {
    generate_microstructure({{6, 6, 6}, 0.1}, {100, 1, 50, 77}, 1e-9);
    FAIL();
  } catch (const InputError& error) {
    const std::string message = error.what();
    EXPECT_NE(message.find("1e-09"), std::string::npos) << message;
    EXPECT_NE(message.find("seed 77"), std::string::npos) << message;
    EXPECT_NE(message.find("threshold 4.2"), std::string::npos) << message;
  }
}

TEST(Microstructure, RefusesParametersOutOfRange) {
  const SampleLattice lattice{{10, 10, 10}, 0.1};
  const GaussianRandomFieldSpec spec{10, 3, 50, 1};
  for (double phi : {0.0, -0.1, 1.1, std::nan("")})
    EXPECT_ERROR(generate_microstructure(lattice, spec, phi), InputError,
                 "; expected 0 < solid fraction <= 1");
  EXPECT_ERROR(generate_microstructure({{0, 10, 10}, 0.1}, spec, 0.5), InputError,
               "expected at least one point along each axis and a finite spacing > 0");
  EXPECT_ERROR(generate_microstructure({{10, 10, 10}, 0.0}, spec, 0.5), InputError,
               "expected at least one point along each axis and a finite spacing > 0");
  EXPECT_ERROR(generate_microstructure({{10, 10, 10}, INFINITY}, spec, 0.5), InputError,
               "expected at least one point along each axis and a finite spacing > 0");
  EXPECT_ERROR(generate_microstructure(lattice, {10, 6, 50, 1}, 0.5), InputError,
               "6 wavelengths along a side of 10 lattice points; expected at most 5, two points a "
               "wavelength");  // two points a wavelength
  EXPECT_ERROR(full_block({{10, -1, 10}, 0.1}), InputError,
               "expected at least one point along each axis and a finite spacing > 0");
}

// Waves of some eight points, thresholds of all sizes: creases whose sheets cross at any angle, everywhere.
TEST(ClosestPoint, OfACreaseLiesOnBothSheetsOrIsNotFound) {
  const Index3 points{12, 12, 12};
  const auto random_field = [&](std::uint64_t seed) {
    const auto field = GaussianRandomField::sample({40, 1.5, 50, seed}, 1.0);
    const SampleLattice lattice{points, 1.0 / points[0]};
    return PaddedField{points, field.evaluate_excess_on_lattice(lattice, PaddedField::padding, 0.0)};
  };
  const Vec3 lower = Vec3::Constant(-0.5), upper = Vec3::Constant(points[0] - 0.5);
  std::mt19937 random(1);
  std::uniform_real_distribution<double> at(-0.5, points[0] - 0.5), level(-1.5, 1.5);
  int found = 0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const PaddedField first = random_field(2 * seed), second = random_field(2 * seed + 1);
    for (int n = 0; n < 4000; ++n) {
      const std::array<Sheet, 2> sheets{Sheet{&first, level(random)}, Sheet{&second, level(random)}};
      const Vec3 start(at(random), at(random), at(random)), x(at(random), at(random), at(random));
      const std::optional<Vec3> closest = find_closest_point(sheets, x, start, Accuracy::fine);
      if (!closest) continue;
      ++found;
      ASSERT_TRUE((closest->array() >= lower.array()).all() && (closest->array() <= upper.array()).all());
      for (const Sheet& sheet : sheets) {
        // At eight points a wavelength the cubic interpolants' own sheets lie up to 0.14 voxel off the
        // waves'.
        const FieldJet jet = interpolate_jet_finely(*sheet.field, *closest);
        ASSERT_LT(std::abs(jet.value - sheet.level) / jet.gradient.norm(), 0.01)  // voxels
            << "seed " << seed << ", " << n << ", at " << closest->transpose();
      }
    }
  }
  EXPECT_GT(found, 20000);
}

}  // namespace
}  // namespace anticrack
