#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <cstdio>
#include <random>

#include "blocks.h"
#include "simulation.h"
#include "time_step.h"

// What must not matter: units, the names of the axes, where a body is and how fast it flies.

namespace anticrack {
namespace {

constexpr double h = 1.0 / 32;  ///< [m] particle spacing, a power of two so that shifts are exact

Material brittle() {
  return {1e4, {10e9, 0.3}, DruckerPragerSoftening{1.2, 2.5e6, 1e6}};
}

/// State by id.
struct State {
  std::vector<Vec3> x, v;
  std::vector<std::array<double, 6>> b;  ///< b - I: xx yy zz xy xz yz
  std::vector<double> kappa;

  explicit State(const Simulation& s) {
    const Particles& p = s.particles();
    const auto positions = s.positions();
    x.resize(p.count), v.resize(p.count), b.resize(p.count), kappa.resize(p.count);
    for (std::size_t i = 0; i < p.count; ++i) {
      const std::uint32_t id = p.id[i];
      x[id] = positions[i];
      v[id] = Vec3(p.v[0][i], p.v[1][i], p.v[2][i]);
      for (int e = 0; e < 6; ++e) b[id][e] = p.h[e][i];
      if (p.kappa.size()) kappa[id] = p.kappa[i];
    }
  }
};

TEST(Invariance, UnitsOfPowersOfTwoChangeNoBit) {
  const Index3 points{12, 20, 12};
  const auto x = porous_block(points, h, 0.5);
  const auto run = [&](double length, double density, double modulus) {
    const double speed = std::sqrt(modulus / density);  // of waves
    Material material = brittle();
    material.density *= density;
    material.elasticity.young_modulus *= modulus;
    material.plasticity->cohesion *= modulus;
    const double side = h * length;
    std::vector<Vec3> scaled;
    for (const Vec3& p : x) scaled.push_back(length * p);
    Simulation s({side * Vec3(12, 20, 12),
                  side * side * side,
                  2 * side,
                  material,
                  ConfinedCompression{1, true, 20 * speed},
                  {}},
                 scaled);
    for (int n = 0; n < 150; ++n) s.step(n % 7 == 0);
    return s;
  };
  const Simulation first = run(1, 1, 1);
  const State a(first);
  EXPECT_GT(*std::max_element(a.kappa.begin(), a.kappa.end()), 0) << "must yield to say anything";
  const double factors[][3] = {{8, 1, 1}, {1, 16, 1}, {1, 1, 1.0 / 64}, {1.0 / 32, 4, 256}};
  for (const auto& [length, density, modulus] : factors) {
    const Simulation other = run(length, density, modulus);
    const State b(other);
    const double speed = std::sqrt(modulus / density);
    EXPECT_EQ(other.time(), first.time() * length / speed);
    for (std::size_t i = 0; i < a.x.size(); ++i) {
      ASSERT_EQ(b.x[i], length * a.x[i]) << i;
      ASSERT_EQ(b.v[i], speed * a.v[i]) << i;
      ASSERT_EQ(b.b[i], a.b[i]) << i;
      ASSERT_EQ(b.kappa[i], a.kappa[i]) << i;
    }
    EXPECT_EQ(other.ledger().wall_work, first.ledger().wall_work * modulus * length * length * length);
  }
}

TEST(Invariance, NamesOfTheAxesDoNotMatter) {
  const Index3 points{12, 20, 14};
  const auto x = porous_block(points, h, 0.5);
  // Along x, y, z in turn, the sample turned with it. Sums have another order, and a crushed solid lets
  // roundings grow.
  const auto run = [&](int turn) {
    std::vector<Vec3> turned;
    Vec3 size;
    for (int a = 0; a < 3; ++a) size[(a + turn) % 3] = h * points[a];
    for (const Vec3& p : x) {
      turned.emplace_back();
      for (int a = 0; a < 3; ++a) turned.back()[(a + turn) % 3] = p[a];
    }
    Simulation s({size, h * h * h, 2 * h, brittle(), ConfinedCompression{(1 + turn) % 3, true, 5}, {}},
                 turned);
    for (int n = 0; n < 100; ++n) s.step(true);
    return s;
  };
  const Simulation first = run(0);
  const State a(first);
  for (const int turn : {1, 2}) {
    const Simulation other = run(turn);
    const State b(other);
    double away = 0;
    for (std::size_t i = 0; i < a.x.size(); ++i)
      for (int c = 0; c < 3; ++c)
        away = std::max(away, std::abs(b.x[i][(c + turn) % 3] - a.x[i][c]) / (2 * h));
    std::printf("turned axes: positions differ by %.1e cells\n", away);
    EXPECT_LT(away, 1e-9);
    EXPECT_NEAR(other.observed().q / first.observed().q, 1, 1e-6);
  }
}

/// A free elastic block that is struck: velocity falls off from one corner, turned by `R`, shifted and set
/// flying. Returns elastic energy over the first kinetic energy of the blow.
double struck_block(const Mat3& R, const Vec3& shift, const Vec3& flight) {
  const Index3 points{16, 16, 16};
  Material material = brittle();
  material.plasticity.reset();
  const Vec3 centre = 64 * h * Vec3(1, 1, 1);
  std::vector<Vec3> x, v;
  double blow = 0;
  for (const Vec3& p : porous_block(points, h, 1)) {
    const Vec3 from_centre = p - 8 * h * Vec3(1, 1, 1);
    const Vec3 struck = Vec3(1, 0.5, 0.25) * std::exp(-20 * (p - Vec3(0.1, 0.1, 0.1)).squaredNorm());
    x.push_back(centre + shift + R * from_centre);
    v.push_back(R * struck + flight);
    blow += 0.5 * material.density * h * h * h * struck.squaredNorm();
  }
  SimulationSetup setup{
      256 * h * Vec3(1, 1, 1), h * h * h, 2 * h, material, ConfinedCompression{1, false, 1e-30}, {}};
  setup.numerics.flip = 1;
  Simulation s(setup, x, v);
  const double until = 16 * h / elastic_wave_speed(material) / 2;  // before waves come back
  double energy = 0;
  while (s.time() < until) {
    s.step(true);
    energy = setup.particle_volume * s.observed().elastic_energy / blow;
  }
  return energy;
}

TEST(Invariance, PlaceOrientationAndFlightOfAFreeBodyMatterLittle) {
  const Mat3 I = Mat3::Identity();
  const double here = struck_block(I, Vec3::Zero(), Vec3::Zero());
  EXPECT_GT(here, 0.1);
  const double cells_off = struck_block(I, 2 * h * Vec3(5, -3, 8), Vec3::Zero());
  const double quarter =
      struck_block(Eigen::AngleAxisd(M_PI / 2, Vec3::UnitZ()).toRotationMatrix(), Vec3::Zero(), Vec3::Zero());
  const double turned = struck_block(Eigen::AngleAxisd(0.5, Vec3(1, 2, 3).normalized()).toRotationMatrix(),
                                     Vec3::Zero(), Vec3::Zero());
  const double flying = struck_block(I, Vec3::Zero(), Vec3(100, 40, -70));
  std::printf(
      "elastic energy %.4f of the blow; whole cells off %.1e, quarter turn %.1e, turned %+.4f, flying "
      "%+.4f\n",
      here, cells_off / here - 1, quarter / here - 1, turned / here - 1, flying / here - 1);
  // The last two see the grid: another place of the particles in their cells.
  EXPECT_EQ(cells_off, here);
  EXPECT_NEAR(quarter / here, 1, 1e-10);
  EXPECT_NEAR(turned / here, 1, 0.05);
  EXPECT_NEAR(flying / here, 1, 0.05);
}

}  // namespace
}  // namespace anticrack
