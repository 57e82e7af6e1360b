// Sums over particles while they lie in the lanes of vectors. Per-target include guard.
#if defined(ANTICRACK_LANE_SUMS_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef ANTICRACK_LANE_SUMS_INL_H
#undef ANTICRACK_LANE_SUMS_INL_H
#else
#define ANTICRACK_LANE_SUMS_INL_H
#endif

#include <hwy/highway.h>

#include <cmath>

#include "kernels.h"
#include "material/hencky-inl.h"

HWY_BEFORE_NAMESPACE();
namespace anticrack {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

/// psi = K/2 (tr eps)^2 + mu |dev eps|^2, Eq. 6.
template <class D, class V = hn::Vec<D>>
HWY_INLINE V energy_density(D d, const MaterialConstants& m, V trace, V norm) {
  return hn::MulAdd(hn::Set(d, 0.5 * m.bulk_modulus) * trace, trace, hn::Set(d, m.mu) * norm * norm);
}

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

/// What the time step and the energy balance ask of every step.
template <class D, class V = hn::Vec<D>>
HWY_INLINE void add_speed_and_compression(D d, const MaterialConstants& m, const V (&v)[3], V trace, V norm,
                                          LaneSums<V>& sums) {
  const V speed_squared = hn::MulAdd(v[0], v[0], hn::MulAdd(v[1], v[1], v[2] * v[2]));
  // p + 2/3 q, q = sqrt(3/2) |dev tau| = sqrt6 mu |dev eps|
  const V compression =
      hn::MulSub(hn::Set(d, 2.0 / 3.0 * std::sqrt(6.0) * m.mu), norm, hn::Set(d, m.bulk_modulus) * trace);
  sums.speed_squared = sums.speed_squared + speed_squared;
  sums.max_speed_squared = hn::Max(sums.max_speed_squared, speed_squared);
  sums.max_compression = hn::Max(sums.max_compression, compression);
}

/// The rest of APIC's kinetic energy: a particle's is 1/2 m (v.v + dx^2 C:C / 4), `affine` = dx C.
template <class D, class V = hn::Vec<D>>
HWY_INLINE void add_affine_speed(D d, const V (&affine)[9], LaneSums<V>& sums) {
  V squared = affine[0] * affine[0];
  for (int e = 1; e < 9; ++e) squared = hn::MulAdd(affine[e], affine[e], squared);
  sums.speed_squared = hn::MulAdd(hn::Set(d, 0.25), squared, sums.speed_squared);
}

/// What the observables need; zero in lanes that do not count.
template <class D, class V = hn::Vec<D>, class M = hn::Mask<D>>
HWY_INLINE void add_averages(D d, const MaterialConstants& m, const HenckyStrain<V>& strain, V J, M plastic,
                             LaneSums<V>& sums) {
  const V minus_p = hn::Set(d, m.bulk_modulus) * strain.trace, two_mu = hn::Set(d, 2 * m.mu);
  const Symmetric<V>& dev = strain.deviator;
  const V tau[6] = {hn::MulAdd(two_mu, dev.xx, minus_p),
                    hn::MulAdd(two_mu, dev.yy, minus_p),
                    hn::MulAdd(two_mu, dev.zz, minus_p),
                    two_mu * dev.xy,
                    two_mu * dev.xz,
                    two_mu * dev.yz};
  for (int e = 0; e < 6; ++e) sums.tau[e] = sums.tau[e] + tau[e];
  for (int e = 0; e < 6; ++e) sums.tau_J[e] = hn::MulAdd(tau[e], J, sums.tau_J[e]);
  sums.q = hn::MulAdd(hn::Set(d, std::sqrt(6.0) * m.mu), strain.norm, sums.q);
  sums.J = sums.J + J;
  sums.elastic_energy = sums.elastic_energy + energy_density(d, m, strain.trace, strain.norm);
  sums.plastic = sums.plastic + hn::IfThenElseZero(plastic, hn::Set(d, 1.0));
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
