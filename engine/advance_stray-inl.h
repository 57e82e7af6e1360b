// Strays, one by one: the same lines as in advance_particles-inl.h. Per-target include guard.
#if defined(ANTICRACK_ADVANCE_STRAY_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef ANTICRACK_ADVANCE_STRAY_INL_H
#undef ANTICRACK_ADVANCE_STRAY_INL_H
#else
#define ANTICRACK_ADVANCE_STRAY_INL_H
#endif

#include "advance_particles-inl.h"

HWY_BEFORE_NAMESPACE();
namespace anticrack {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

/// A stray's numbers: the arrays from its index on, one lane.
template <bool with_affine>
struct OneParticle {
  using V = hn::Vec<OneLane>;
  V s[3], v[3], place[3], affine[9], kappa;
  Symmetric<V> h;

  OneParticle(const ParticlePointers& p, std::uint32_t particle, const Index3& shift)
      : kappa(hn::Zero(OneLane())) {
    const OneLane d;
    for (int a = 0; a < 3; ++a) s[a] = hn::LoadU(d, p.s[a] + particle);
    for (int a = 0; a < 3; ++a) v[a] = hn::LoadU(d, p.v[a] + particle);
    for (int a = 0; a < 3; ++a) place[a] = s[a] - hn::Set(d, double(shift[a]));
    if constexpr (with_affine)
      for (int e = 0; e < 9; ++e) affine[e] = hn::LoadU(d, p.affine[e] + particle);
    if (p.kappa) kappa = hn::LoadU(d, p.kappa + particle);
    h = load_symmetric(AllLanes<OneLane>{d}, p.h, particle);
  }
  void store(const ParticlePointers& p, std::uint32_t particle) const {
    const OneLane d;
    for (int a = 0; a < 3; ++a) hn::StoreU(s[a], d, p.s[a] + particle);
    for (int a = 0; a < 3; ++a) hn::StoreU(v[a], d, p.v[a] + particle);
    if constexpr (with_affine)
      for (int e = 0; e < 9; ++e) hn::StoreU(affine[e], d, p.affine[e] + particle);
    if (p.kappa) hn::StoreU(kappa, d, p.kappa + particle);
    store_symmetric(AllLanes<OneLane>{d}, h, p.h, particle);
  }
};

template <Model model, Transfer transfer>
void advance_one(const StepConstants& c, const ParticlePointers& p, std::uint32_t particle,
                 const Node nodes[27], const Index3& shift, BlockResult& result) {
  using V = hn::Vec<OneLane>;
  const OneLane d;
  OneParticle<transfer == Transfer::apic> one(p, particle, shift);
  Moved<V> moved[3];
  move_alone<transfer>(c, nodes, 9, 3, one.place, one.s, one.v, moved);
  V L[3][3];
  for (int a = 0; a < 3; ++a) {
    one.s[a] = moved[a].s;
    one.v[a] = moved[a].v;
    for (int e = 0; e < 3; ++e) L[a][e] = moved[a].L[e];
    if constexpr (transfer == Transfer::apic)
      for (int e = 0; e < 3; ++e) one.affine[3 * a + e] = moved[a].affine[e];
  }
  LaneSums<V> sums = zero_sums(d);
  hn::Mask<OneLane> inverted;
  one.h = elastic_trial(d, L, one.h, inverted);
  note_failure(d, inverted, particle, "det(I + dt grad v)", result);
  HenckyStrain<V> strain = hencky_strain(d, one.h);
  if constexpr (model != Model::hencky) {
    const Returned<OneLane> r =
        return_to_yield_surface<model>(d, c.material, strain.trace, strain.norm, one.kappa);
    if (!hn::AllFalse(d, r.yielded)) apply_return(d, c, L, r.yielded, r, strain, one.h, one.kappa, sums);
  }
  note_failure(d, not_finite(d, strain, one.v, one.kappa), particle, "velocity, elastic strain or kappa",
               result);
  one.store(p, particle);
  reduce(d, sums, false, result.sums);
}

template <bool with_affine>
void scatter_one(const StepConstants& c, const ParticlePointers& p, std::uint32_t particle,
                 const Index3& shift, Node nodes[27], bool observe, ParticleSums& out) {
  using V = hn::Vec<OneLane>;
  const OneLane d;
  const OneParticle<with_affine> one(p, particle, shift);
  LaneSums<V> sums = zero_sums(d);
  Contributions<1, with_affine> contributions;
  contribute<true>(d, c, one.place, one.v, one.affine, one.kappa, hn::FirstN(d, 1), hencky_strain(d, one.h),
                   0, contributions, observe, sums);
  add_to_cell(c.full_width, contributions, 0, 1, nodes, 9, 3);
  reduce(d, sums, observe, out);
}

}  // namespace HWY_NAMESPACE
}  // namespace anticrack
HWY_AFTER_NAMESPACE();
#endif
