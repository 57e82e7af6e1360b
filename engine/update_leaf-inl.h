// Grid update of one leaf. Per-target include guard.
#if defined(ANTICRACK_UPDATE_LEAF_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef ANTICRACK_UPDATE_LEAF_INL_H
#undef ANTICRACK_UPDATE_LEAF_INL_H
#else
#define ANTICRACK_UPDATE_LEAF_INL_H
#endif

#include <hwy/cache_control.h>

#include "kernels.h"
#include "transfer/grid_to_particles-inl.h"

HWY_BEFORE_NAMESPACE();
namespace anticrack {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

/// Adds the partial sums of a leaf (lines 2, 3), then v += dt f / m (line 5). Their order is fixed.
inline LeafUpdate update_leaf(double dt, const LeafView& leaf, const LeafView& next) {
  const HalfNodeVector d;
  using V = hn::Vec<HalfNodeVector>;
  constexpr int lanes = int(hn::MaxLanes(d)), parts = 4 / lanes;
  // m v^2 before and after, and the largest v^2: a component a lane; the fourth, the mass's, is left out
  // below.
  V before[parts], after[parts], fastest[parts];
  for (int p = 0; p < parts; ++p) before[p] = after[p] = fastest[p] = hn::Zero(d);
  std::uint64_t occupied = 0;
  for (int n = 0; n < block_cells; ++n) {
    for (const Node* partial : next.partials) hwy::Prefetch(partial + n);
    hwy::Prefetch(next.nodes + n);
    Node& node = leaf.nodes[n];
    double* const numbers = reinterpret_cast<double*>(&node);
    const auto sum_partials = [&](int from) HWY_ATTR {
      V sum = hn::Load(d, reinterpret_cast<const double*>(leaf.partials[0] + n) + from);
      for (std::size_t p = 1; p < leaf.partials.size(); ++p)
        sum = sum + hn::Load(d, reinterpret_cast<const double*>(leaf.partials[p] + n) + from);
      return sum;
    };
    double mass = leaf.partials[0][n].mass;
    for (std::size_t p = 1; p < leaf.partials.size(); ++p) mass += leaf.partials[p][n].mass;
    const V m = hn::Set(d, mass), inverse_mass = hn::Set(d, mass > 0 ? 1 / mass : 0);
    for (int p = 0; p < parts; ++p) {
      const V v_old = sum_partials(p * lanes) * inverse_mass;
      const V dv = hn::Set(d, dt) * (sum_partials(4 + p * lanes) * inverse_mass);
      const V v_new = v_old + dv;
      before[p] = hn::MulAdd(m * v_old, v_old, before[p]);
      after[p] = hn::MulAdd(m * v_new, v_new, after[p]);
      fastest[p] = hn::Max(fastest[p], v_new * v_new);
      hn::Store(v_new, d, numbers + p * lanes);
      hn::Store(dv, d, numbers + 4 + p * lanes);
    }
    node.mass = mass;
    occupied |= std::uint64_t(mass > 0) << n;
  }
  const auto of_components = [&](const V(&parts_of)[parts]) HWY_ATTR {
    alignas(32) double x[4];
    for (int p = 0; p < parts; ++p) hn::Store(parts_of[p], d, x + p * lanes);
    return x[0] + x[1] + x[2];
  };
  return {0.5 * of_components(before), 0.5 * of_components(after), of_components(fastest), occupied};
}

}  // namespace HWY_NAMESPACE
}  // namespace anticrack
HWY_AFTER_NAMESPACE();
#endif
