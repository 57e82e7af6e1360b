#include "kernels.h"

#include <algorithm>
#include <cmath>
#include <type_traits>

// AVX-512, AVX2, and a plain path for any other CPU; what lies between would only lengthen the build.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)  // minutes for each
#define HWY_DISABLED_TARGETS (HWY_SSSE3 | HWY_SSE4 | HWY_AVX3_DL | HWY_AVX3)
#else
#define HWY_DISABLED_TARGETS (HWY_SSSE3 | HWY_SSE4 | HWY_AVX3_DL)
#endif
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kernels.cpp"
#include <hwy/foreach_target.h>
// Highway asks for this order.
#include <hwy/highway.h>

#include "advance_particles-inl.h"
#include "advance_stray-inl.h"
#include "errors.h"
#include "update_leaf-inl.h"

HWY_BEFORE_NAMESPACE();
namespace anticrack {
namespace HWY_NAMESPACE {

/// The compiled combinations of per-particle code.
#define ANTICRACK_PASSES(use)                                                                              \
  use(hencky, flip) use(hencky, pic) use(hencky, apic) use(drucker_prager_implicit, flip)                  \
      use(drucker_prager_implicit, pic) use(drucker_prager_implicit, apic) use(drucker_prager_paper, flip) \
          use(drucker_prager_paper, pic) use(drucker_prager_paper, apic)

/// Calls visit(model, transfer) with the constants of `kind`.
template <class Visit>
void with_constants(PassKind kind, Visit visit) {
#define USE(model_name, transfer_name)                                             \
  if (kind.model == Model::model_name && kind.transfer == Transfer::transfer_name) \
    return visit(std::integral_constant<Model, Model::model_name>(),               \
                 std::integral_constant<Transfer, Transfer::transfer_name>());
  ANTICRACK_PASSES(USE)
#undef USE
}

void advance_block(PassKind kind, const StepConstants& c, const ParticlePointers& p, const BlockView& block,
                   const BlockView& next, bool observe, BlockResult& result) {
  with_constants(kind, [&](auto model, auto transfer) HWY_ATTR {
    pass_over_block<model, transfer, true>(c, p, block, next, observe, result);
  });
}

void scatter_block(PassKind kind, const StepConstants& c, const ParticlePointers& p, const BlockView& block,
                   const BlockView& next, bool observe, BlockResult& result) {
  with_constants(kind, [&](auto model, auto transfer) HWY_ATTR {
    constexpr Transfer scattered = transfer == Transfer::apic ? Transfer::apic : Transfer::pic;
    pass_over_block<model, scattered, false>(c, p, block, next, observe, result);
  });
}

void advance_strays(PassKind kind, const StepConstants& c, const ParticlePointers& p, const SparseGrid& grid,
                    std::span<const Stray> strays, BlockResult& result) {
  with_constants(kind, [&](auto model, auto transfer)
                           HWY_ATTR { advance_chunks<model, transfer>(c, p, grid, strays, result); });
}

void scatter_strays(PassKind kind, const StepConstants& c, const ParticlePointers& p, const SparseGrid& grid,
                    std::span<const Stray> strays, bool observe, ParticleSums& sums) {
  if (kind.transfer == Transfer::apic)
    scatter_chunks<true>(c, p, grid, strays, observe, sums);
  else
    scatter_chunks<false>(c, p, grid, strays, observe, sums);
}

/// Calls change(tensors in the lanes of a vector) for all, in as few vectors as a pass.
template <class Change>
HWY_INLINE void for_each_tensor(std::span<const std::array<double, 6>> from,
                                std::span<std::array<double, 6>> to, Change change) {
  const ParticleVector d;
  alignas(64) double lanes[6][8] = {};
  for (std::size_t i = 0, count; i < from.size(); i += count) {
    count = std::min(from.size() - i, hn::MaxLanes(d));
    for (int e = 0; e < 6; ++e)
      for (std::size_t n = 0; n < count; ++n) lanes[e][n] = from[i + n][e];
    const Symmetric<hn::Vec<ParticleVector>> changed =
        change(load_symmetric(AllLanes<ParticleVector>{d}, lanes, 0));
    store_symmetric(AllLanes<ParticleVector>{d}, changed, lanes, 0);
    for (int e = 0; e < 6; ++e)
      for (std::size_t n = 0; n < count; ++n) to[i + n][e] = lanes[e][n];
  }
}

void hencky(std::span<const std::array<double, 6>> h, std::span<std::array<double, 6>> strain) {
  const ParticleVector d;
  using V = hn::Vec<ParticleVector>;
  for_each_tensor(h, strain, [&](const Symmetric<V>& of_lane) HWY_ATTR {
    const HenckyStrain<V> eps = hencky_strain(d, of_lane);
    const V mean = eps.trace / hn::Set(d, 3.0);
    const Symmetric<V>& dev = eps.deviator;
    return Symmetric<V>{mean + dev.xx, mean + dev.yy, mean + dev.zz, dev.xy, dev.xz, dev.yz};
  });
}

void inverse_hencky(std::span<const std::array<double, 6>> strain, std::span<std::array<double, 6>> h) {
  const ParticleVector d;
  using V = hn::Vec<ParticleVector>;
  for_each_tensor(strain, h, [&](const Symmetric<V>& e) HWY_ATTR {
    const V sum = trace(e), mean = sum / hn::Set(d, 3.0);
    return left_cauchy_green_minus_identity(d, sum,
                                            {e.xx - mean, e.yy - mean, e.zz - mean, e.xy, e.xz, e.yz});
  });
}

void return_mapping(Model model, const MaterialConstants& m, std::span<std::array<double, 3>> state,
                    std::span<bool> yielded) {
  const OneLane d;
  for (std::size_t i = 0; i < state.size(); ++i) {
    auto& [trace, norm, kappa] = state[i];
    const auto e = hn::Set(d, trace), S = hn::Set(d, norm), k = hn::Set(d, kappa);
    if (model == Model::hencky) continue;
    const auto r =
        model == Model::drucker_prager_paper ? return_paper(d, m, e, S, k) : return_implicit(d, m, e, S, k);
    trace = hn::GetLane(r.trace);
    norm = hn::GetLane(r.norm);
    kappa = hn::GetLane(r.kappa);
    if (!yielded.empty()) yielded[i] = !hn::AllFalse(d, r.yielded);
  }
}

Kernels make_kernels() {
  return {hwy::TargetName(HWY_TARGET),
          hn::MaxLanes(NodeVector()) == 8,
          advance_block,
          scatter_block,
          advance_strays,
          scatter_strays,
          update_leaf,
          hencky,
          inverse_hencky,
          return_mapping};
}

}  // namespace HWY_NAMESPACE
}  // namespace anticrack
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace anticrack {

HWY_EXPORT(make_kernels);

/// Whether AVX-512 is computed in halves of 256 bits: Zen 4.
static bool computes_in_halves() {
#if HWY_ARCH_X86
  return __builtin_cpu_is("amdfam19h");
#else
  return false;
#endif
}

struct InstructionSet {
  std::string name;
  std::int64_t target;
  bool in_halves;
};

/// Those that this CPU has, best first. AVX-512 counts as two: as it is, and for a CPU that computes it in
/// halves.
static std::vector<InstructionSet> instruction_sets() {
  std::vector<InstructionSet> sets;
  for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
    const std::string name = hwy::TargetName(target);
    if (target != HWY_AVX3) {
      sets.push_back({name, target, false});
      continue;
    }
    const InstructionSet full{name, target, false}, halves{name + "_HALVES", target, true};
    sets.push_back(computes_in_halves() ? halves : full);
    sets.push_back(computes_in_halves() ? full : halves);
  }
  return sets;
}

/// The kernels of `set`, whose target is Highway's choice.
static Kernels kernels_of(const InstructionSet& set) {
  Kernels made = HWY_DYNAMIC_DISPATCH(make_kernels)();
  made.simd = set.name;
  made.full_width &= !set.in_halves;
  return made;
}

static Kernels& chosen_kernels() {
  static Kernels chosen = kernels_of(instruction_sets().front());
  return chosen;
}

const Kernels& kernels() {
  return chosen_kernels();
}

std::vector<std::string> available_simd() {
  std::vector<std::string> names;
  for (const InstructionSet& set : instruction_sets()) names.push_back(set.name);
  return names;
}

void use_simd(const std::string& name) {
  hwy::SetSupportedTargetsForTest(0);  // all that the CPU has
  const auto sets = instruction_sets();
  const auto found = name.empty() ? sets.begin() : std::ranges::find(sets, name, &InstructionSet::name);
  if (found == sets.end()) {
    std::string known;
    for (const std::string& other : available_simd()) known += (known.empty() ? "" : ", ") + other;
    throw InputError("instruction set " + name + "; expected one of " + known);
  }
  if (!name.empty()) hwy::SetSupportedTargetsForTest(found->target);
  hwy::GetChosenTarget().Update(hwy::SupportedTargets());
  chosen_kernels() = kernels_of(*found);
}

Model model_of(const Material& material, ReturnMapping mapping) {
  if (!material.plasticity) return Model::hencky;
  return mapping == ReturnMapping::paper ? Model::drucker_prager_paper : Model::drucker_prager_implicit;
}

PassKind pass_kind(const Material& material, const Numerics& numerics) {
  const Model model = model_of(material, numerics.return_mapping);
  if (numerics.transfer == TransferScheme::apic) return {model, Transfer::apic};
  return {model, numerics.flip == 0 && !numerics.flip_time ? Transfer::pic : Transfer::flip};
}

ParticleFields particle_fields(const Material& material, const Numerics& numerics) {
  return {material.plasticity.has_value(), numerics.transfer == TransferScheme::apic};
}

MaterialConstants::MaterialConstants(const Material& material)
    : bulk_modulus(material.elasticity.bulk_modulus()),
      mu(material.elasticity.mu()),
      friction_factor(0),
      cohesion(0),
      softening(0) {
  if (const auto& plasticity = material.plasticity) {
    friction_factor = plasticity->friction / (std::sqrt(6.0) * mu);
    cohesion = plasticity->cohesion;
    softening = plasticity->softening;
  }
}

void ParticleSums::add(const ParticleSums& other) {
  speed_squared += other.speed_squared;
  max_speed_squared = std::max(max_speed_squared, other.max_speed_squared);
  max_compression = std::max(max_compression, other.max_compression);
  plastic_dissipation += other.plastic_dissipation;
  yielded += other.yielded;
  for (int e = 0; e < 6; ++e) tau[e] += other.tau[e];
  q += other.q;
  for (int e = 0; e < 6; ++e) tau_J[e] += other.tau_J[e];
  J += other.J;
  elastic_energy += other.elastic_energy;
  plastic += other.plastic;
}

ParticlePointers::ParticlePointers(Particles& particles)
    : kappa(particles.kappa.size() ? particles.kappa.data() : nullptr) {
  for (int a = 0; a < 3; ++a) s[a] = particles.s[a].data();
  for (int a = 0; a < 3; ++a) v[a] = particles.v[a].data();
  for (int e = 0; e < 6; ++e) h[e] = particles.h[e].data();
  for (int e = 0; e < 9; ++e) affine[e] = particles.affine[e].data();
}

}  // namespace anticrack
#endif
