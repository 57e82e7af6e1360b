#include "sparse_grid.h"

#include <gtest/gtest.h>

#include <openvdb/openvdb.h>
#include <algorithm>
#include <set>

#include <filesystem>
#include <limits>

#include "errors.h"
#include "simulation.h"

namespace anticrack {
namespace {

Material elastic() {
  return {1e4, {10e9, 0.3}, std::nullopt};
}

TEST(SparseGrid, ActivatesTheLeavesThatABlockReaches) {
  SparseGrid grid;
  grid.set_blocks({{0, 0, 0}});
  EXPECT_EQ(grid.leaves().size(), 8u);  // 4 + 2 nodes an axis
  grid.set_blocks({{0, 0, 0}, {1, 0, 0}});
  EXPECT_EQ(grid.leaves().size(), 12u);
  EXPECT_EQ(grid.find_leaf({2, 1, 1}) == SparseGrid::none, false);
  EXPECT_EQ(grid.find_leaf({3, 0, 0}), SparseGrid::none);
}

TEST(SparseGrid, LinksLeavesWithNeighbours) {
  SparseGrid grid;
  grid.set_blocks({{-5, 2, 7}, {-4, 2, 7}});
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
  std::vector<Index3> origins;
  for (int n = 0; n < 150; ++n) origins.push_back({n % 5, n / 5 % 5, n / 25});
  SparseGrid grid;
  grid.set_blocks({origins.begin(), origins.end() - 10});
  for (const Index3& later : std::vector<Index3>(origins.end() - 10, origins.end()))
    grid.find_or_add_block(later);
  ASSERT_EQ(grid.groups().size(), 3u);
  std::set<Node*> all;
  for (std::uint32_t b = 0; b < 150; ++b) {
    const SparseGrid::Block& block = grid.blocks()[b];
    for (int o = 0; o < 8; ++o) {
      const SparseGrid::Leaf& leaf = grid.leaves()[block.leaf[o]];
      const Index3& at = block.origin;
      EXPECT_EQ(leaf.origin, (Index3{at[0] + (o >> 2), at[1] + (o >> 1 & 1), at[2] + (o & 1)}));
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
  grid.set_blocks({{0, 0, 0}, {100, 0, 0}});
  const std::size_t bytes = grid.bytes();
  EXPECT_EQ(grid.leaves().size(), 16u);
  grid.set_blocks({{100, 0, 0}});
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
