// Return mapping of the softening Drucker-Prager model on the lanes of a vector. Per-target include guard
// (Highway).
#if defined(ANTICRACK_DRUCKER_PRAGER_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef ANTICRACK_DRUCKER_PRAGER_INL_H
#undef ANTICRACK_DRUCKER_PRAGER_INL_H
#else
#define ANTICRACK_DRUCKER_PRAGER_INL_H
#endif

#include "kernels.h"
#include "material/hencky-inl.h"

HWY_BEFORE_NAMESPACE();
namespace anticrack {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

/// Where the return mapping leaves a lane.
template <class D, class V = hn::Vec<D>>
struct Returned {
  decltype(hn::Vec<D>() > hn::Vec<D>()) yielded;
  V trace;  ///< tr eps after
  V norm;   ///< |dev eps| after
  V kappa;  ///< after
};

/// C(kappa) = c exp(-xi kappa). c = 0 or xi kappa beyond the range of exp gives 0.
template <class D, class V = hn::Vec<D>>
HWY_INLINE V softened_cohesion(D d, const MaterialConstants& m, V kappa) {
  const V cohesion = hn::Set(d, m.cohesion), exponent = hn::Set(d, m.softening) * kappa;
  // Most particles are either sound or long since broken.
  const auto sound = exponent == hn::Zero(d), broken = exponent > hn::Set(d, 750.0);
  if (HWY_LIKELY(hn::AllTrue(d, hn::Or(sound, broken)))) return hn::IfThenElseZero(sound, cohesion);
  return cohesion * hn::Exp(d, hn::Neg(exponent));
}

/// Backward Euler: the trial state (trace e, norm S) goes back to its own, softened, yield surface along the
/// deviator.
///
/// With A = gamma / (sqrt6 mu): elastic if f = S + A (K e - C) <= 0 and K e <= C; apex if K e >= C(kappa +
/// S); else the one root x in (0, S] of B - x - A C e^{-xi x} = 0, B = S + A K e. The left side is concave
/// and not positive at min(S, B), right of the root, so Newton from there falls monotonically onto it.
template <class D, class V = hn::Vec<D>>
HWY_INLINE Returned<D> return_implicit(D d, const MaterialConstants& m, V trace, V norm, V kappa) {
  const V zero = hn::Zero(d), one = hn::Set(d, 1.0), A = hn::Set(d, m.friction_factor),
          xi = hn::Set(d, m.softening);
  const V pull = hn::Set(d, m.bulk_modulus) * trace;  // K e = -p
  const V C = softened_cohesion(d, m, kappa);
  const V B = hn::MulAdd(A, pull, norm);
  const auto yielded = hn::Or(norm + A * (pull - C) > zero, pull > C);
  Returned<D> out{yielded, trace, norm, kappa};
  if (HWY_LIKELY(hn::AllFalse(d, yielded))) return out;

  const V apex_kappa = kappa + norm;
  const V apex_C = softened_cohesion(d, m, apex_kappa);
  const auto apex = hn::And(yielded, pull >= apex_C);

  const V AC = A * C;
  V x = hn::Max(zero, hn::Min(norm, B));
  auto open = hn::And(hn::AndNot(apex, yielded), AC > zero);  // without cohesion x = B is the root
  for (int iteration = 0; iteration < 64 && !hn::AllFalse(d, open); ++iteration) {
    const V softening = AC * hn::Exp(d, hn::Neg(xi * x));
    const V residual = B - x - softening, slope = hn::MulSub(xi, softening, one);
    // Beyond the maximum of the concave residual the slope is negative; the step is then downwards, towards
    // the root.
    const V next = hn::Max(zero, x - residual / slope);
    const auto moves = hn::And(open, hn::And(slope < zero, next < x));
    x = hn::IfThenElse(moves, next, x);
    open = moves;
  }
  const V cone_kappa = kappa + x;
  const V cone_norm = hn::Max(zero, A * (softened_cohesion(d, m, cone_kappa) - pull));

  out.kappa = hn::IfThenElse(yielded, hn::IfThenElse(apex, apex_kappa, cone_kappa), kappa);
  out.norm = hn::IfThenElse(yielded, hn::IfThenElse(apex, zero, cone_norm), norm);
  out.trace = hn::IfThenElse(apex, apex_C / hn::Set(d, m.bulk_modulus), trace);
  return out;
}

/// Algorithm 2 in one pass, its misprint repaired: the middle branch keeps the pressure (eps = eps_tr - dpi*
/// n). It leaves a yield residual, since the last correction of kappa moves the surface once more.
template <class D, class V = hn::Vec<D>>
HWY_INLINE Returned<D> return_paper(D d, const MaterialConstants& m, V trace, V norm, V kappa) {
  const V zero = hn::Zero(d), A = hn::Set(d, m.friction_factor);
  const V pull = hn::Set(d, m.bulk_modulus) * trace;
  const V C = softened_cohesion(d, m, kappa);
  const V first = norm + A * (pull - C);  // delta pi
  const auto past_tip = pull >= C;
  const auto yielded = hn::Or(past_tip, first > zero);
  Returned<D> out{yielded, trace, norm, kappa};
  if (HWY_LIKELY(hn::AllFalse(d, yielded))) return out;

  const V first_C = softened_cohesion(d, m, kappa + first);
  const auto cone = hn::AndNot(past_tip, hn::And(yielded, pull < first_C));
  const auto tip = hn::AndNot(cone, yielded);
  const V second = norm + A * (pull - first_C);  // delta pi*
  const V tip_kappa = kappa + norm;
  out.kappa = hn::IfThenElse(cone, kappa + second, hn::IfThenElse(tip, tip_kappa, kappa));
  out.norm = hn::IfThenElse(cone, A * (first_C - pull), hn::IfThenElse(tip, zero, norm));
  // The inner tip branch takes the cohesion before the last correction of kappa, as printed.
  const V tip_C = hn::IfThenElse(past_tip, softened_cohesion(d, m, tip_kappa), first_C);
  out.trace = hn::IfThenElse(tip, tip_C / hn::Set(d, m.bulk_modulus), trace);
  return out;
}

template <Model model, class D, class V = hn::Vec<D>>
HWY_INLINE Returned<D> return_to_yield_surface(D d, const MaterialConstants& m, V trace, V norm, V kappa) {
  if constexpr (model == Model::drucker_prager_paper)
    return return_paper(d, m, trace, norm, kappa);
  else
    return return_implicit(d, m, trace, norm, kappa);
}

}  // namespace HWY_NAMESPACE
}  // namespace anticrack
HWY_AFTER_NAMESPACE();
#endif
