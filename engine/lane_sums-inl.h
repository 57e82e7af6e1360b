// Sums over particles while they lie in the lanes of vectors. Per-target include guard.
#if defined(ANTICRACK_LANE_SUMS_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef ANTICRACK_LANE_SUMS_INL_H
#undef ANTICRACK_LANE_SUMS_INL_H
#else
#define ANTICRACK_LANE_SUMS_INL_H
#endif

#include <hwy/highway.h>

#include "kernels.h"

HWY_BEFORE_NAMESPACE();
namespace anticrack {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

/// ParticleSums with a vector for each number.
template <class V>
struct LaneSums {
  V speed_squared, max_speed_squared, max_compression, plastic_dissipation, yielded;
  V tau[6], q, tau_J[6], J, elastic_energy, plastic;
};

template <class D, class V = hn::Vec<D>>
HWY_INLINE LaneSums<V> zero_sums(D d) {
  const V z = hn::Zero(d);
  return {z, z, z, z, z, {z, z, z, z, z, z}, z, {z, z, z, z, z, z}, z, z, z};
}

template <class D, class V = hn::Vec<D>>
HWY_INLINE double sum_lanes(D d, V v) {
  return hn::GetLane(hn::SumOfLanes(d, v));
}

template <class D, class V = hn::Vec<D>>
HWY_INLINE void reduce(D d, const LaneSums<V>& lanes, bool observe, ParticleSums& out) {
  ParticleSums sums;
  sums.speed_squared = sum_lanes(d, lanes.speed_squared);
  sums.max_speed_squared = hn::GetLane(hn::MaxOfLanes(d, lanes.max_speed_squared));
  sums.max_compression = hn::GetLane(hn::MaxOfLanes(d, lanes.max_compression));
  sums.plastic_dissipation = sum_lanes(d, lanes.plastic_dissipation);
  sums.yielded = sum_lanes(d, lanes.yielded);
  if (observe) {
    for (int e = 0; e < 6; ++e) sums.tau[e] = sum_lanes(d, lanes.tau[e]);
    for (int e = 0; e < 6; ++e) sums.tau_J[e] = sum_lanes(d, lanes.tau_J[e]);
    sums.q = sum_lanes(d, lanes.q);
    sums.J = sum_lanes(d, lanes.J);
    sums.elastic_energy = sum_lanes(d, lanes.elastic_energy);
    sums.plastic = sum_lanes(d, lanes.plastic);
  }
  out.add(sums);
}

}  // namespace HWY_NAMESPACE
}  // namespace anticrack
HWY_AFTER_NAMESPACE();
#endif
