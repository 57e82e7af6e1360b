#include "sparse_grid.h"

#include <gtest/gtest.h>

#include <openvdb/openvdb.h>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <random>
#include <set>

#include "activation.h"
#include "errors.h"
#include "simulation.h"

namespace anticrack {
namespace {

Material elastic() {
  return {1e4, {10e9, 0.3}, std::nullopt};
}

constexpr std::uint8_t all_leaves = 0xFF;  ///< of a block

/// Leaves with a node of a particle's stencil.
std::set<Index3> leaves_of_stencils(std::span<const Vec3> positions, double cell_size, const Vec3& offset) {
  std::set<Index3> leaves;
  for (const Vec3& x : positions) {
    Index3 base;
    for (int a = 0; a < 3; ++a) base[a] = int(std::floor(x[a] / cell_size - offset[a] - 0.5));
    for (int n = 0; n < 27; ++n)
      leaves.insert({(base[0] + n / 9) >> 2, (base[1] + n / 3 % 3) >> 2, (base[2] + n % 3) >> 2});
  }
  return leaves;
}

std::set<Index3> leaves_of(const SparseGrid& grid) {
  std::set<Index3> leaves;
  for (const SparseGrid::Leaf& leaf : grid.leaves()) leaves.insert(leaf.origin);
  return leaves;
}

TEST(SparseGrid, ActivatesTheLeavesThatABlockReaches) {
  SparseGrid grid;
  grid.set_reach({{{0, 0, 0}, all_leaves}});
  EXPECT_EQ(grid.leaves().size(), 8u);  // 4 + 2 nodes an axis
  grid.set_reach({{{0, 0, 0}, leaves_up_to(farthest_leaf(leaf_index(1, 2, 1)))}});
  EXPECT_EQ(leaves_of(grid), (std::set<Index3>{{0, 0, 0}, {0, 1, 0}}));
  EXPECT_EQ(grid.blocks()[0].nodes[4], nullptr);
  grid.set_reach({{{0, 0, 0}, all_leaves}, {{1, 0, 0}, all_leaves}});
  EXPECT_EQ(grid.leaves().size(), 12u);
  EXPECT_EQ(grid.find_leaf({2, 1, 1}) == SparseGrid::none, false);
  EXPECT_EQ(grid.find_leaf({3, 0, 0}), SparseGrid::none);
}

TEST(SparseGrid, HasTheLeavesOfTheStencilsAndNoOthers) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> uniform(0, 1);
  std::vector<Vec3> x, v;
  for (int n = 0; n < 40; ++n)
    x.push_back(Vec3(4 + 3 * uniform(random), 4 + uniform(random), 4 + uniform(random)));
  for (std::size_t n = 0; n < x.size(); ++n)
    v.push_back(100 * Vec3(uniform(random), uniform(random), uniform(random)));
  const double cell_size = 0.1;
  Simulation s({Vec3(100, 100, 100), 1e-3, cell_size, elastic(), ConfinedCompression{1, false, 1e-30}, {}}, x,
               v);
  const Vec3 offset(s.setup().numerics.grid_offset.data());
  EXPECT_EQ(leaves_of(s.grid()), leaves_of_stencils(x, cell_size, offset));
  const MemoryEstimate estimate = estimate_memory(x, cell_size, Vec3::Zero(), {false, false});
  EXPECT_EQ(estimate.leaves, s.grid().leaves().size());
  EXPECT_EQ(estimate.blocks, s.grid().blocks().size());

  int sorted = 0, more = 0;
  for (int n = 0; n < 300; ++n) {
    s.step(false);
    const auto there = leaves_of(s.grid()), reached = leaves_of_stencils(s.positions(), cell_size, offset);
    ASSERT_TRUE(std::ranges::includes(there, reached)) << n;
    if (s.stray_count() == 0) {
      EXPECT_EQ(there, reached) << n;
    }
    sorted += s.stray_count() == 0;
    more += there != reached;
  }
  EXPECT_GT(sorted, 10);
  EXPECT_GT(more, 10) << "steps in which strays hold on to what they have left";
}

TEST(SparseGrid, ReachesTheSameInTheSameOrderAgain) {
  const std::vector<BlockReach> some{
      {{0, 0, 0}, 1}, {{1, 0, 0}, 3}, {{0, 0, 0}, 0x11}, {{0, 2, 0}, all_leaves}};
  SparseGrid grid, again;
  grid.set_reach({some[0], some[1]});
  EXPECT_EQ(grid.activate(some[2]), 0u);
  EXPECT_EQ(grid.activate(some[3]), 2u);
  EXPECT_EQ(grid.activate(some[2]), 0u);
  EXPECT_EQ(grid.reach(), some);
  again.set_reach(grid.reach());
  ASSERT_EQ(grid.leaves().size(), 3 + 8u);  // 0 and 1 along x, one beyond 1 along z
  for (std::size_t l = 0; l < grid.leaves().size(); ++l) {
    EXPECT_EQ(grid.leaves()[l].origin, again.leaves()[l].origin);
    EXPECT_EQ(grid.leaves()[l].groups, again.leaves()[l].groups);
  }
  EXPECT_EQ(grid.blocks()[0].nodes[4], grid.blocks()[1].nodes[0]);
  EXPECT_EQ(grid.blocks()[0].partial[4], grid.blocks()[1].partial[0]);
}

TEST(SparseGrid, LinksLeavesWithNeighbours) {
  SparseGrid grid;
  grid.set_reach({{{-5, 2, 7}, all_leaves}, {{-4, 2, 7}, all_leaves}});
  for (const SparseGrid::Leaf& leaf : grid.leaves()) {
    for (int face = 0; face < 6; ++face)
      if (leaf.neighbour[face] != SparseGrid::none) {
        Index3 beyond = leaf.origin;
        beyond[face / 2] += face % 2 ? 1 : -1;
        EXPECT_EQ(grid.leaves()[leaf.neighbour[face]].origin, beyond);
      }
  }
}

TEST(SparseGrid, EveryBlockOfAGroupAddsToTheGroupsSumsOverItsLeaves) {
  std::vector<BlockReach> reach;
  for (int n = 0; n < 150; ++n) reach.push_back({{n % 5, n / 5 % 5, n / 25}, all_leaves});
  SparseGrid grid;
  grid.set_reach({reach.begin(), reach.end() - 10});
  for (int n = 140; n < 150; ++n) grid.activate(reach[n]);
  ASSERT_EQ(grid.groups().size(), 3u);
  std::set<Node*> all;
  for (std::uint32_t b = 0; b < 150; ++b) {
    const SparseGrid::Block& block = grid.blocks()[b];
    for (int o = 0; o < 8; ++o) {
      const Index3& at = block.reach.origin;
      const SparseGrid::Leaf& leaf =
          grid.leaves()[grid.find_leaf({at[0] + (o >> 2), at[1] + (o >> 1 & 1), at[2] + (o & 1)})];
      EXPECT_EQ(block.nodes[o], leaf.nodes);
      const auto partials = leaf.partials();
      const auto found = std::find(partials.begin(), partials.end(), block.partial[o]);
      ASSERT_NE(found, partials.end());
      EXPECT_EQ(leaf.group[found - partials.begin()], b / group_blocks);
      all.insert(block.partial[o]);
    }
  }
  std::size_t of_groups = 0, of_leaves = 0;
  for (const SparseGrid::Group& group : grid.groups()) of_groups += group.partials.size();
  for (const SparseGrid::Leaf& leaf : grid.leaves()) of_leaves += leaf.partials().size();
  EXPECT_EQ(of_groups, all.size());  // one for each leaf and group, none shared
  EXPECT_EQ(of_leaves, all.size());
}

TEST(SparseGrid, ReleasesLeavesThatNoParticleReaches) {
  SparseGrid grid;
  grid.set_reach({{{0, 0, 0}, all_leaves}, {{100, 0, 0}, all_leaves}});
  const std::size_t bytes = grid.bytes();
  EXPECT_EQ(grid.leaves().size(), 16u);
  grid.set_reach({{{100, 0, 0}, all_leaves}});
  EXPECT_EQ(grid.leaves().size(), 8u);
  EXPECT_LT(grid.bytes(), bytes - 8 * block_cells * sizeof(Node) + 1);
}

TEST(SparseGrid, FollowsABodyThroughSpace) {
  // A small body crosses many leaves; what it has left is released at the next sort.
  std::vector<Vec3> x, v;
  for (int i = 0; i < 512; ++i) x.push_back(0.1 * Vec3(i % 8 + 20.5, i / 8 % 8 + 20.5, i / 64 + 20.5));
  v.assign(x.size(), Vec3(60, 40, 20));
  Simulation s({Vec3(100, 100, 100), 1e-3, 0.2, elastic(), ConfinedCompression{1, false, 1e-30}, {}}, x, v);
  std::size_t most = 0;
  for (int n = 0; n < 600; ++n) {
    s.step(false);
    most = std::max(most, s.grid().leaves().size());
  }
  EXPECT_GT(s.time() * 60, 3 * 0.2 * block_edge) << "three leaves along x";
  EXPECT_LE(most, 64u);  // 4 cells and the stencil reach at most 3 leaves an axis; strays one more
}

TEST(SparseGrid, IsSavedAsOrdinaryVdbGrids) {
  std::vector<Vec3> x;
  for (int i = 0; i < 512; ++i) x.push_back(0.1 * Vec3(i % 8 + 0.5, i / 8 % 8 + 0.5, i / 64 + 0.5));
  Simulation s({Vec3(0.8, 0.8, 0.8), 1e-3, 0.2, elastic(), ConfinedCompression{1, true, 1.0}, {}}, x);
  for (int n = 0; n < 5; ++n) s.step(false);
  const auto file = std::filesystem::path(testing::TempDir()) / "anticrack_grid.vdb";
  s.grid().write_vdb(file, 0.2, Vec3::Zero());
  openvdb::initialize();
  openvdb::io::File in(file.string());
  in.open();
  const auto mass = openvdb::gridPtrCast<openvdb::DoubleGrid>(in.readGrid("mass"));
  const auto velocity = openvdb::gridPtrCast<openvdb::Vec3DGrid>(in.readGrid("velocity"));
  double total = 0;
  for (auto value = mass->cbeginValueOn(); value; ++value) total += *value;
  EXPECT_NEAR(total, 512 * s.particle_mass(), 1e-12 * total);
  EXPECT_EQ(mass->activeVoxelCount(), velocity->activeVoxelCount());
  EXPECT_EQ(mass->voxelSize()[0], 0.2);
  std::filesystem::remove(file);
}

TEST(Simulation, AbortsOnAStateThatIsNotANumberAndNamesItsParticle) {
  std::vector<Vec3> x;
  for (int i = 0; i < 64; ++i) x.push_back(0.1 * Vec3(i % 4 + 2.5, i / 4 % 4 + 2.5, i / 16 + 2.5));
  std::vector<Vec3> v(x.size(), Vec3::Zero());
  v[17][1] = std::numeric_limits<double>::quiet_NaN();
  try {
    Simulation({Vec3(0.8, 0.8, 0.8), 1e-3, 0.1, elastic(), ConfinedCompression{1, true, 1.0}, {}}, x, v);
    FAIL();
  } catch (const NumericalError& error) {
    const std::string message = error.what();
    EXPECT_NE(message.find("t = 0 s: velocity"), std::string::npos) << message;
    EXPECT_NE(message.find("of particle 17 "), std::string::npos) << message;
  }
}

}  // namespace
}  // namespace anticrack
