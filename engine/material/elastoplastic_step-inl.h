// A step of the elastic state, lines 7 and 10-11 of Algorithm 1. Per-target include guard.
#if defined(ANTICRACK_ELASTOPLASTIC_STEP_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef ANTICRACK_ELASTOPLASTIC_STEP_INL_H
#undef ANTICRACK_ELASTOPLASTIC_STEP_INL_H
#else
#define ANTICRACK_ELASTOPLASTIC_STEP_INL_H
#endif

#include "lane_sums-inl.h"
#include "material/drucker_prager_softening-inl.h"
#include "material/hencky-inl.h"

HWY_BEFORE_NAMESPACE();
namespace anticrack {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

/// Line 7 in b: b_tr = (I + L) b (I + L)^T, and with M = L b: h_tr = h + M + M^T + M L^T. With L = 0 it is h,
/// to the bit. `inverted` gets the lanes where det(I + L) is not positive.
template <class D, class V = hn::Vec<D>, class M = hn::Mask<D>>
HWY_INLINE Symmetric<V> elastic_trial(D d, const V (&L)[3][3], const Symmetric<V>& h, M& inverted) {
  const V one = hn::Set(d, 1.0);
  const V full[3][3] = {{h.xx, h.xy, h.xz}, {h.xy, h.yy, h.yz}, {h.xz, h.yz, h.zz}};
  V m[3][3];
  for (int a = 0; a < 3; ++a)
    for (int e = 0; e < 3; ++e)
      m[a][e] = hn::MulAdd(L[a][0], full[0][e],
                           hn::MulAdd(L[a][1], full[1][e], hn::MulAdd(L[a][2], full[2][e], L[a][e])));
  V trial[6];
  constexpr int row[6] = {0, 1, 2, 0, 0, 1}, column[6] = {0, 1, 2, 1, 2, 2};
  for (int e = 0; e < 6; ++e) {
    const int i = row[e], j = column[e];
    const V second = hn::MulAdd(m[i][0], L[j][0], hn::MulAdd(m[i][1], L[j][1], m[i][2] * L[j][2]));
    trial[e] = full[i][j] + (m[i][j] + m[j][i] + second);
  }
  const V det = (one + L[0][0]) * hn::MulSub(one + L[1][1], one + L[2][2], L[1][2] * L[2][1]) -
                L[0][1] * hn::MulSub(L[1][0], one + L[2][2], L[1][2] * L[2][0]) +
                L[0][2] * hn::MulSub(L[1][0], L[2][1], (one + L[1][1]) * L[2][0]);
  inverted = hn::Not(det > hn::Zero(d));
  return {trial[0], trial[1], trial[2], trial[3], trial[4], trial[5]};
}

/// Lines 10 and 11 after a return mapping: h and kappa of the lanes `yielded`; `strain` is that of the trial
/// state.
template <class D, class V = hn::Vec<D>, class M = hn::Mask<D>>
HWY_INLINE void apply_return(D d, const StepConstants& c, const V (&L)[3][3], M yielded, const Returned<D>& r,
                             const HenckyStrain<V>& strain, Symmetric<V>& h, V& kappa, LaneSums<V>& sums) {
  const V one = hn::Set(d, 1.0);
  kappa = hn::IfThenElse(yielded, r.kappa, kappa);
  const V scale = hn::IfThenElseZero(strain.norm > hn::Zero(d), r.norm / strain.norm);
  const Symmetric<V>& dev = strain.deviator;
  // Dissipation = 1/2 (tau^n + tau^{n+1}) : dt grad v - (psi^{n+1} - psi^n), the internal work of the
  // leapfrog that this scheme is, so that the energy balance telescopes: psi_tr - psi - 1/2 (tau_tr -
  // tau) : dt grad v.
  const V half = hn::Set(d, 0.5), bulk = hn::Set(d, c.material.bulk_modulus),
          two_mu = hn::Set(d, 2 * c.material.mu);
  const V volumetric = L[0][0] + L[1][1] + L[2][2];
  const V along = hn::MulAdd(dev.xx, L[0][0], hn::MulAdd(dev.yy, L[1][1], dev.zz * L[2][2])) +
                  hn::MulAdd(dev.xy, L[0][1] + L[1][0],
                             hn::MulAdd(dev.xz, L[0][2] + L[2][0], dev.yz * (L[1][2] + L[2][1])));
  const V drop = hn::MulAdd(bulk * (strain.trace - r.trace), volumetric, two_mu * (one - scale) * along);
  const V dissipated = energy_density(d, c.material, strain.trace, strain.norm) -
                       energy_density(d, c.material, r.trace, r.norm) - half * drop;
  sums.plastic_dissipation = sums.plastic_dissipation + hn::IfThenElseZero(yielded, dissipated);
  sums.yielded = sums.yielded + hn::IfThenElseZero(yielded, one);
  const Symmetric<V> returned = left_cauchy_green_minus_identity(
      d, r.trace,
      {scale * dev.xx, scale * dev.yy, scale * dev.zz, scale * dev.xy, scale * dev.xz, scale * dev.yz});
  h = {hn::IfThenElse(yielded, returned.xx, h.xx), hn::IfThenElse(yielded, returned.yy, h.yy),
       hn::IfThenElse(yielded, returned.zz, h.zz), hn::IfThenElse(yielded, returned.xy, h.xy),
       hn::IfThenElse(yielded, returned.xz, h.xz), hn::IfThenElse(yielded, returned.yz, h.yz)};
}

}  // namespace HWY_NAMESPACE
}  // namespace anticrack
HWY_AFTER_NAMESPACE();
#endif
