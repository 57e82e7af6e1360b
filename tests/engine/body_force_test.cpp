#include "body_force.h"

#include <gtest/gtest.h>

#include "blocks.h"
#include "momentum.h"
#include "simulation.h"

namespace anticrack {
namespace {

constexpr double h = 0.1;

/// A body far from all walls.
SimulationSetup falling_body(BodyAcceleration b) {
  return {Vec3(100, 100, 100) * h,
          h * h * h,
          2 * h,
          {1e4, {10e9, 0.3}, {}},
          ConfinedCompression{1, false, 1e-30},
          {},
          std::move(b)};
}

TEST(BodyForce, ABodyFallsFreelyAndUnstrained) {
  const Vec3 gravity(0, -3e5, 1e5);
  const auto x = block({8, 9, 7}, h, Vec3(40, 80, 40) * h);
  Simulation s(falling_body([&](const Vec3&, double) { return gravity; }), x);
  Vec3 fall = Vec3::Zero(), v = Vec3::Zero();
  std::size_t strays = 0;
  for (int n = 0; n < 40; ++n) {
    s.step(false);
    v += s.dt() * gravity;
    fall += s.dt() * v;
    strays += s.stray_count();
  }
  EXPECT_GT(strays, 100u) << "particles must change cell for the test to say anything";
  EXPECT_GT(fall.norm(), 4 * h);
  const auto now = s.positions();
  for (std::size_t i = 0; i < now.size(); ++i) {
    // Roundings of forty steps across a hundred cells.
    EXPECT_LT((now[i] - x[s.particles().id[i]] - fall).norm(), 1e-11 * h);
    for (int e = 0; e < 6; ++e) EXPECT_LT(std::abs(s.particles().h[e][i]), 1e-11);
  }
}

TEST(BodyForce, GivesEveryParticlesShareOfMomentumInStraysToo) {
  const auto b = [](const Vec3& x, double t) { return Vec3(1e3 * x[1] * x[1], 2e3 * x[0], -1e5 * (1 + t)); };
  const auto x = block({8, 9, 7}, h, Vec3(40, 40, 40) * h);
  Simulation s(falling_body(b), x, std::vector<Vec3>(x.size(), Vec3(120, -80, 150)));
  std::size_t strays = 0;
  for (int n = 0; n < 30; ++n) {
    Vec3 expected = momentum_of(s);
    const double dt = s.next_time_step();
    for (const Vec3& at : s.positions()) expected += s.particle_mass() * dt * b(at, s.time());
    s.step(false);
    strays += s.stray_count();
    // Roundings of sums over five hundred particles.
    EXPECT_LT((momentum_of(s) - expected).norm(), 1e-12 * expected.norm());
  }
  EXPECT_GT(strays, 100u);
}

}  // namespace
}  // namespace anticrack
