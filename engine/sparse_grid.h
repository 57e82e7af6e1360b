#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <unordered_map>
#include <vector>

#include "large_memory.h"
#include "vec3.h"

namespace anticrack {

/// One grid node, a cache line. Before the grid update a node of a tile holds {momentum, mass, force}; after
/// it a node of a leaf holds {new velocity, mass, velocity increment}.
struct alignas(64) Node {
  double velocity[3];   ///< [m/s]; momentum [kg m/s] in a tile
  double mass;          ///< [kg]
  double increment[3];  ///< v^{n+1} - v^n [m/s]; force [N] in a tile
  double unused;        ///< fills the line
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

/// The background grid: nodes live in the leaves (4^3) of an OpenVDB tree that exist only where a particle's
/// stencil reaches.
///
/// A *block* is 4^3 dual cells with the particles stored there; it scatters into a *tile* of its own (6^3
/// nodes), so blocks run in parallel without atomics, and a leaf sums the at most 8 tiles that overlap it in
/// a fixed order. All coordinates are integer node or dual-cell coordinates divided by 4.
class SparseGrid {
 public:
  struct Block {
    Index3 origin;                      ///< block coordinate: lowest dual cell / 4
    std::array<std::uint32_t, 8> leaf;  ///< leaves that its tile overlaps, index 4 ox + 2 oy + oz
  };
  struct Leaf {
    Index3 origin;                           ///< leaf coordinate: lowest node / 4
    Node* nodes;                             ///< the tree's own buffer
    std::array<std::uint32_t, 8> block;      ///< blocks whose tile overlaps it (origin - o), or `none`
    std::array<std::uint32_t, 6> neighbour;  ///< leaf beyond face -x, +x, -y, +y, -z, +z, or `none`
  };
  static constexpr std::uint32_t none = ~std::uint32_t{0};

  SparseGrid();
  ~SparseGrid();
  SparseGrid(SparseGrid&&) noexcept;
  SparseGrid& operator=(SparseGrid&&) noexcept;

  /// Makes `origins` (distinct, in the order given) the blocks; activates the leaves they reach and releases
  /// all others.
  void set_blocks(const std::vector<Index3>& origins);

  /// The block at `origin`, activated with its leaves and an empty tile if it was not active. Not thread
  /// safe.
  std::uint32_t find_or_add_block(const Index3& origin);

  std::uint32_t find_block(const Index3& origin) const;  ///< or `none`
  std::uint32_t find_leaf(const Index3& origin) const;   ///< or `none`

  const std::vector<Block>& blocks() const { return blocks_; }
  const std::vector<Leaf>& leaves() const { return leaves_; }
  Tile& tile(std::uint32_t block) { return tiles_[block / slab_tiles].get()[block % slab_tiles]; }
  const Tile& tile(std::uint32_t block) const { return tiles_[block / slab_tiles].get()[block % slab_tiles]; }

  /// Bytes of leaves, tiles and tables.
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
  std::uint32_t add_block(const Index3& origin);
  void reserve_tiles(std::size_t blocks);
  std::uint32_t find_or_add_leaf(const Index3& origin);

  struct Tree;  // hides OpenVDB
  std::unique_ptr<Tree> tree_;
  std::vector<Block> blocks_;
  std::vector<Leaf> leaves_;
  static constexpr std::uint32_t slab_tiles = huge_page / sizeof(Tile);
  std::vector<std::unique_ptr<Tile, FreeLarge>> tiles_;  ///< slabs
  std::unordered_map<Index3, std::uint32_t, Key> block_at_, leaf_at_;
};

}  // namespace anticrack
