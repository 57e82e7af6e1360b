// One pass over particles: grid to particle, material, and particle to grid of the next step. Per-target
// include guard.
#if defined(ANTICRACK_ADVANCE_PARTICLES_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef ANTICRACK_ADVANCE_PARTICLES_INL_H
#undef ANTICRACK_ADVANCE_PARTICLES_INL_H
#else
#define ANTICRACK_ADVANCE_PARTICLES_INL_H
#endif

#include <hwy/cache_control.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <type_traits>

#include "kernels.h"
#include "lane_sums-inl.h"
#include "material/elastoplastic_step-inl.h"
#include "transfer/grid_to_particles-inl.h"
#include "transfer/particles_to_grid-inl.h"

HWY_BEFORE_NAMESPACE();
namespace anticrack {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

template <class D, class V = hn::Vec<D>>
HWY_INLINE hn::Mask<D> inside_cell(D d, const V (&s)[3]) {
  const V zero = hn::Zero(d), one = hn::Set(d, 1.0);
  hn::Mask<D> inside = hn::And(s[0] >= zero, s[0] <= one);
  for (int a = 1; a < 3; ++a) inside = hn::And(inside, hn::And(s[a] >= zero, s[a] <= one));
  return inside;
}

/// `value` in the lanes of the mask, 0 elsewhere; the compiler is told when that is all lanes.
template <bool everywhere, class M, class V>
HWY_INLINE V only_in(M mask, V value) {
  if constexpr (everywhere)
    return value;
  else
    return hn::IfThenElseZero(mask, value);
}

/// `a` in the lanes of the mask, `b` elsewhere.
template <bool everywhere, class M, class V>
HWY_INLINE V choose(M mask, V a, V b) {
  if constexpr (everywhere)
    return a;
  else
    return hn::IfThenElse(mask, a, b);
}

/// `from`: six arrays.
template <class D, class Arrays, class V = hn::Vec<D>>
HWY_INLINE Symmetric<V> load_symmetric(D d, const Arrays& from, std::size_t i) {
  const auto at = [&](int e) ANTICRACK_INLINE { return hn::LoadU(d, from[e] + i); };
  return {at(0), at(1), at(2), at(3), at(4), at(5)};
}

template <class D, class Arrays, class V = hn::Vec<D>>
HWY_INLINE void store_symmetric(D d, const Symmetric<V>& value, Arrays& to, std::size_t i) {
  const V* const e[6] = {&value.xx, &value.yy, &value.zz, &value.xy, &value.xz, &value.yz};
  for (int n = 0; n < 6; ++n) hn::StoreU(*e[n], d, to[n] + i);
}

/// Velocity and place after the step, and the gradient that strains the particle.
template <class V>
struct Moved {
  V s[3], v[3];
  V L[3][3];  ///< dt grad v
};

/// Numbers of a node that a transfer reads: velocity and mass, and the increment.
template <Transfer transfer>
constexpr int channels = transfer == Transfer::flip ? 8 : 4;

/// Lines 12 and 13 of Algorithm 1, and dt grad v for line 7; `place` is relative to the cell of `grid`, `s`
/// to the particle's own.
template <Transfer transfer, class D, class V = hn::Vec<D>>
HWY_INLINE Moved<V> interpolate(D d, const StepConstants& c, const CellPolynomial& grid, const V (&place)[3],
                                const V (&s)[3], const V (&v)[3]) {
  const V dt_over_dx = hn::Set(d, c.dt / c.cell_size), flip = hn::Set(d, c.flip);
  const Place<V> at = place_of(d, place);
  Moved<V> moved;
  for (int a = 0; a < 3; ++a) {
    const Sampled<V> pic = sample<true>(d, grid, a, at);
    moved.s[a] = hn::MulAdd(dt_over_dx, pic.value, s[a]);  // line 13
    moved.v[a] = pic.value;                                // line 12
    if constexpr (transfer == Transfer::flip) {
      const Sampled<V> dv = sample<false>(d, grid, a + 4, at);
      moved.v[a] = hn::MulAdd(flip, v[a] + dv.value - pic.value, pic.value);
    }
    for (int e = 0; e < 3; ++e) moved.L[a][e] = dt_over_dx * pic.gradient[e];
  }
  return moved;
}

/// What the lanes `active`, at `place` in their cell, give to the grid, as particles `first`, `first` + 1,
/// ... of `giving`; and what the observables need.
template <bool everywhere, class D, int size, class V = hn::Vec<D>, class M = hn::Mask<D>>
HWY_INLINE void give(D d, const StepConstants& c, const V (&place)[3], const V (&velocity)[3], V kappa,
                     M active, const HenckyStrain<V>& strain, int first, Giving<size>& giving, bool observe,
                     LaneSums<V>& sums) {
  const auto only = [&](V x) ANTICRACK_INLINE { return only_in<everywhere>(active, x); };
  const V two_mu = hn::Set(d, 2 * c.material.mu);
  const V trace = only(strain.trace), norm = only(strain.norm);
  const V minus_p = hn::Set(d, c.material.bulk_modulus) * trace;
  // t = -V0 tau / dx, tau = K tr eps I + 2 mu dev eps (Eq. 7)
  const double f = -c.volume / c.cell_size;
  const V f_minus_p = hn::Set(d, f) * minus_p, f_two_mu = hn::Set(d, f) * two_mu;
  const Symmetric<V>& dev = strain.deviator;
  const Symmetric<V> t{only(hn::MulAdd(f_two_mu, dev.xx, f_minus_p)),
                       only(hn::MulAdd(f_two_mu, dev.yy, f_minus_p)),
                       only(hn::MulAdd(f_two_mu, dev.zz, f_minus_p)),
                       only(f_two_mu * dev.xy),
                       only(f_two_mu * dev.xz),
                       only(f_two_mu * dev.yz)};
  const V mass = only(hn::Set(d, c.mass));
  const V v[3] = {only(velocity[0]), only(velocity[1]), only(velocity[2])};
  const V momentum[3] = {mass * v[0], mass * v[1], mass * v[2]};
  const V s[3] = {only(place[0]), only(place[1]), only(place[2])};
  note_giving(d, s, momentum, mass, t, first, giving);

  const V speed_squared = hn::MulAdd(v[0], v[0], hn::MulAdd(v[1], v[1], v[2] * v[2]));
  const V q = hn::Set(d, std::sqrt(6.0) * c.material.mu) * norm;  // sqrt(3/2) |dev tau|
  sums.speed_squared = sums.speed_squared + speed_squared;
  sums.max_speed_squared = hn::Max(sums.max_speed_squared, speed_squared);
  sums.max_compression =
      hn::Max(sums.max_compression, hn::MulAdd(hn::Set(d, 2.0 / 3.0), q, hn::Neg(minus_p)));
  if (HWY_UNLIKELY(observe)) {
    const V J = only(hn::Exp(d, trace));
    const V tau[6] = {only(hn::MulAdd(two_mu, dev.xx, minus_p)),
                      only(hn::MulAdd(two_mu, dev.yy, minus_p)),
                      only(hn::MulAdd(two_mu, dev.zz, minus_p)),
                      only(two_mu * dev.xy),
                      only(two_mu * dev.xz),
                      only(two_mu * dev.yz)};
    for (int e = 0; e < 6; ++e) sums.tau[e] = sums.tau[e] + tau[e];
    for (int e = 0; e < 6; ++e) sums.tau_J[e] = hn::MulAdd(tau[e], J, sums.tau_J[e]);
    sums.q = sums.q + q;
    sums.J = sums.J + J;
    sums.elastic_energy = sums.elastic_energy + energy_density(d, c.material, trace, norm);
    sums.plastic = sums.plastic + hn::IfThenElseZero(hn::And(active, kappa > hn::Zero(d)), hn::Set(d, 1.0));
  }
}

template <class D, class V = hn::Vec<D>>
HWY_INLINE hn::Mask<D> not_finite(D d, const HenckyStrain<V>& strain, const V (&v)[3], V kappa) {
  const V speed = hn::Abs(v[0]) + hn::Abs(v[1]) + hn::Abs(v[2]);
  return hn::Not(strain.norm + hn::Abs(strain.trace) + speed + kappa < hn::Set(d, 1e300));
}

template <class D, class M = hn::Mask<D>>
HWY_INLINE void note_failure(D d, M failed, std::size_t first, const char* quantity, BlockResult& result) {
  if (HWY_UNLIKELY(!hn::AllFalse(d, failed)) && !result.failure)
    result.failure = {std::uint32_t(first + hn::FindFirstTrue(d, failed)), quantity};
}

/// Access to the particle arrays for a batch. `everywhere`: every lane is in use; else lanes beyond the
/// block's particles are another thread's. Masked stores are kept for those: they are slow on some
/// processors.
template <bool everywhere, class D>
struct Lanes {
  using V = hn::Vec<D>;
  D d;
  bool all_ours;
  hn::Mask<D> ours;

  HWY_INLINE V load(const double* from) const {
    return everywhere ? hn::LoadU(d, from) : hn::MaskedLoad(ours, d, from);
  }
  HWY_INLINE void store(V value, double* to) const {
    if (everywhere || all_ours)
      hn::StoreU(value, d, to);
    else
      hn::BlendedStore(value, ours, d, to);
  }
  HWY_INLINE Symmetric<V> load_symmetric(double* const (&from)[6], std::size_t i) const {
    return {load(from[0] + i), load(from[1] + i), load(from[2] + i),
            load(from[3] + i), load(from[4] + i), load(from[5] + i)};
  }
  HWY_INLINE void store_symmetric(const Symmetric<V>& value, double* const (&to)[6], std::size_t i) const {
    const V* const e[6] = {&value.xx, &value.yy, &value.zz, &value.xy, &value.xz, &value.yz};
    for (int n = 0; n < 6; ++n) store(*e[n], to[n] + i);
  }
};

/// Consecutive particles of a block on their way from the grid through the material to the grid.
constexpr int chunk_size = 40;
constexpr int chunk_room = chunk_size + 8;  ///< vectors may write beyond the last particle

struct alignas(64) Chunk {
  double s[3][chunk_room], v[3][chunk_room], L[9][chunk_room];          ///< `Moved`
  double trace[chunk_room], norm[chunk_room], deviator[6][chunk_room];  ///< `HenckyStrain` of the trial state
  Giving<chunk_room> giving;
};

/// The particles from `begin` on, a chunk of them, will be needed soon; too many streams for the hardware to
/// foresee.
HWY_INLINE void prefetch_particles(const ParticlePointers& p, std::size_t begin, bool has_kappa) {
  for (std::size_t i = begin; i < begin + chunk_size; i += 8) {
    for (int a = 0; a < 3; ++a) hwy::Prefetch(p.s[a] + i);
    for (int a = 0; a < 3; ++a) hwy::Prefetch(p.v[a] + i);
    for (int e = 0; e < 6; ++e) hwy::Prefetch(p.h[e] + i);
    if (has_kappa) hwy::Prefetch(p.kappa + i);
  }
}

/// Copies the nodes that a block reaches side by side.
HWY_INLINE void gather_nodes(const BlockView& block, Tile& nodes) {
  for (int x = 0; x < tile_edge; ++x)
    for (int y = 0; y < tile_edge; ++y)
      for (int oz = 0; oz < 2; ++oz) {
        const Node* leaf = block.leaf[(x >> 2) * 4 + (y >> 2) * 2 + oz];
        std::memcpy(static_cast<void*>(&nodes[(x * tile_edge + y) * tile_edge + 4 * oz]),
                    leaf + leaf_index(x & 3, y & 3, 0), (oz ? tile_edge - 4 : 4) * sizeof(Node));
      }
}

/// Adds what a block's particles gave to the group's sums.
HWY_INLINE void add_tile(const Tile& tile, const BlockView& block) {
  const NodeVector d;
  constexpr int lanes = int(hn::MaxLanes(d));
  for (int x = 0; x < tile_edge; ++x)
    for (int y = 0; y < tile_edge; ++y)
      for (int oz = 0; oz < 2; ++oz) {
        const double* from = reinterpret_cast<const double*>(&tile[(x * tile_edge + y) * tile_edge + 4 * oz]);
        double* to = reinterpret_cast<double*>(block.partial[(x >> 2) * 4 + (y >> 2) * 2 + oz] +
                                               leaf_index(x & 3, y & 3, 0));
        for (int n = 0; n < (oz ? tile_edge - 4 : 4) * 8; n += lanes)
          hn::Store(hn::Load(d, to + n) + hn::Load(d, from + n), d, to + n);
      }
}

/// Calls visit(first node of the cell in a tile, from, to) for the cells of particles [begin, end).
template <class Visit>
HWY_INLINE void for_each_cell(const BlockView& block, std::size_t begin, std::size_t end, Visit visit) {
  int cell =
      int(std::upper_bound(block.cell_begin, block.cell_begin + block_cells, begin) - block.cell_begin) - 1;
  for (std::size_t from = begin; from < end; ++cell) {
    const std::size_t to = std::min<std::size_t>(block.cell_begin[cell + 1], end);
    if (to > from) visit(((cell >> 4) * tile_edge + (cell >> 2 & 3)) * tile_edge + (cell & 3), from, to);
    from = to;
  }
}

/// The particles at home in a block, chunk by chunk; `advancing` false: particle to grid alone.
template <Model model, Transfer transfer, bool advancing>
void pass_over_block(const StepConstants& c, const ParticlePointers& p, const BlockView& block, bool observe,
                     BlockResult& result) {
  using D = hn::CappedTag<double, 8>;
  using V = hn::Vec<D>;
  using M = hn::Mask<D>;
  const D d;
  constexpr std::size_t lanes = hn::MaxLanes(d);
  constexpr bool plastic = model != Model::hencky;
  constexpr int stride_x = tile_edge * tile_edge, stride_y = tile_edge;

  const std::size_t last = block.cell_begin[block_cells];
  if (block.cell_begin[0] == last) return;
  Tile nodes, tile;  // that the block reaches: to read, to write
  if constexpr (advancing) gather_nodes(block, nodes);
  std::memset(static_cast<void*>(&tile), 0, sizeof(Tile));

  LaneSums<V> sums = zero_sums(d);
  Chunk chunk;
  for (std::size_t begin = block.cell_begin[0], end; begin < last; begin = end) {
    // As many whole cells as fit, or a part of one.
    end = *(std::upper_bound(block.cell_begin, block.cell_begin + block_cells + 1, begin + chunk_size) - 1);
    if (end == begin) end = begin + chunk_size;
    prefetch_particles(p, end, plastic);

    // Grid to particle, cell by cell.
    if constexpr (advancing)
      for_each_cell(
          block, begin, end, [&](int first_node, std::size_t from, std::size_t to) ANTICRACK_INLINE {
            CellPolynomial grid;
            make_polynomial<channels<transfer>>(&nodes[first_node], stride_x, stride_y, grid);
            for (std::size_t i = from; i < to; i += lanes) {
              const M here = hn::FirstN(d, to - i);
              V s[3], v[3];
              for (int a = 0; a < 3; ++a) s[a] = hn::MaskedLoad(here, d, p.s[a] + i);
              for (int a = 0; a < 3; ++a)
                v[a] = transfer == Transfer::flip ? hn::MaskedLoad(here, d, p.v[a] + i) : hn::Zero(d);
              const Moved<V> moved = interpolate<transfer>(d, c, grid, s, s, v);
              for (int a = 0; a < 3; ++a) hn::StoreU(moved.s[a], d, chunk.s[a] + (i - begin));
              for (int a = 0; a < 3; ++a) hn::StoreU(moved.v[a], d, chunk.v[a] + (i - begin));
              for (int e = 0; e < 9; ++e) hn::StoreU(moved.L[e / 3][e % 3], d, chunk.L[e] + (i - begin));
            }
          });

    // Material, every lane full. Two loops, each short enough for the processor to overlap its batches.
    const auto for_each_batch = [&](auto visit) ANTICRACK_INLINE {
      for (std::size_t i = begin; i < end; i += lanes) {
        const M stored = hn::FirstN(d, end - i), ours = hn::FirstN(d, last - i);
        V s[3];
        for (int a = 0; a < 3; ++a) s[a] = hn::MaskedLoad(ours, d, p.s[a] + i);
        const M home = hn::And(stored, inside_cell(d, s));
        if (HWY_LIKELY(hn::AllTrue(d, home)))
          visit(std::true_type(), i, home, Lanes<true, D>{d, true, ours});
        else
          visit(std::false_type(), i, home, Lanes<false, D>{d, i + lanes <= last, ours});
      }
    };
    for_each_batch([&](auto everywhere, std::size_t i, M home, const auto& at) ANTICRACK_INLINE {
      const std::size_t l = i - begin;
      Symmetric<V> h = at.load_symmetric(p.h, i);
      if constexpr (advancing) {
        V L[3][3];
        for (int e = 0; e < 9; ++e) L[e / 3][e % 3] = only_in<everywhere>(home, hn::Load(d, chunk.L[e] + l));
        M inverted;
        h = elastic_trial(d, L, h, inverted);  // line 7
        note_failure(d, hn::And(home, inverted), i, "det(I + dt grad v)", result);
        at.store_symmetric(h, p.h, i);
      }
      const HenckyStrain<V> strain = hencky_strain(d, h);  // lines 8, 9
      hn::Store(strain.trace, d, chunk.trace + l);
      hn::Store(strain.norm, d, chunk.norm + l);
      store_symmetric(d, strain.deviator, chunk.deviator, l);
    });
    for_each_batch([&](auto everywhere, std::size_t i, M home, const auto& at) ANTICRACK_INLINE {
      const std::size_t l = i - begin;
      HenckyStrain<V> strain{hn::Load(d, chunk.trace + l), load_symmetric(d, chunk.deviator, l),
                             hn::Load(d, chunk.norm + l)};
      V s[3], v[3], kappa = hn::Zero(d);
      for (int a = 0; a < 3; ++a) s[a] = at.load(p.s[a] + i);
      for (int a = 0; a < 3; ++a) v[a] = at.load(p.v[a] + i);
      if constexpr (plastic) kappa = at.load(p.kappa + i);
      M staying = home;
      if constexpr (advancing) {
        for (int a = 0; a < 3; ++a) s[a] = choose<everywhere>(home, hn::Load(d, chunk.s[a] + l), s[a]);
        for (int a = 0; a < 3; ++a) v[a] = choose<everywhere>(home, hn::Load(d, chunk.v[a] + l), v[a]);
        for (int a = 0; a < 3; ++a) at.store(s[a], p.s[a] + i);  // line 13
        for (int a = 0; a < 3; ++a) at.store(v[a], p.v[a] + i);  // line 12
        if constexpr (plastic) {                                 // lines 10, 11
          const Returned<D> r =
              return_to_yield_surface<model>(d, c.material, strain.trace, strain.norm, kappa);
          const M yielded = hn::And(home, r.yielded);
          if (!hn::AllFalse(d, yielded)) {
            V L[3][3];
            for (int e = 0; e < 9; ++e) L[e / 3][e % 3] = hn::Load(d, chunk.L[e] + l);
            Symmetric<V> h = at.load_symmetric(p.h, i);
            apply_return(d, c, L, yielded, r, strain, h, kappa, sums);
            at.store_symmetric(h, p.h, i);
            at.store(kappa, p.kappa + i);
          }
        }
        staying = hn::And(home, inside_cell(d, s));
      }
      note_failure(d, hn::And(home, not_finite(d, strain, v, kappa)), i, "velocity, elastic strain or kappa",
                   result);
      if (everywhere && HWY_LIKELY(hn::AllTrue(d, staying)))
        return give<true>(d, c, s, v, kappa, staying, strain, int(l), chunk.giving, observe, sums);
      give<false>(d, c, s, v, kappa, staying, strain, int(l), chunk.giving, observe, sums);
      for (std::size_t n = i; n < std::min(i + lanes, end); ++n)
        if (!(p.s[0][n] >= 0 && p.s[0][n] <= 1 && p.s[1][n] >= 0 && p.s[1][n] <= 1 && p.s[2][n] >= 0 &&
              p.s[2][n] <= 1))
          result.strays.push_back(std::uint32_t(n));
    });

    // Particle to grid, cell by cell.
    asm volatile("" ::: "memory");  // see make_polynomial
    for_each_cell(block, begin, end, [&](int first_node, std::size_t from, std::size_t to) ANTICRACK_INLINE {
      add_to_cell(chunk.giving, int(from - begin), int(to - begin), &tile[first_node], stride_x, stride_y);
    });
  }
  add_tile(tile, block);
  reduce(d, sums, observe, result.sums);
}

using OneLane = hn::CappedTag<double, 1>;

/// A stray's numbers: the arrays from its index on, one lane.
struct OneParticle {
  using V = hn::Vec<OneLane>;
  V s[3], v[3], place[3], kappa;
  Symmetric<V> h;

  OneParticle(const ParticlePointers& p, std::uint32_t particle, const Index3& shift)
      : kappa(hn::Zero(OneLane())) {
    const OneLane d;
    for (int a = 0; a < 3; ++a) s[a] = hn::LoadU(d, p.s[a] + particle);
    for (int a = 0; a < 3; ++a) v[a] = hn::LoadU(d, p.v[a] + particle);
    for (int a = 0; a < 3; ++a) place[a] = s[a] - hn::Set(d, double(shift[a]));
    if (p.kappa) kappa = hn::LoadU(d, p.kappa + particle);
    h = load_symmetric(d, p.h, particle);
  }
  void store(const ParticlePointers& p, std::uint32_t particle) const {
    const OneLane d;
    for (int a = 0; a < 3; ++a) hn::StoreU(s[a], d, p.s[a] + particle);
    for (int a = 0; a < 3; ++a) hn::StoreU(v[a], d, p.v[a] + particle);
    if (p.kappa) hn::StoreU(kappa, d, p.kappa + particle);
    store_symmetric(d, h, p.h, particle);
  }
};

template <Model model, Transfer transfer>
void advance_one(const StepConstants& c, const ParticlePointers& p, std::uint32_t particle,
                 const Node nodes[27], const Index3& shift, BlockResult& result) {
  using V = OneParticle::V;
  const OneLane d;
  CellPolynomial grid;
  make_polynomial<channels<transfer>>(nodes, 9, 3, grid);
  OneParticle one(p, particle, shift);
  const Moved<V> moved = interpolate<transfer>(d, c, grid, one.place, one.s, one.v);
  for (int a = 0; a < 3; ++a) one.s[a] = moved.s[a];
  for (int a = 0; a < 3; ++a) one.v[a] = moved.v[a];
  LaneSums<V> sums = zero_sums(d);
  hn::Mask<OneLane> inverted;
  one.h = elastic_trial(d, moved.L, one.h, inverted);
  note_failure(d, inverted, particle, "det(I + dt grad v)", result);
  HenckyStrain<V> strain = hencky_strain(d, one.h);
  if constexpr (model != Model::hencky) {
    const Returned<OneLane> r =
        return_to_yield_surface<model>(d, c.material, strain.trace, strain.norm, one.kappa);
    if (!hn::AllFalse(d, r.yielded))
      apply_return(d, c, moved.L, r.yielded, r, strain, one.h, one.kappa, sums);
  }
  note_failure(d, not_finite(d, strain, one.v, one.kappa), particle, "velocity, elastic strain or kappa",
               result);
  one.store(p, particle);
  reduce(d, sums, false, result.sums);
}

inline void scatter_one(const StepConstants& c, const ParticlePointers& p, std::uint32_t particle,
                        const Index3& shift, Node nodes[27], bool observe, ParticleSums& out) {
  using V = OneParticle::V;
  const OneLane d;
  const OneParticle one(p, particle, shift);
  LaneSums<V> sums = zero_sums(d);
  Giving<1> giving;
  give<true>(d, c, one.place, one.v, one.kappa, hn::FirstN(d, 1), hencky_strain(d, one.h), 0, giving, observe,
             sums);
  add_to_cell(giving, 0, 1, nodes, 9, 3);
  reduce(d, sums, observe, out);
}

}  // namespace HWY_NAMESPACE
}  // namespace anticrack
HWY_AFTER_NAMESPACE();
#endif
