#include "sparse_grid.h"

#include <openvdb/openvdb.h>

#include <algorithm>
#include <cstring>

#include "errors.h"
#include "files/vdb_file.h"
#include "leaf_memory.h"

namespace anticrack {

// OpenVDB asks a value type for arithmetic and order that a node has no use for; only equality and zero
// matter here.
inline bool operator==(const Node& a, const Node& b) {
  return std::memcmp(&a, &b, sizeof(Node)) == 0;
}
inline bool operator!=(const Node& a, const Node& b) {
  return !(a == b);
}
inline bool operator<(const Node& a, const Node& b) {
  return a.mass < b.mass;
}
inline bool operator>(const Node& a, const Node& b) {
  return b < a;
}
inline Node operator+(const Node& a, const Node&) {
  return a;
}
inline Node operator-(const Node& a, const Node&) {
  return a;
}
inline Node operator-(const Node& a) {
  return a;
}
inline std::ostream& operator<<(std::ostream& out, const Node& a) {
  return out << a.mass;
}

}  // namespace anticrack

namespace openvdb {
OPENVDB_USE_VERSION_NAMESPACE
namespace OPENVDB_VERSION_NAME {
template <>
inline anticrack::Node zeroVal<anticrack::Node>() {
  return {};
}
namespace math {
template <>
inline bool isApproxEqual<anticrack::Node>(const anticrack::Node& a, const anticrack::Node& b,
                                           const anticrack::Node&) {
  return a == b;
}
}  // namespace math
}  // namespace OPENVDB_VERSION_NAME
}  // namespace openvdb

namespace anticrack {

using NodeTree = openvdb::tree::Tree<openvdb::tree::RootNode<
    openvdb::tree::InternalNode<openvdb::tree::InternalNode<openvdb::tree::LeafNode<Node, 2>, 3>, 4>>>;
using NodeLeaf = NodeTree::LeafNodeType;

static constexpr std::size_t leaf_bytes = NodeLeaf::SIZE * sizeof(Node);

static LeafMemory& leaf_memory() {
  static auto* const memory = new LeafMemory(leaf_bytes);  // outlives every grid
  return *memory;
}

void* Node::operator new[](std::size_t bytes, std::align_val_t) {
  if (bytes != leaf_bytes) throw std::bad_alloc();
  return leaf_memory().take();
}

void Node::operator delete[](void* nodes, std::align_val_t) noexcept {
  if (nodes) leaf_memory().give_back(nodes);
}

struct SparseGrid::Tree {
  NodeTree tree{Node{}};
};

static openvdb::Coord first_node(const Index3& origin) {
  return {origin[0] * block_edge, origin[1] * block_edge, origin[2] * block_edge};
}

SparseGrid::SparseGrid() : tree_(std::make_unique<Tree>()) {}
SparseGrid::~SparseGrid() = default;
SparseGrid::SparseGrid(SparseGrid&&) noexcept = default;
SparseGrid& SparseGrid::operator=(SparseGrid&&) noexcept = default;

void SparseGrid::set_reach(const std::vector<BlockReach>& reaches) {
  if (reaches == reach_) return;
  const std::vector<Leaf> old_leaves = std::move(leaves_);
  reach_.clear();
  blocks_.clear();
  groups_.clear();
  leaves_.clear();
  block_at_.clear();
  leaf_at_.clear();
  partials_ = 0;
  for (const BlockReach& reach : reaches)
    activate(reach, false);  // the next pass over particles clears the sums
  slabs_.resize((partials_ + slab_partials - 1) / slab_partials);
  for (const Leaf& leaf : old_leaves)
    if (find_leaf(leaf.origin) == none)
      delete tree_->tree.stealNode<NodeLeaf>(first_node(leaf.origin), Node{}, false);
}

std::uint32_t SparseGrid::activate(const BlockReach& reach) {
  const std::uint32_t found = find_block(reach.origin);
  return found != none && blocks_[found].reach.includes(reach.leaves) ? found : activate(reach, true);
}

std::uint32_t SparseGrid::activate(const BlockReach& reach, bool clear) {
  reach_.push_back(reach);
  const auto [entry, is_new] = block_at_.try_emplace(reach.origin, std::uint32_t(blocks_.size()));
  const std::uint32_t block = entry->second, group = block / group_blocks;
  if (is_new) {
    if (group == groups_.size()) groups_.push_back({block, block, {}});
    groups_[group].last_block = block + 1;
    blocks_.push_back({{reach.origin, 0}, {}, {}});
  }
  for (int o = 0; o < 8; ++o) {
    if (!((reach.leaves & ~blocks_[block].reach.leaves) >> o & 1)) continue;
    const Index3& at = reach.origin;
    const std::uint32_t leaf = find_or_add_leaf({at[0] + (o >> 2), at[1] + (o >> 1 & 1), at[2] + (o & 1)});
    blocks_[block].nodes[o] = leaves_[leaf].nodes;
    blocks_[block].partial[o] = find_or_add_partial(leaf, group, clear);
  }
  blocks_[block].reach.leaves |= reach.leaves;
  return block;
}

Node* SparseGrid::find_or_add_partial(std::uint32_t l, std::uint32_t group, bool clear) {
  Leaf& leaf = leaves_[l];
  for (std::uint32_t n = leaf.groups; n-- > 0;)
    if (leaf.group[n] == group) return leaf.partial[n];
  if (partials_ == slabs_.size() * slab_partials) {
    slabs_.push_back(allocate_array<Node>(slab_partials * block_cells));
  }
  Node* partial = slabs_[partials_ / slab_partials].get() + partials_ % slab_partials * block_cells;
  ++partials_;
  if (clear) std::memset(static_cast<void*>(partial), 0, block_cells * sizeof(Node));
  leaf.partial[leaf.groups] = partial;
  leaf.group[leaf.groups++] = group;
  groups_[group].partials.push_back(partial);
  return partial;
}

std::uint32_t SparseGrid::find_or_add_leaf(const Index3& origin) {
  const auto [entry, is_new] = leaf_at_.try_emplace(origin, std::uint32_t(leaves_.size()));
  const std::uint32_t leaf = entry->second;
  if (!is_new) return leaf;
  NodeLeaf* node = tree_->tree.touchLeaf(first_node(origin));
  node->setValuesOn();
  Leaf added{origin, node->buffer().data(), {}, {}, {}};
  for (int face = 0; face < 6; ++face) {
    Index3 beyond = origin;
    beyond[face / 2] += face % 2 ? 1 : -1;
    const std::uint32_t other = find_leaf(beyond);
    added.neighbour[face] = other;
    if (other != none) leaves_[other].neighbour[face ^ 1] = leaf;
  }
  leaves_.push_back(added);
  return leaf;
}

std::uint32_t SparseGrid::find_block(const Index3& origin) const {
  const auto entry = block_at_.find(origin);
  return entry == block_at_.end() ? none : entry->second;
}

std::uint32_t SparseGrid::find_leaf(const Index3& origin) const {
  const auto entry = leaf_at_.find(origin);
  return entry == leaf_at_.end() ? none : entry->second;
}

std::size_t SparseGrid::bytes() const {
  const std::size_t table_entry = sizeof(Index3) + 3 * sizeof(void*);
  return tree_->tree.memUsage() + slabs_.size() * slab_partials * block_cells * sizeof(Node) +
         blocks_.size() * (sizeof(Block) + table_entry) + leaves_.size() * (sizeof(Leaf) + table_entry);
}

void SparseGrid::write_vdb(const std::filesystem::path& file, double dx, const Vec3& offset) const {
  auto mass = openvdb::DoubleGrid::create();
  auto velocity = openvdb::Vec3DGrid::create();
  auto increment = openvdb::Vec3DGrid::create();
  mass->setName("mass");
  velocity->setName("velocity");
  velocity->setVectorType(openvdb::VEC_CONTRAVARIANT_RELATIVE);
  increment->setName("velocity_increment");
  auto transform = openvdb::math::Transform::createLinearTransform(dx);
  transform->postTranslate(openvdb::Vec3d(offset[0], offset[1], offset[2]) * dx);
  auto set_mass = mass->getAccessor();
  auto set_velocity = velocity->getAccessor();
  auto set_increment = increment->getAccessor();
  for (const Leaf& leaf : leaves_)
    for (int n = 0; n < block_cells; ++n) {
      const Node& node = leaf.nodes[n];
      if (node.mass <= 0) continue;
      const openvdb::Coord at = first_node(leaf.origin).offsetBy(n / 16, n / 4 % 4, n % 4);
      set_mass.setValue(at, node.mass);
      set_velocity.setValue(at, {node.velocity[0], node.velocity[1], node.velocity[2]});
      set_increment.setValue(at, {node.increment[0], node.increment[1], node.increment[2]});
    }
  openvdb::GridPtrVec grids{mass, velocity, increment};
  for (auto& grid : grids) grid->setTransform(transform->copy());
  anticrack::write_vdb(file, {grids.begin(), grids.end()});
}

}  // namespace anticrack
