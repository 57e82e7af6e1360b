// Grid update of one leaf. Per-target include guard.
#if defined(ANTICRACK_UPDATE_LEAF_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef ANTICRACK_UPDATE_LEAF_INL_H
#undef ANTICRACK_UPDATE_LEAF_INL_H
#else
#define ANTICRACK_UPDATE_LEAF_INL_H
#endif

#include <array>
#include <cstring>

#include "transfer/grid_to_particles-inl.h"

HWY_BEFORE_NAMESPACE();
namespace anticrack {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

/// Sums the tiles over a leaf (lines 2, 3), then v += dt f / m (line 5). The order of the tiles is fixed.
inline std::array<double, 2> update_leaf(double dt, const std::array<const Tile*, 8>& tiles, Node* nodes) {
  const NodeVector d;
  constexpr int lanes = int(hn::MaxLanes(d));
  std::memset(static_cast<void*>(nodes), 0, block_cells * sizeof(Node));
  for (int o = 0; o < 8; ++o) {
    if (!tiles[o]) continue;
    // The tile of block (leaf - o) covers the nodes 4 o .. 5 of itself: all of the leaf's edge, or two nodes
    // of it.
    const int ox = o >> 2, oy = o >> 1 & 1, oz = o & 1;
    for (int x = 0; x < (ox ? 2 : 4); ++x)
      for (int y = 0; y < (oy ? 2 : 4); ++y) {
        const double* from = reinterpret_cast<const double*>(
            &(*tiles[o])[((x + 4 * ox) * tile_edge + y + 4 * oy) * tile_edge + 4 * oz]);
        double* to = reinterpret_cast<double*>(&nodes[leaf_index(x, y, 0)]);
        for (int n = 0; n < (oz ? 2 : 4) * 8; n += lanes)
          hn::Store(hn::Load(d, to + n) + hn::Load(d, from + n), d, to + n);
      }
  }
  double before = 0, after = 0;
  for (int n = 0; n < block_cells; ++n) {
    Node& node = nodes[n];
    if (node.mass <= 0) continue;
    const double inverse_mass = 1 / node.mass;
    double old_squared = 0, new_squared = 0;
    for (int a = 0; a < 3; ++a) {
      const double v_old = node.velocity[a] * inverse_mass;
      const double dv = dt * (node.increment[a] * inverse_mass);
      const double v_new = v_old + dv;
      old_squared += v_old * v_old;
      new_squared += v_new * v_new;
      node.velocity[a] = v_new;
      node.increment[a] = dv;
    }
    before += 0.5 * node.mass * old_squared;
    after += 0.5 * node.mass * new_squared;
  }
  return {before, after};
}

}  // namespace HWY_NAMESPACE
}  // namespace anticrack
HWY_AFTER_NAMESPACE();
#endif
