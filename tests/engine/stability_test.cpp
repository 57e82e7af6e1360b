#include <gtest/gtest.h>
#include <Eigen/LU>
#include <cmath>
#include <cstdio>
#include <random>
#include <string>

#include "blocks.h"
#include "errors.h"
#include "observables/observer.h"
#include "simulation.h"
#include "time_step.h"

// Stiff and extreme cases. `engine_tests --gtest_filter=Stability.*` prints the table of the README: what
// survives, with which property, what is refused before step 1, and what aborts cleanly.

namespace anticrack {
namespace {

constexpr double h = 0.05;  ///< [m] particle spacing; two a cell

Material brittle(double E = 10e9, double nu = 0.3) {
  return {1e4, {E, nu}, DruckerPragerSoftening{1.2, 2.5e-4 * E, 1e6}};
}
Material elastic(double E = 10e9, double nu = 0.3) {
  return {1e4, {E, nu}, std::nullopt};
}

SimulationSetup between_platens(const Index3& points, const Material& material, double speed) {
  return {h * Vec3(points[0], points[1], points[2]), h * h * h, 2 * h, material,
          ConfinedCompression{1, true, speed},       {}};
}

/// Far from all walls.
SimulationSetup free_body(const Material& material) {
  return {100 * h * Vec3(1, 1, 1), h * h * h, 2 * h, material, ConfinedCompression{1, false, 1e-30}, {}};
}

std::vector<Vec3> random_velocities(std::size_t count, double size) {
  std::mt19937 random(5);
  std::normal_distribution<> normal(0, size);
  std::vector<Vec3> v;
  for (std::size_t i = 0; i < count; ++i) v.push_back({normal(random), normal(random), normal(random)});
  return v;
}

double energy(const Simulation& s) {
  return s.kinetic_energy() + s.setup().particle_volume * s.observed().elastic_energy;
}

bool is_finite(const Simulation& s) {
  const Particles& p = s.particles();
  double sum = 0;
  for (std::size_t i = 0; i < p.count; ++i) {
    for (int a = 0; a < 3; ++a) sum += std::abs(p.s[a][i]) + std::abs(p.v[a][i]);
    for (int e = 0; e < 6; ++e) sum += std::abs(p.h[e][i]);
    if (p.kappa.size()) sum += std::abs(p.kappa[i]);
  }
  return std::isfinite(sum);
}

void print(const char* name, const char* outcome, const std::string& what) {
  std::printf("| %-58s | %-8s | %s |\n", name, outcome, what.c_str());
}
std::string text(const char* format, double value) {
  char buffer[100];
  std::snprintf(buffer, sizeof buffer, format, value);
  return buffer;
}

/// A free porous body of fragments with random velocities: an unstable scheme gives it energy. Returns the
/// largest energy over the first, `steps` long.
double energy_growth(const Material& material, const Numerics& numerics = {}, int steps = 400,
                     double strain = 1e-4) {
  SimulationSetup setup = free_body(material);
  setup.numerics = numerics;
  const auto x = porous_block({12, 12, 12}, h, 0.3, 40 * h * Vec3(1, 1, 1));
  Simulation s(setup, x, random_velocities(x.size(), strain * elastic_wave_speed(material)));
  const double first = s.kinetic_energy();
  double most = 0;
  for (int n = 0; n < steps; ++n) {
    s.step(true);
    most = std::max(most, energy(s) / first);
    if (!(most < 1e6)) break;
  }
  return is_finite(s) ? most : std::numeric_limits<double>::infinity();
}

struct Crushed {
  double worst_residual = 0, last_residual = 0;  ///< of the energy balance, as in history.csv
  double yielded = 0;                            ///< share of the particles
  double least_J = 1;
  std::string text() const {
    char buffer[100];
    std::snprintf(buffer, sizeof buffer, "energy residual at most %.1f %%, in the end %.2f %%",
                  100 * worst_residual, 100 * std::abs(last_residual));
    return buffer;
  }
};

/// Crushes a porous block to a strain.
Crushed crush(const Material& material, double until, double speed, double share = 0.5,
              const Index3& points = {12, 24, 12}) {
  Simulation s(between_platens(points, material, speed), porous_block(points, h, share));
  Observer observer(s);
  Crushed result;
  while (Observer::loading_strain(s) < until) {
    const bool row_due = (s.steps() + 1) % 20 == 0;
    s.step(row_due);
    if (!row_due) continue;
    const HistoryRow row = observer.record(s, 0);
    result.last_residual = row.energy_residual;
    result.worst_residual = std::max(result.worst_residual, std::abs(row.energy_residual));
    result.yielded = row.plastic_fraction;
  }
  EXPECT_TRUE(is_finite(s));
  const Particles& p = s.particles();
  for (std::size_t i = 0; i < p.count; ++i) {
    Mat3 b;
    b << p.h[0][i], p.h[3][i], p.h[4][i], p.h[3][i], p.h[1][i], p.h[5][i], p.h[4][i], p.h[5][i], p.h[2][i];
    result.least_J = std::min(result.least_J, std::sqrt((b + Mat3::Identity()).determinant()));
  }
  return result;
}

std::string abort_message(Simulation& s, int steps) {
  try {
    for (int n = 0; n < steps; ++n) s.step(false);
  } catch (const NumericalError& error) {
    return error.what();
  }
  return {};
}

TEST(Stability, AnyPoissonRatioWithTheDefaultTimeStep) {
  for (const double nu : {-0.5, 0.0, 0.3, 0.45, 0.49, 0.499, 0.4999}) {
    const double growth = energy_growth(elastic(10e9, nu));
    print(("nu = " + text("%g", nu) + ", loose fragments").c_str(), "survives",
          text("energy never above %.3f of the first", growth));
    EXPECT_LT(growth, 1.05) << nu;
  }
}

TEST(Stability, ApicWithTheDefaultTimeStep) {
  Numerics apic;
  apic.transfer = TransferScheme::apic;
  double most = 0;
  for (const double nu : {-0.5, 0.0, 0.2, 0.3, 0.45, 0.49, 0.4999})
    most = std::max(most, energy_growth(elastic(10e9, nu), apic, 1000));
  print("APIC, nu = -0.5 to 0.4999, loose fragments", "survives",
        text("energy never above %.3f of the first", most));
  EXPECT_LT(most, 1.05);
}

TEST(Stability, ThePapersTimeStepFailsForALoneParticleAndNearIncompressibility) {
  Numerics paper;
  paper.time_step = TimeStepRule::paper;
  SimulationSetup setup = free_body(elastic());
  for (const TimeStepRule rule : {TimeStepRule::safe, TimeStepRule::paper}) {
    setup.numerics.time_step = rule;
    Simulation s(setup, std::vector<Vec3>(1, 50.3 * h * Vec3(1, 1, 1)), std::vector<Vec3>(1, Vec3(3, -2, 1)));
    const double first = s.kinetic_energy();
    double most = 0;
    for (int n = 0; n < 500 && most < 100; ++n) {
      s.step(true);
      most = std::max(most, energy(s) / first);
    }
    if (rule == TimeStepRule::safe)
      EXPECT_NEAR(most, 1, 1e-12);
    else
      EXPECT_GT(most, 100);
  }
  print("lone particle, nu = 0.3, time_step = \"paper\"", "unstable", "energy above 100 times the first");
  const double growth = energy_growth(elastic(10e9, 0.49), paper, 2000);
  EXPECT_GT(growth, 100);
  print("loose fragments, nu = 0.49, time_step = \"paper\"", "unstable", "energy above 100 times the first");
}

TEST(Stability, AnyStiffness) {
  for (const double E : {1.0, 1e4, 1e8, 1e12}) {
    const double growth = energy_growth(brittle(E));
    print(("E = " + text("%g Pa", E)).c_str(), "survives",
          text("energy never above %.3f of the first", growth));
    EXPECT_LT(growth, 1.01) << E;
  }
}

TEST(Stability, AnySofteningCohesionAndFriction) {
  struct {
    const char* name;
    DruckerPragerSoftening plasticity;
  } const cases[] = {
      {"softening 0", {1.2, 2.5e6, 0}},
      {"softening 1e12", {1.2, 2.5e6, 1e12}},
      {"cohesion 0", {1.2, 0, 1e6}},
      {"cohesion 1e-310 (subnormal)", {1.2, 1e-310, 1e6}},
      {"friction 0", {0, 2.5e6, 1e6}},
      {"friction 3", {3, 2.5e6, 1e6}},
      {"friction 0, cohesion 0: a gas", {0, 0, 0}},
  };
  for (const auto& c : cases) {
    Material material = elastic();
    material.plasticity = c.plasticity;
    const Crushed crushed = crush(material, 0.3, 20);
    print(c.name, "survives", "crushed by 30 %: " + crushed.text());
    EXPECT_LT(crushed.worst_residual, 0.05) << c.name;
  }
}

TEST(Stability, AnySolidFraction) {
  for (const double share : {1.0, 0.31, 0.14, 1e-3}) {
    const Index3 points{24, 24, 24};
    const Crushed crushed = crush(brittle(), 0.1, 20, share, points);
    print(("solid fraction " + text("%g", share)).c_str(), "survives", "crushed by 10 %: " + crushed.text());
    EXPECT_LT(crushed.worst_residual, 0.05) << share;
  }
}

TEST(Stability, OneParticleAndTwoInOnePlace) {
  for (const std::size_t count : {1, 2}) {
    const std::vector<Vec3> x(count, 50.3 * h * Vec3(1, 1, 1));
    Simulation s(free_body(brittle()), x, std::vector<Vec3>(count, Vec3(3, -2, 1)));
    const double first = s.kinetic_energy();
    for (int n = 0; n < 500; ++n) s.step(true);
    EXPECT_NEAR(energy(s) / first, 1, 1e-12);
    EXPECT_LT((s.positions()[0] - x[0] - s.time() * Vec3(3, -2, 1)).norm(), 1e-12);
    print(count == 1 ? "one particle" : "two particles in one place", "survives",
          "flies straight, energy to 1e-12");
  }
}

TEST(Stability, ALoneParticleAtTheEdgeOfItsSupport) {
  // Its farthest node gets (1/2 d^2)^3 of its mass.
  for (const double d : {1e-3, 1e-8, 1e-12}) {
    SimulationSetup setup = free_body(elastic());
    const double edge = 40.5 * setup.cell_size;
    const std::vector<Vec3> x{Vec3(1, 1, 1) * (edge + d * setup.cell_size)};
    Simulation s(setup, x, std::vector<Vec3>(1, Vec3(1, 1, 1)));
    const double dt = s.next_time_step();
    double least = 1;
    for (int n = 0; n < 500; ++n) {
      s.step(true);
      for (const auto& leaf : s.grid().leaves())
        for (int i = 0; i < block_cells; ++i)
          if (leaf.nodes[i].mass > 0) least = std::min(least, leaf.nodes[i].mass / s.particle_mass());
    }
    EXPECT_TRUE(is_finite(s));
    EXPECT_EQ(s.dt(), dt) << "the time step must not follow the lightest node";
    print(("lone particle " + text("%g", d) + " of a cell from the edge").c_str(), "survives",
          text("lightest node %.0e of its mass; same time step", least));
    if (d == 1e-12) {
      EXPECT_LT(least, 1e-70);
    }
  }
}

TEST(Stability, CompactionFarPastJamming) {
  Material soft = elastic(1e7);
  soft.plasticity = DruckerPragerSoftening{1.2, 2.5e3, 1e6};
  for (const double share : {0.5, 1.0}) {
    const Crushed crushed = crush(soft, 0.95, 8, share, {8, 160, 8});
    print(("solid fraction " + text("%g", share) + ", compacted by 95 %").c_str(), "survives",
          text("smallest J %.3f, ", crushed.least_J) + crushed.text());
    EXPECT_GT(crushed.least_J, 0);
    EXPECT_LT(crushed.least_J, share == 1 ? 0.05 : 0.12);
    EXPECT_LT(crushed.worst_residual, 0.05);
  }
}

TEST(Stability, AStepThatWouldInvertAParticleIsHalved) {
  // Two swarms fly at each other past a particle at rest half-way, each with a row of nodes of its own: at
  // the advective limit of 0.6 cells a step, 1.1 cells meet in the cell between.
  SimulationSetup setup = free_body(elastic(1e4));
  const double dx = setup.cell_size, speed = 50 * elastic_wave_speed(setup.material);
  std::vector<Vec3> x(41, dx * Vec3(20.6, 21.2, 21.3)), v(41, Vec3(speed, 0, 0));
  for (int i = 20; i < 40; ++i) x[i][0] = 22.4 * dx, v[i] = -v[i];
  x[40][0] = 21.5 * dx, v[40] = Vec3::Zero();
  Simulation s(setup, x, v);
  const double rule = s.next_time_step();
  s.step(true);
  EXPECT_EQ(s.dt(), 0.5 * rule);
  print("impact that would invert a particle", "survives", "time step halved");
  for (int n = 0; n < 200; ++n) s.step(true);
  EXPECT_TRUE(is_finite(s));
}

TEST(Stability, ATimeStepThatDoesNotAdvanceTheTimeAborts) {
  SimulationSetup setup = free_body(elastic());
  const auto x = porous_block({8, 8, 8}, h, 1, 40 * h * Vec3(1, 1, 1));
  std::vector<Vec3> v(x.size(), Vec3::Zero());
  v[100] = {1e200, 0, 0};
  Simulation s(setup, x, v);
  const std::string message = abort_message(s, 1);
  print("a velocity of 1e200 m/s", "aborts", message);
  EXPECT_NE(message.find("does not advance the time"), std::string::npos) << message;
}

TEST(Stability, ClosingWallsAbort) {
  Simulation s(between_platens({8, 8, 8}, elastic(1e9), 30), porous_block({8, 8, 8}, h, 0.2));
  const std::string message = abort_message(s, 1000);
  print("walls that close on each other", "aborts", message);
  EXPECT_NE(message.find("walls along y"), std::string::npos) << message;
}

TEST(Stability, FarFromTheOrigin) {
  // 1e6 m is 1e7 cells: the same body to the digits that its positions keep there.
  const auto run = [](const Vec3& shift) {
    SimulationSetup setup = free_body(elastic());
    setup.box_size += 2 * shift;
    const auto x = porous_block({8, 8, 8}, h, 0.6, 40 * h * Vec3(1, 1, 1) + shift);
    Simulation s(setup, x, random_velocities(x.size(), 0.1));
    for (int n = 0; n < 300; ++n) s.step(true);
    return energy(s);
  };
  const double near = run(Vec3::Zero()), far = run(Vec3(1e6, 1e6, 1e6));
  print("1e6 m from the origin", "survives",
        text("energy after 300 steps to %.0e", std::abs(far / near - 1)));
  EXPECT_NEAR(far / near, 1, 1e-6);
}

TEST(Stability, OpeningAndClosingCycles) {
  // Fragments without cohesion in a closed box, hurled at each other and at the walls again and again.
  Material material = brittle();
  material.plasticity->cohesion = 0;
  const Index3 points{16, 16, 16};
  const auto x = porous_block(points, h, 0.3);
  SimulationSetup setup = between_platens(points, material, 1e-30);
  setup.numerics.flip = 1;
  Simulation s(setup, x, random_velocities(x.size(), 10));
  const double first = s.kinetic_energy();
  double most = 0, pressed = 0;
  int closings = 0;
  for (int n = 0; n < 3000; ++n) {
    s.step(true);
    most = std::max(most, energy(s) / first);
    const double now = s.observed().elastic_energy;
    if (now > pressed) ++closings;
    pressed = now;
  }
  EXPECT_TRUE(is_finite(s));
  EXPECT_GT(closings, 10);
  EXPECT_LT(most, 1.01);
  print("fragments without cohesion bouncing in a box, 3000 steps", "survives",
        text("energy never above %.3f of the first", most));
}

}  // namespace
}  // namespace anticrack
