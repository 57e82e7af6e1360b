#include "simulation.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>

#include "blocks.h"
#include "errors.h"
#include "expect_error.h"
#include "reference_step.h"

namespace anticrack {
namespace {

Material elastic(double E = 10e9, double nu = 0.3) {
  return {1e4, {E, nu}, std::nullopt};
}
Material brittle() {
  return {1e4, {10e9, 0.3}, DruckerPragerSoftening{1.2, 2.5e6, 1e6}};
}

struct Comparison {
  double position = 0, velocity = 0, affine = 0, kappa = 0, stress = 0;
};

/// Runs engine and reference side by side with the engine's time step.
Comparison compare(const SimulationSetup& setup, const std::vector<Vec3>& positions, int steps,
                   double* plastic = nullptr) {
  Simulation engine(setup, positions);
  reference::Model plain{setup.material,
                         setup.cell_size,
                         engine.particle_mass(),
                         setup.particle_volume,
                         setup.numerics.flip,
                         setup.numerics.transfer == TransferScheme::apic,
                         Vec3(setup.numerics.grid_offset.data()),
                         setup.numerics.wall_rule,
                         {},
                         {},
                         {}};
  for (const Vec3& x : positions) plain.particles.push_back({x});
  const auto walls =
      std::holds_alternative<TriaxialLoading>(setup.loading)
          ? triaxial_walls(std::get<TriaxialLoading>(setup.loading), setup.box_size, setup.cell_size)
          : confined_compression_walls(std::get<ConfinedCompression>(setup.loading), setup.box_size);
  for (const Wall& w : walls)
    plain.walls.push_back({w.axis, w.upper, w.position + (w.upper ? -1 : 1) * w.grip_depth, w.full_velocity,
                           w.tangential == Tangential::fixed});
  for (int n = 0; n < steps; ++n) {
    engine.step(true);
    if (setup.numerics.flip_time) plain.flip = std::exp(-engine.dt() / *setup.numerics.flip_time);
    plain.step(engine.dt());
  }
  Comparison worst;
  const auto x = engine.positions();
  const Particles& p = engine.particles();
  double scale_v = 0, kappa = 0;
  for (const auto& r : plain.particles)
    scale_v = std::max(scale_v, r.v.norm()), kappa = std::max(kappa, r.kappa);
  double tau_scale = 0, tau_sum[6] = {};
  for (const auto& r : plain.particles) {
    const Mat3 t = plain.kirchhoff_stress(r.F);
    const double c[6] = {t(0, 0), t(1, 1), t(2, 2), t(0, 1), t(0, 2), t(1, 2)};
    for (int e = 0; e < 6; ++e) tau_sum[e] += c[e];
    tau_scale += t.norm();
  }
  for (std::size_t i = 0; i < p.count; ++i) {
    const auto& r = plain.particles[p.id[i]];
    worst.position = std::max(worst.position, (x[i] - r.x).norm() / setup.cell_size);
    worst.velocity = std::max(worst.velocity, (Vec3(p.v[0][i], p.v[1][i], p.v[2][i]) - r.v).norm() / scale_v);
    if (plain.apic)
      for (int e = 0; e < 9; ++e)
        worst.affine =
            std::max(worst.affine, std::abs(p.affine[e][i] - setup.cell_size * r.C(e / 3, e % 3)) / scale_v);
    if (p.kappa.size())
      worst.kappa = std::max(worst.kappa, std::abs(p.kappa[i] - r.kappa) / std::max(kappa, 1e-300));
  }
  for (int e = 0; e < 6; ++e)
    worst.stress = std::max(worst.stress, std::abs(engine.observed().tau[e] - tau_sum[e]) / tau_scale);
  if (plastic) *plastic = kappa;
  return worst;
}

SimulationSetup setup_of(const Index3& points, double h, const Material& material, const Loading& loading) {
  return {h * Vec3(points[0], points[1], points[2]), h * h * h, 2 * h, material, loading, {}};
}

SimulationSetup with_apic(SimulationSetup setup) {
  setup.numerics.transfer = TransferScheme::apic;
  return setup;
}

// Tolerances: F holds a strain of e to 1e-16 / e only, and the steps add it up; b - I does not. The reference
// is the less exact of the two.
TEST(Simulation, MatchesPlainStepInElasticTriaxialLoading) {
  const Index3 points{13, 14, 12};
  auto setup = setup_of(points, 0.05, elastic(), TriaxialLoading{0.5, -1, 2.0, WallKind::sticky});
  const Comparison worst = compare(setup, porous_block(points, 0.05, 0.6), 300);
  EXPECT_LT(worst.position, 1e-12);
  EXPECT_LT(worst.velocity, 1e-9);
  EXPECT_LT(worst.stress, 1e-9);
}

TEST(Simulation, MatchesPlainStepWhenYielding) {
  const Index3 points{12, 16, 12};
  auto setup = setup_of(points, 0.05, brittle(), ConfinedCompression{1, true, 5.0});
  double kappa = 0;
  const Comparison worst = compare(setup, porous_block(points, 0.05, 0.5), 200, &kappa);
  EXPECT_GT(kappa, 1e-4) << "the case must yield to say anything";
  EXPECT_LT(worst.position, 1e-9);
  EXPECT_LT(worst.kappa, 1e-6);
}

TEST(Simulation, MatchesPlainStepWithStraysAndShiftedGrid) {
  const Index3 points{24, 9, 8};
  auto setup = setup_of(points, 0.05, elastic(1e9), ConfinedCompression{0, false, 60.0});
  setup.numerics.grid_offset = {0.3, 0.7, 0.11};
  const Comparison worst = compare(setup, porous_block(points, 0.05, 0.5), 120);
  EXPECT_LT(worst.position, 1e-10);
  EXPECT_LT(worst.velocity, 1e-9);
}

TEST(Simulation, MatchesPlainStepWithEveryInstructionSet) {
  const Index3 points{12, 16, 12};
  const auto setup = setup_of(points, 0.05, brittle(), ConfinedCompression{1, true, 60.0});
  const std::vector<std::string> available = available_simd();
  ASSERT_FALSE(available.empty());
  const auto has = [&](const char* name) { return std::ranges::find(available, name) != available.end(); };
  EXPECT_EQ(has("AVX3"), has("AVX3_HALVES"));
  for (const std::string& simd : available_simd()) {
    use_simd(simd);
    EXPECT_EQ(kernels().simd, simd);
    double kappa = 0;
    const Comparison worst = compare(setup, porous_block(points, 0.05, 0.5), 60, &kappa);
    EXPECT_GT(kappa, 1e-4) << "the case must yield to say anything";
    EXPECT_LT(worst.position, 1e-9) << simd;
    EXPECT_LT(worst.kappa, 1e-6) << simd;
  }
  use_simd("");
  EXPECT_EQ(kernels().simd, available_simd().front());
  EXPECT_ERROR(use_simd("SSE9"), InputError, "instruction set SSE9; expected one of ");
}

// The tolerances of APIC are those of the same cases above; a sum against a polynomial of the cell adds a few
// roundings of the nodal velocities to its affine part.
TEST(Simulation, MatchesPlainStepInApicTransfer) {
  const Index3 points{13, 14, 12};
  Material sound = elastic();  // never yields: the combination with the paper's return mapping
  sound.plasticity = DruckerPragerSoftening{1.2, 1e12, 0};
  for (const Material& material : {elastic(), sound}) {
    auto setup = with_apic(setup_of(points, 0.05, material, TriaxialLoading{0.5, -1, 2.0, WallKind::sticky}));
    setup.numerics.return_mapping = ReturnMapping::paper;
    const Comparison worst = compare(setup, porous_block(points, 0.05, 0.6), 300);
    EXPECT_LT(worst.position, 1e-12);
    EXPECT_LT(worst.velocity, 1e-9);
    EXPECT_LT(worst.affine, 1e-9);
    EXPECT_LT(worst.stress, 1e-9);
  }
}

TEST(Simulation, MatchesPlainStepInApicTransferWhenYielding) {
  const Index3 points{12, 16, 12};
  const auto setup = with_apic(setup_of(points, 0.05, brittle(), ConfinedCompression{1, true, 5.0}));
  double kappa = 0;
  const Comparison worst = compare(setup, porous_block(points, 0.05, 0.5), 200, &kappa);
  EXPECT_GT(kappa, 1e-4) << "the case must yield to say anything";
  EXPECT_LT(worst.position, 1e-9);
  EXPECT_LT(worst.kappa, 1e-6);
}

TEST(Simulation, MatchesPlainStepInApicTransferWithStraysAndShiftedGrid) {
  const Index3 points{24, 9, 8};
  auto setup = with_apic(setup_of(points, 0.05, elastic(1e9), ConfinedCompression{0, false, 60.0}));
  setup.numerics.grid_offset = {0.3, 0.7, 0.11};
  const auto positions = porous_block(points, 0.05, 0.5);
  Simulation engine(setup, positions);
  std::size_t strays = 0;
  for (int n = 0; n < 120; ++n) {
    engine.step(false);
    strays += engine.stray_count();
  }
  EXPECT_GT(strays, 0u) << "the case must have strays to say anything";
  const Comparison worst = compare(setup, positions, 120);
  EXPECT_LT(worst.position, 1e-10);
  EXPECT_LT(worst.velocity, 1e-9);
  EXPECT_LT(worst.affine, 1e-9);
}

TEST(Simulation, MatchesPlainStepInApicTransferWithEveryInstructionSet) {
  const Index3 points{12, 16, 12};
  const auto setup = with_apic(setup_of(points, 0.05, brittle(), ConfinedCompression{1, true, 60.0}));
  for (const std::string& simd : available_simd()) {
    use_simd(simd);
    double kappa = 0;
    const Comparison worst = compare(setup, porous_block(points, 0.05, 0.5), 60, &kappa);
    EXPECT_GT(kappa, 1e-4) << "the case must yield to say anything";
    EXPECT_LT(worst.position, 1e-9) << simd;
    EXPECT_LT(worst.kappa, 1e-6) << simd;
  }
  use_simd("");
}

TEST(Simulation, MatchesPlainStepWithFlipTime) {
  const Index3 points{12, 16, 12};
  auto setup = setup_of(points, 0.05, brittle(), ConfinedCompression{1, true, 5.0});
  setup.numerics.flip_time = 1e-4;  // a few steps
  double kappa = 0;
  const Comparison worst = compare(setup, porous_block(points, 0.05, 0.5), 200, &kappa);
  EXPECT_GT(kappa, 1e-6) << "the case must yield to say anything";
  EXPECT_LT(worst.position, 1e-9);
  EXPECT_LT(worst.velocity, 1e-6);
}

TEST(Simulation, MatchesPlainStepInPicTransfer) {
  const Index3 points{12, 16, 12};
  auto setup = setup_of(points, 0.05, brittle(), ConfinedCompression{1, true, 5.0});
  setup.numerics.flip = 0;
  double kappa = 0;
  const Comparison worst = compare(setup, porous_block(points, 0.05, 0.5), 200, &kappa);
  EXPECT_GT(kappa, 1e-6) << "the case must yield to say anything";
  EXPECT_LT(worst.position, 1e-9);
  EXPECT_LT(worst.velocity, 1e-6);
}

TEST(Simulation, MatchesPlainStepAtTheTip) {
  const Index3 points{12, 12, 12};
  auto setup = setup_of(points, 0.05, brittle(), TriaxialLoading{0, 1, 2.0, WallKind::sticky});
  double kappa = 0;
  const Comparison worst = compare(setup, block(points, 0.05), 150, &kappa);
  EXPECT_GT(kappa, 1e-6) << "the case must yield to say anything";
  EXPECT_LT(worst.position, 1e-9);
  EXPECT_LT(worst.kappa, 1e-6);
}

TEST(Simulation, MatchesPlainStepAtLargeStrainBeyondTheSeries) {
  const Index3 points{12, 20, 12};
  auto setup = setup_of(points, 0.05, elastic(1e6), ConfinedCompression{1, true, 3.0});
  Simulation engine(setup, block(points, 0.05));
  const Comparison worst = compare(setup, block(points, 0.05), 40);
  for (int n = 0; n < 40; ++n) engine.step(false);
  EXPECT_LT(engine.walls().strain()[1], -0.3);  // |dev h| = 0.4
  EXPECT_LT(worst.position, 1e-10);
  EXPECT_LT(worst.stress, 1e-10);
}

TEST(Simulation, MatchesPlainStepWhenJammed) {
  const Index3 points{12, 16, 12};
  auto setup = setup_of(points, 0.05, brittle(), ConfinedCompression{1, true, 60.0});
  setup.material.elasticity.young_modulus = 1e9;
  const auto positions = porous_block(points, 0.05, 0.7);
  Simulation engine(setup, positions);
  for (int n = 0; n < 38; ++n) engine.step(true);
  const Comparison worst = compare(setup, positions, 38);
  EXPECT_LT(engine.walls().strain()[1], -0.3);
  EXPECT_LT(engine.observed().tau[1], 0);
  EXPECT_LT(worst.position, 1e-8) << worst.position;
}

TEST(Simulation, MatchesPlainStepWithHundredsOfParticlesInACell) {
  const Index3 points{30, 28, 26};
  auto setup = setup_of(points, 0.02, brittle(), ConfinedCompression{1, true, 5.0});
  setup.cell_size = 0.13;  // 275 a cell: several chunks of the pass
  const Comparison worst = compare(setup, block(points, 0.02), 20);
  EXPECT_LT(worst.position, 1e-10);
  EXPECT_LT(worst.stress, 1e-9);
}

/// Confined modulus of a solid block read between slip walls that lie `offset` cells off the nodes.
double confined_modulus(double offset, WallRule rule) {
  const Index3 points{32, 32, 32};
  auto setup = setup_of(points, 1.0 / 32, elastic(), TriaxialLoading{-0.5, -0.5, 0.2, WallKind::slip});
  setup.loading = ConfinedCompression{1, true, 0.05, 2e-3};  // slow against the wave: transit 0.9 ms
  setup.numerics.grid_offset = {offset, offset, offset};
  setup.numerics.wall_rule = rule;
  setup.numerics.flip = 0.8;  // rest sooner
  Simulation simulation(setup, block(points, 1.0 / 32));
  while (simulation.time() < 5e-3) simulation.step(false);
  simulation.step(true);
  const double stress =
      simulation.setup().particle_volume * simulation.observed().tau[1] / simulation.walls().volume();
  return stress / std::log1p(simulation.walls().strain()[1]) * std::exp(simulation.walls().strain()[1]);
}

TEST(Walls, GhostRuleGivesTheConfinedModulusForEveryOffset) {
  const Material m = elastic();
  const double exact = m.elasticity.lambda() + 2 * m.elasticity.mu();
  for (const double offset : {0.0, 0.25, 0.5, 0.75}) {
    const double read = confined_modulus(offset, WallRule::ghost);
    std::printf("offset %.2f: confined modulus %+.3f %%\n", offset, 100 * (read / exact - 1));
    EXPECT_NEAR(read / exact, 1, 5e-3) << "offset " << offset;
  }
}

TEST(Walls, UniformStressIsInEquilibriumUpToTheWalls) {
  // Every particle of a solid block has the same strain: no layer of another stress at faces, edges and
  // corners.
  for (const WallKind kind : {WallKind::slip, WallKind::affine}) {
    const Index3 points{16, 16, 16};
    auto setup = setup_of(points, 1.0 / 16, elastic(), TriaxialLoading{0, -1, 0.05, kind, 2e-3});
    setup.numerics.flip = 0.8;
    Simulation simulation(setup, block(points, 1.0 / 16));
    while (simulation.walls().strain()[0] > -1e-3) simulation.step(false);
    simulation.step(true);
    EXPECT_LT(simulation.observed().q / std::abs(simulation.observed().tau[0]), 5e-4);
  }
}

/// Walls that pull take hold one cell inside: in a sample four or five cells thick one plane of nodes may be
/// left, which cannot mirror both.
TEST(Walls, GripThinSamplesAsThePlainStepDoes) {
  for (const int thickness : {8, 9, 10, 11})
    for (const double offset : {0.05, 0.3, 0.55}) {
      const Index3 points{12, 12, thickness};
      auto setup = setup_of(points, 0.05, elastic(), TriaxialLoading{0, 1, 2.0, WallKind::paper});
      setup.numerics.grid_offset = {offset, offset, offset};
      const Comparison worst = compare(setup, porous_block(points, 0.05, 0.9), 30);
      EXPECT_LT(worst.position, 1e-10) << thickness << " points, offset " << offset;
      EXPECT_LT(worst.velocity, 1e-10) << thickness << " points, offset " << offset;
    }
}

TEST(Walls, AbortWhenTheyCloseOnEachOther) {
  const Index3 points{8, 8, 8};
  Simulation simulation(setup_of(points, 0.05, elastic(1e9), ConfinedCompression{1, true, 30.0}),
                        porous_block(points, 0.05, 0.2));
  try {
    for (int n = 0; n < 1000; ++n) simulation.step(false);
    FAIL() << "walls passed through each other";
  } catch (const NumericalError& error) {
    EXPECT_NE(std::string(error.what()).find("walls along y"), std::string::npos) << error.what();
  }
}

TEST(Walls, PlainRuleReadsAnotherModulusWhenTheWallLiesElsewhereInItsCell) {
  EXPECT_GT(std::abs(confined_modulus(0.5, WallRule::paper) / confined_modulus(0.0, WallRule::paper) - 1),
            0.02);
}

}  // namespace
}  // namespace anticrack
