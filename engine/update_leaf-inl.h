// Grid update of one leaf. Per-target include guard.
#if defined(ANTICRACK_UPDATE_LEAF_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef ANTICRACK_UPDATE_LEAF_INL_H
#undef ANTICRACK_UPDATE_LEAF_INL_H
#else
#define ANTICRACK_UPDATE_LEAF_INL_H
#endif

#include <hwy/cache_control.h>

#include <algorithm>

#include "kernels.h"
#include "transfer/grid_to_particles-inl.h"

HWY_BEFORE_NAMESPACE();
namespace anticrack {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

/// Adds the partial sums of a leaf (lines 2, 3), then v += dt f / m (line 5). Their order is fixed.
inline LeafUpdate update_leaf(double dt, const LeafView& leaf, const LeafView& next) {
  const NodeVector d;
  constexpr int lanes = int(hn::MaxLanes(d)), numbers = block_cells * 8;
  double* to = reinterpret_cast<double*>(leaf.nodes);
  for (int n = 0; n < numbers; n += lanes) {
    auto sum = hn::Load(d, reinterpret_cast<const double*>(leaf.partials[0]) + n);
    for (std::size_t p = 1; p < leaf.partials.size(); ++p)
      sum = sum + hn::Load(d, reinterpret_cast<const double*>(leaf.partials[p]) + n);
    hn::Store(sum, d, to + n);
  }
  LeafUpdate result;
  for (int n = 0; n < block_cells; ++n) {
    for (const Node* partial : next.partials) hwy::Prefetch(partial + n);
    hwy::Prefetch(next.nodes + n);
    Node& node = leaf.nodes[n];
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
    result.kinetic_before += 0.5 * node.mass * old_squared;
    result.kinetic_after += 0.5 * node.mass * new_squared;
    result.max_speed_squared = std::max(result.max_speed_squared, new_squared);
  }
  return result;
}

}  // namespace HWY_NAMESPACE
}  // namespace anticrack
HWY_AFTER_NAMESPACE();
#endif
