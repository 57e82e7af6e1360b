#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <new>
#include <span>
#include <unordered_map>
#include <vector>

#include "huge_pages.h"
#include "vec3.h"

namespace anticrack {

/// One grid node, a cache line. Before the grid update a node of a tile or of a partial sum holds {momentum,
/// mass, force}; after it a node of a leaf holds {new velocity, mass, velocity increment}.
struct alignas(64) Node {
  double velocity[3];   ///< [m/s]; momentum [kg m/s] in a sum
  double mass;          ///< [kg]
  double increment[3];  ///< v^{n+1} - v^n [m/s]; force [N] in a sum
  double unused;        ///< fills the line

  // Arrays of nodes are the buffers of leaves; they lie in a `LeafMemory`.
  static void* operator new[](std::size_t bytes, std::align_val_t);
  static void operator delete[](void* nodes, std::align_val_t) noexcept;
};

constexpr int block_edge = 4;  ///< dual cells along a block, nodes along a leaf
constexpr int block_cells = block_edge * block_edge * block_edge;  ///< also the nodes of a leaf
constexpr int tile_edge = block_edge + 2;                          ///< nodes that a block's particles reach
constexpr int tile_nodes = tile_edge * tile_edge * tile_edge;

using Tile = std::array<Node, tile_nodes>;  ///< index (x * tile_edge + y) * tile_edge + z

/// Linear index of node or cell (x, y, z) of a leaf or block, each in 0..3; OpenVDB's order.
constexpr int leaf_index(int x, int y, int z) {
  return (x * block_edge + y) * block_edge + z;
}

/// The farthest of the eight leaves of a block that a particle in `cell` reaches, 4 ox + 2 oy + oz: from the
/// third cell along an axis on its stencil extends beyond the first.
constexpr int farthest_leaf(int cell) {
  return (cell >> 5 & 1) << 2 | (cell >> 3 & 1) << 1 | (cell >> 1 & 1);
}

/// That leaf and those on the way to it, bit 4 ox + 2 oy + oz.
constexpr std::uint8_t leaves_up_to(int farthest) {
  std::uint8_t leaves = 0;
  for (int o = 0; o < 8; ++o) leaves |= std::uint8_t((o & ~farthest) == 0) << o;
  return leaves;
}

/// A block coordinate, lowest dual cell / 4, and those of the eight leaves there that its particles reach.
struct BlockReach {
  Index3 origin;
  std::uint8_t leaves;  ///< bit 4 ox + 2 oy + oz
  bool operator==(const BlockReach&) const = default;
  bool includes(std::uint8_t others) const { return (others & ~leaves) == 0; }
};

constexpr std::uint32_t group_blocks = 64;  ///< blocks that add to the same partial sums, one after the other

/// The background grid: nodes live in the leaves (4^3) of an OpenVDB tree that exist only where a particle's
/// stencil reaches.
///
/// A *block* is 4^3 dual cells with the particles stored there. `group_blocks` blocks that follow each other
/// are a *group*: it has partial sums of its own over the leaves that it reaches, so groups run in parallel
/// without atomics, and a leaf adds its at most 8 partial sums in a fixed order. All coordinates are integer
/// node or dual-cell coordinates divided by 4.
class SparseGrid {
 public:
  struct Block {
    BlockReach reach;
    // Index 4 ox + 2 oy + oz; null where the particles do not reach.
    std::array<Node*, 8> nodes;    ///< of leaves
    std::array<Node*, 8> partial;  ///< the group's sums over them
  };
  struct Leaf {
    Index3 origin;                           ///< leaf coordinate: lowest node / 4
    Node* nodes;                             ///< the tree's own buffer
    std::array<std::uint32_t, 6> neighbour;  ///< leaf beyond face -x, +x, -y, +y, -z, +z, or `none`
    std::array<Node*, 8> partial;            ///< sums of the groups that reach it, in order of first reach
    std::array<std::uint32_t, 8> group;
    std::uint32_t groups = 0;    ///< how many
    std::uint64_t occupied = 0;  ///< nodes with mass after the grid update, bit leaf_index

    std::span<Node* const> partials() const { return {partial.data(), groups}; }
  };
  struct Group {
    std::uint32_t first_block, last_block;  ///< [first, last)
    std::vector<Node*> partials;            ///< of all leaves that it reaches
  };
  static constexpr std::uint32_t none = ~std::uint32_t{0};

  SparseGrid();
  ~SparseGrid();
  SparseGrid(SparseGrid&&) noexcept;
  SparseGrid& operator=(SparseGrid&&) noexcept;

  /// Activates what `reaches` names, in that order, and releases all else. A block may come more than once,
  /// to reach more.
  void set_reach(const std::vector<BlockReach>& reaches);

  /// What is active, in the order in which it was activated: set_reach of it leads to the same order of
  /// blocks, leaves and sums.
  const std::vector<BlockReach>& reach() const { return reach_; }

  /// The block, activated with empty sums as far as it was not active. Not thread safe.
  std::uint32_t activate(const BlockReach& reach);

  void set_occupied(std::size_t leaf, std::uint64_t nodes) { leaves_[leaf].occupied = nodes; }

  std::uint32_t find_block(const Index3& origin) const;  ///< or `none`
  std::uint32_t find_leaf(const Index3& origin) const;   ///< or `none`

  const std::vector<Block>& blocks() const { return blocks_; }
  const std::vector<Leaf>& leaves() const { return leaves_; }
  const std::vector<Group>& groups() const { return groups_; }

  /// Bytes of leaves, partial sums and tables.
  std::size_t bytes() const;

  /// Saves the nodal values as ordinary VDB grids `mass`, `velocity` and `velocity_increment`, active where
  /// mass > 0, voxel size `dx`, node lattice shifted by `offset` cells. @throws FileError
  void write_vdb(const std::filesystem::path& file, double dx, const Vec3& offset) const;

 private:
  struct Key {
    std::size_t operator()(const Index3& c) const {
      std::uint64_t x = std::uint32_t(c[0]) * 0x9E3779B97F4A7C15ull;
      x = (x ^ (x >> 29) ^ std::uint32_t(c[1])) * 0xBF58476D1CE4E5B9ull;
      x = (x ^ (x >> 32) ^ std::uint32_t(c[2])) * 0x94D049BB133111EBull;
      return x ^ (x >> 31);
    }
  };
  std::uint32_t activate(const BlockReach& reach, bool clear);
  Node* find_or_add_partial(std::uint32_t leaf, std::uint32_t group, bool clear);
  std::uint32_t find_or_add_leaf(const Index3& origin);

  struct Tree;  // hides OpenVDB
  std::unique_ptr<Tree> tree_;
  std::vector<BlockReach> reach_;
  std::vector<Block> blocks_;
  std::vector<Leaf> leaves_;
  std::vector<Group> groups_;
  static constexpr std::size_t slab_partials = 512;  // fill a page of 2 MiB
  std::vector<PageArray<Node>> slabs_;               ///< memory of the partial sums
  std::size_t partials_ = 0;                         ///< in use
  std::unordered_map<Index3, std::uint32_t, Key> block_at_, leaf_at_;
};

}  // namespace anticrack
