#include <gtest/gtest.h>
#include <tbb/global_control.h>
#include <unistd.h>

#include <cstring>
#include <filesystem>
#include <random>

#include "errors.h"
#include "io/checkpoint.h"
#include "simulation.h"

namespace anticrack {
namespace {

/// A porous block that yields, has strays in every step and sorts now and then.
SimulationSetup crushed(std::vector<Vec3>& positions, TransferScheme transfer) {
  const double h = 0.05;
  std::mt19937 random(3);
  for (int i = 0; i < 24; ++i)
    for (int j = 0; j < 32; ++j)
      for (int k = 0; k < 20; ++k)
        if (random() % 10 < 5) positions.push_back(h * Vec3(i + 0.5, j + 0.5, k + 0.5));
  Numerics numerics;
  numerics.transfer = transfer;
  return {h * Vec3(24, 32, 20),
          h * h * h,
          2 * h,
          {1e4, {10e9, 0.3}, DruckerPragerSoftening{1.2, 2.5e6, 1e6}},
          ConfinedCompression{1, true, 60.0},
          numerics};
}

std::vector<double> state_of(const Simulation& s) {
  std::vector<double> all{s.time(),
                          s.dt(),
                          s.kinetic_energy(),
                          s.ledger().plastic_dissipation,
                          s.ledger().wall_work,
                          s.ledger().numerical_dissipation,
                          s.observed().tau[1],
                          double(s.grid().leaves().size())};
  const Particles& p = s.particles();
  for (std::size_t i = 0; i < p.count; ++i) {
    for (const auto& a : p.s) all.push_back(a[i]);
    for (const auto& a : p.v) all.push_back(a[i]);
    for (const auto& a : p.h) all.push_back(a[i]);
    all.push_back(p.kappa[i]);
    for (const auto& a : p.affine)
      if (a.size()) all.push_back(a[i]);
    all.push_back(p.id[i]);
  }
  return all;
}

bool same_bits(const std::vector<double>& a, const std::vector<double>& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(double)) == 0;
}

void expect_same_bits_for_any_threads(TransferScheme transfer) {
  std::vector<Vec3> positions;
  const SimulationSetup setup = crushed(positions, transfer);
  std::vector<double> first;
  for (const int threads : {1, 2, 5}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    Simulation simulation(setup, positions);
    std::size_t strays = 0;
    for (int n = 0; n < 200; ++n) {
      simulation.step(n % 10 == 9);
      strays += simulation.stray_count();
    }
    EXPECT_GT(strays, 0u);
    EXPECT_GT(simulation.ledger().plastic_dissipation, 0);
    if (first.empty()) first = state_of(simulation);
    EXPECT_TRUE(same_bits(first, state_of(simulation))) << threads << " threads";
  }
}

TEST(Simulation, IsBitwiseEqualForOneTwoAndFiveThreads) {
  expect_same_bits_for_any_threads(TransferScheme::pic_flip);
}

TEST(Simulation, IsBitwiseEqualForOneTwoAndFiveThreadsWithApic) {
  expect_same_bits_for_any_threads(TransferScheme::apic);
}

/// A file that no test beside this one has.
std::filesystem::path own_file(const std::string& name) {
  return std::filesystem::path(testing::TempDir()) /
         ("anticrack_" + std::string(testing::UnitTest::GetInstance()->current_test_info()->name()) + "_" +
          name + "_" + std::to_string(::getpid()));
}

void save_to(const std::filesystem::path& file, const Simulation& simulation) {
  CheckpointWriter writer("scene");
  simulation.save(writer);
  writer.write(file);
}

/// Goes on from each of the files to the state of `whole`, and removes them.
void expect_same_bits(const std::vector<std::filesystem::path>& files, const SimulationSetup& setup,
                      const Simulation& whole) {
  for (const auto& file : files) {
    CheckpointReader reader(file);
    Simulation resumed(setup, reader);
    while (resumed.steps() < whole.steps()) resumed.step(resumed.steps() + 1 == whole.steps());
    EXPECT_TRUE(same_bits(state_of(resumed), state_of(whole))) << file;
    std::filesystem::remove(file);
  }
}

void expect_same_bits_after_resuming(TransferScheme transfer) {
  std::vector<Vec3> positions;
  const SimulationSetup setup = crushed(positions, transfer);
  std::vector<std::filesystem::path> files;
  Simulation whole(setup, positions);
  for (int n = 0; n < 250; ++n) {
    whole.step(n == 249);
    if (n % 60 != 37) continue;  // several instants, so that strays that have just come home are among them
    files.push_back(own_file(std::to_string(n)));
    save_to(files.back(), whole);
  }
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, 1);
  expect_same_bits(files, setup, whole);
}

TEST(Simulation, ResumesWithTheSameBitsOnAnotherThreadCount) {
  expect_same_bits_after_resuming(TransferScheme::pic_flip);
}

TEST(Simulation, ResumesWithTheSameBitsOnAnotherThreadCountWithApic) {
  expect_same_bits_after_resuming(TransferScheme::apic);
}

TEST(Simulation, ResumesWithTheSameBitsWhereStraysHaveReachedMoreLeaves) {
  std::vector<Vec3> box, positions, velocities;
  SimulationSetup setup = crushed(box, TransferScheme::pic_flip);
  std::mt19937 random(5);
  std::uniform_real_distribution<double> uniform(0.1, 0.9);
  for (int n = 0; n < 300; ++n) {
    positions.push_back(10 * Vec3(uniform(random), 0.2 * uniform(random), 0.2 * uniform(random)));
    velocities.push_back(100 * Vec3(uniform(random), uniform(random), uniform(random)));
  }
  setup.box_size = Vec3(10, 10, 10);
  Simulation whole(setup, positions, velocities);
  std::vector<std::filesystem::path> files;
  for (int n = 0; n < 120; ++n) {
    whole.step(n == 119);
    if (n < 20 || files.size() == 5 || whole.grid().reach().size() < whole.grid().blocks().size() + 5)
      continue;
    files.push_back(own_file("reach" + std::to_string(n)));
    save_to(files.back(), whole);
  }
  ASSERT_EQ(files.size(), 5u);
  expect_same_bits(files, setup, whole);
}

TEST(Simulation, RefusesACheckpointWithoutTheAffineMotionThatApicNeeds) {
  std::vector<Vec3> positions;
  const SimulationSetup setup = crushed(positions, TransferScheme::pic_flip);
  const Simulation simulation(setup, positions);
  const auto file = own_file("without_affine");
  CheckpointWriter writer("scene");
  simulation.save(writer);
  writer.write(file);
  CheckpointReader reader(file);
  try {
    Simulation resumed(crushed(positions, TransferScheme::apic), reader);
    FAIL() << "resumed";
  } catch (const FileError& error) {
    EXPECT_NE(std::string(error.what()).find("\"particle.affine.xx\": missing"), std::string::npos)
        << error.what();
  }
  std::filesystem::remove(file);
}

}  // namespace
}  // namespace anticrack
