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
#include <bit>
#include <cmath>
#include <cstdint>
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

/// Access to the particle arrays for a batch that lies within the block's particles, all lanes in use.
template <class D>
struct AllLanes {
  using V = hn::Vec<D>;
  D d;
  HWY_INLINE V load(const double* from) const { return hn::LoadU(d, from); }
  HWY_INLINE void store(V value, double* to) const { hn::StoreU(value, d, to); }
};

/// The same where lanes are out of use: those beyond the block's particles are another thread's. Masked
/// stores are kept for these: they are slow on some processors.
template <class D>
struct SomeLanes {
  using V = hn::Vec<D>;
  D d;
  hn::Mask<D> ours;
  bool all_ours;
  HWY_INLINE V load(const double* from) const { return hn::MaskedLoad(ours, d, from); }
  HWY_INLINE void store(V value, double* to) const {
    if (all_ours)
      hn::StoreU(value, d, to);
    else
      hn::BlendedStore(value, ours, d, to);
  }
};

/// `from`, `to`: six arrays.
template <class Lanes, class Arrays>
HWY_INLINE Symmetric<typename Lanes::V> load_symmetric(const Lanes& at, const Arrays& from, std::size_t i) {
  return {at.load(from[0] + i), at.load(from[1] + i), at.load(from[2] + i),
          at.load(from[3] + i), at.load(from[4] + i), at.load(from[5] + i)};
}

template <class Lanes, class V, class Arrays>
HWY_INLINE void store_symmetric(const Lanes& at, const Symmetric<V>& value, Arrays& to, std::size_t i) {
  const V* const e[6] = {&value.xx, &value.yy, &value.zz, &value.xy, &value.xz, &value.yz};
  for (int n = 0; n < 6; ++n) at.store(*e[n], to[n] + i);
}

/// -V0 tau / dx of the lanes `active`, tau = K tr eps I + 2 mu dev eps (Eq. 7).
template <bool everywhere, class D, class V = hn::Vec<D>, class M = hn::Mask<D>>
HWY_INLINE Symmetric<V> traction_of(D d, const StepConstants& c, const HenckyStrain<V>& strain, M active) {
  const double f = -c.volume / c.cell_size;
  const V f_minus_p = hn::Set(d, f * c.material.bulk_modulus) * strain.trace;
  const V f_two_mu = hn::Set(d, f * 2 * c.material.mu);
  const Symmetric<V>& dev = strain.deviator;
  return {only_in<everywhere>(active, hn::MulAdd(f_two_mu, dev.xx, f_minus_p)),
          only_in<everywhere>(active, hn::MulAdd(f_two_mu, dev.yy, f_minus_p)),
          only_in<everywhere>(active, hn::MulAdd(f_two_mu, dev.zz, f_minus_p)),
          only_in<everywhere>(active, f_two_mu * dev.xy),
          only_in<everywhere>(active, f_two_mu * dev.xz),
          only_in<everywhere>(active, f_two_mu * dev.yz)};
}

/// What the lanes `active`, at `place` in their cell, contribute to the grid, as particles `first`, `first` +
/// 1, ... of `out`, and to the sums over particles. `affine` is read by APIC only.
template <bool everywhere, class D, int size, bool with_affine, class V = hn::Vec<D>, class M = hn::Mask<D>>
HWY_INLINE void contribute(D d, const StepConstants& c, const V (&place)[3], const V (&velocity)[3],
                           const V (&affine)[9], V kappa, M active, const HenckyStrain<V>& strain, int first,
                           Contributions<size, with_affine>& out, bool observe, LaneSums<V>& sums) {
  const auto only = [&](V x) ANTICRACK_INLINE { return only_in<everywhere>(active, x); };
  const V mass = only(hn::Set(d, c.mass));
  const V v[3] = {only(velocity[0]), only(velocity[1]), only(velocity[2])};
  const V momentum[3] = {mass * v[0], mass * v[1], mass * v[2]};
  const V s[3] = {only(place[0]), only(place[1]), only(place[2])};
  store_contributions(d, s, momentum, mass, traction_of<everywhere>(d, c, strain, active), first, out);

  const V trace = only(strain.trace), norm = only(strain.norm);
  add_speed_and_compression(d, c.material, v, trace, norm, sums);
  if constexpr (with_affine) {
    V momenta[9], speeds[9];
    for (int e = 0; e < 9; ++e) speeds[e] = only(affine[e]);
    for (int e = 0; e < 9; ++e) momenta[e] = mass * speeds[e];
    store_affine(d, s, momenta, first, out);
    add_affine_speed(d, speeds, sums);
  }
  if (HWY_UNLIKELY(observe)) {
    const Symmetric<V>& dev = strain.deviator;
    const Symmetric<V> deviator{only(dev.xx), only(dev.yy), only(dev.zz),
                                only(dev.xy), only(dev.xz), only(dev.yz)};
    const V J = only(hn::Exp(d, trace));
    const M plastic = hn::And(active, kappa > hn::Zero(d));
    add_averages(d, c.material, {trace, deviator, norm}, J, plastic, sums);
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

/// Lists the lanes of a batch in which a particle is outside its cell; that of the first lane is `first`.
template <class D, class M = hn::Mask<D>>
HWY_INLINE void list_strays(D d, M strays, std::size_t first, BlockResult& result) {
  std::uint8_t bits[8] = {};
  hn::StoreMaskBits(d, strays, bits);
  for (unsigned lanes = bits[0]; lanes != 0; lanes &= lanes - 1)
    result.strays.push_back(std::uint32_t(first) + std::uint32_t(std::countr_zero(lanes)));
}

/// Consecutive particles of a block on their way from the grid through the material to the grid.
constexpr int chunk_size = 96;
constexpr int chunk_room = chunk_size + 8;  ///< vectors may write beyond the last particle

struct AffineChunk {
  double affine[9][chunk_room];
};
struct NoAffineChunk {};

template <bool with_affine>
struct alignas(64) Chunk : std::conditional_t<with_affine, AffineChunk, NoAffineChunk> {
  double s[3][chunk_room], v[3][chunk_room], L[9][chunk_room];          ///< `Moved`
  double trace[chunk_room], norm[chunk_room], deviator[6][chunk_room];  ///< `HenckyStrain`
  double returned[6][chunk_room];                                       ///< h after a return mapping
  Contributions<chunk_room, with_affine> contributions;
};

/// Particles [begin, end) of those of a block, which end at `last`; `first_cell` of its occupied cells holds
/// the first.
struct ChunkRange {
  std::size_t begin, end, last;
  int first_cell;
};

/// Vectors across particles.
using ParticleVector = hn::CappedTag<double, 8>;

/// Calls visit(leaf of the eight, first node in the leaf, the same in the tile, how many) for the rows along
/// z at (x, y) of the tile in leaves that the block's particles reach.
template <class Visit>
HWY_INLINE void for_each_reached_row(const BlockView& block, int x, int y, Visit visit) {
  for (int oz = 0; oz < 2; ++oz) {
    const int o = (x >> 2) * 4 + (y >> 2) * 2 + oz;
    if (block.leaf[o])
      visit(o, leaf_index(x & 3, y & 3, 0), (x * tile_edge + y) * tile_edge + 4 * oz, oz ? tile_edge - 4 : 4);
  }
}

/// The same for all (x, y).
template <class Visit>
HWY_INLINE void for_each_reached_row(const BlockView& block, Visit visit) {
  for (int x = 0; x < tile_edge; ++x)
    for (int y = 0; y < tile_edge; ++y) for_each_reached_row(block, x, y, visit);
}

/// Copies the nodes that a block reaches side by side.
HWY_INLINE void gather_nodes(const BlockView& block, Tile& nodes) {
  for_each_reached_row(block, [&](int o, int first, int first_in_tile, int count) ANTICRACK_INLINE {
    std::memcpy(static_cast<void*>(&nodes[first_in_tile]), block.leaf[o] + first, count * sizeof(Node));
  });
}

/// Adds what a block's particles gave to the group's sums.
HWY_INLINE void add_tile(const Tile& tile, const BlockView& block) {
  const NodeVector d;
  for_each_reached_row(block, [&](int o, int first, int first_in_tile, int count) ANTICRACK_INLINE {
    const double* from = reinterpret_cast<const double*>(&tile[first_in_tile]);
    double* to = reinterpret_cast<double*>(block.partial[o] + first);
    for (int n = 0; n < count * 8; n += int(hn::MaxLanes(d)))
      hn::Store(hn::Load(d, to + n) + hn::Load(d, from + n), d, to + n);
  });
}

/// The lowest node of a cell of a block, in its tile.
constexpr int first_node_of(int cell) {
  return ((cell >> 4) * tile_edge + (cell >> 2 & 3)) * tile_edge + (cell & 3);
}

/// The cells of a block that hold particles.
struct OccupiedCells {
  int count = 0;
  std::uint32_t begin[block_cells + 1];  ///< particles of the n-th are [begin[n], begin[n + 1])
  std::uint8_t first_node[block_cells];  ///< `first_node_of` it

  /// No branch on what is empty: the processor could not foresee it.
  HWY_INLINE explicit OccupiedCells(const BlockView& block) {
    for (int cell = 0; cell < block_cells; ++cell) {
      begin[count] = block.cell_begin[cell];
      first_node[count] = std::uint8_t(first_node_of(cell));
      count += block.cell_begin[cell + 1] > block.cell_begin[cell];
    }
    begin[count] = block.cell_begin[block_cells];
  }
};

/// Calls visit(first node of the cell in a tile, from, to) for the cells of a chunk.
template <class Visit>
HWY_INLINE void for_each_cell(const OccupiedCells& cells, const ChunkRange& range, Visit visit) {
  int n = range.first_cell;
  for (std::size_t from = range.begin; from < range.end; ++n) {
    const std::size_t to = std::min<std::size_t>(cells.begin[n + 1], range.end);
    visit(cells.first_node[n], from, to);
    from = to;
  }
}

/// Asks for the nodes that a block reads and the sums that it adds to, a row along z at a time: all at once
/// they would have to wait for each other.
class NodesAhead {
 public:
  explicit NodesAhead(const BlockView& block) : block_(block) {
    for (int cell = 0; cell <= block_cells; cell += 16) hwy::Prefetch(block.cell_begin + cell);
  }

  HWY_INLINE void ask(int rows) {
    for (; rows > 0 && row_ < tile_edge * tile_edge; --rows, ++row_)
      for_each_reached_row(block_, row_ / tile_edge, row_ % tile_edge,
                           [&](int o, int first, int, int count) ANTICRACK_INLINE {
                             for (int z = 0; z < count; ++z) hwy::Prefetch(block_.leaf[o] + first + z);
                             for (int z = 0; z < count; ++z) hwy::Prefetch(block_.partial[o] + first + z);
                           });
  }

 private:
  const BlockView& block_;
  int row_ = 0;
};

/// Calls visit(everywhere, first particle, lanes at home, access) for batches of particles; `everywhere`: all
/// lanes are.
template <class Visit>
HWY_INLINE void for_each_batch(const ParticlePointers& p, const ChunkRange& range, Visit visit) {
  const ParticleVector d;
  constexpr std::size_t lanes = hn::MaxLanes(d);
  for (std::size_t i = range.begin; i < range.end; i += lanes) {
    const auto stored = hn::FirstN(d, range.end - i), ours = hn::FirstN(d, range.last - i);
    hn::Vec<ParticleVector> s[3];
    for (int a = 0; a < 3; ++a) s[a] = hn::MaskedLoad(ours, d, p.s[a] + i);
    const auto home = hn::And(stored, inside_cell(d, s));
    if (HWY_LIKELY(hn::AllTrue(d, home)))
      visit(std::true_type(), i, home, AllLanes<ParticleVector>{d});
    else
      visit(std::false_type(), i, home, SomeLanes<ParticleVector>{d, ours, i + lanes <= range.last});
  }
}

/// Strain of the chunk's particles from the l-th on.
template <bool with_affine, class V>
HWY_INLINE void store_strain(const HenckyStrain<V>& strain, Chunk<with_affine>& chunk, std::size_t l) {
  const ParticleVector d;
  hn::Store(strain.trace, d, chunk.trace + l);
  hn::Store(strain.norm, d, chunk.norm + l);
  store_symmetric(AllLanes<ParticleVector>{d}, strain.deviator, chunk.deviator, l);
}

template <bool with_affine>
HWY_INLINE HenckyStrain<hn::Vec<ParticleVector>> load_strain(const Chunk<with_affine>& chunk, std::size_t l) {
  const ParticleVector d;
  return {hn::Load(d, chunk.trace + l), load_symmetric(AllLanes<ParticleVector>{d}, chunk.deviator, l),
          hn::Load(d, chunk.norm + l)};
}

/// Component `a` of the chunk's particles from the l-th on.
template <Transfer transfer, class D, class V = hn::Vec<D>>
HWY_INLINE void store_moved(D d, const Moved<V>& moved, int a, std::size_t l,
                            Chunk<transfer == Transfer::apic>& chunk) {
  hn::StoreU(moved.s, d, chunk.s[a] + l);
  hn::StoreU(moved.v, d, chunk.v[a] + l);
  for (int e = 0; e < 3; ++e) hn::StoreU(moved.L[e], d, chunk.L[3 * a + e] + l);
  if constexpr (transfer == Transfer::apic)
    for (int e = 0; e < 3; ++e) hn::StoreU(moved.affine[e], d, chunk.affine[3 * a + e] + l);
}

/// Lines 12 and 13, and dt grad v, cell by cell.
template <Transfer transfer>
HWY_INLINE void grid_to_particles(const StepConstants& c, const ParticlePointers& p,
                                  const OccupiedCells& cells, const Tile& nodes, const ChunkRange& range,
                                  Chunk<transfer == Transfer::apic>& chunk) {
  const auto store = [&](auto d, const auto& moved, int a, std::size_t i)
                         ANTICRACK_INLINE { store_moved<transfer>(d, moved, a, i - range.begin, chunk); };
  const auto move_together = [&](const auto& lanes, const CellPolynomial& grid,
                                 std::size_t i) ANTICRACK_INLINE {
    const auto d = lanes.d;
    using V = hn::Vec<decltype(lanes.d)>;
    const V s[3] = {lanes.load(p.s[0] + i), lanes.load(p.s[1] + i), lanes.load(p.s[2] + i)};
    const Place<V> at = place_of(d, s);
    for (int a = 0; a < 3; ++a) {
      const V v = transfer == Transfer::flip ? lanes.load(p.v[a] + i) : hn::Zero(d);
      store(d, move<transfer>(d, c, grid, at, a, s[a], v), a, i);
    }
  };
  const auto move_one = [&](int first_node, std::size_t i) ANTICRACK_INLINE {
    const OneLane d;
    using V = hn::Vec<OneLane>;
    V s[3], v[3];
    for (int a = 0; a < 3; ++a) s[a] = hn::LoadU(d, p.s[a] + i);
    for (int a = 0; a < 3; ++a) v[a] = hn::LoadU(d, p.v[a] + i);
    Moved<V> moved[3];
    move_alone<transfer>(c, &nodes[first_node], tile_edge * tile_edge, tile_edge, s, s, v, moved);
    for (int a = 0; a < 3; ++a) store(d, moved[a], a, i);
  };
  const auto visit_cell = [&](int first_node, std::size_t from, std::size_t to) ANTICRACK_INLINE {
    const ParticleVector wide;
    const hn::CappedTag<double, 4> narrow;
    constexpr std::size_t many = hn::MaxLanes(wide), few = hn::MaxLanes(narrow);
    std::size_t i = from;
    if (to - from >= few) {
      CellPolynomial grid;
      make_polynomial<channels<transfer>>(&nodes[first_node], tile_edge * tile_edge, tile_edge, grid);
      if constexpr (many > few)
        for (; i + many <= to; i += many) move_together(AllLanes<ParticleVector>{wide}, grid, i);
      if (many > few && c.full_width && i + few <= to) {
        move_together(SomeLanes<ParticleVector>{wide, hn::FirstN(wide, to - i), false}, grid, i);
        i = to;
      }
      for (; i + few <= to; i += few) move_together(AllLanes<decltype(narrow)>{narrow}, grid, i);
    }
    for (; i < to; ++i) move_one(first_node, i);
  };
  for_each_cell(cells, range, visit_cell);
}

/// Lines 7 to 9: trial state and its Hencky strain.
template <bool advancing, bool with_affine>
HWY_INLINE void strain_particles(const ParticlePointers& p, const ChunkRange& range,
                                 Chunk<with_affine>& chunk, BlockResult& result) {
  const ParticleVector d;
  using V = hn::Vec<ParticleVector>;
  using M = hn::Mask<ParticleVector>;
  for_each_batch(p, range, [&](auto everywhere, std::size_t i, M home, const auto& at) ANTICRACK_INLINE {
    const std::size_t l = i - range.begin;
    Symmetric<V> h = load_symmetric(at, p.h, i);
    if constexpr (advancing) {
      V L[3][3];
      for (int e = 0; e < 9; ++e) L[e / 3][e % 3] = only_in<everywhere>(home, hn::Load(d, chunk.L[e] + l));
      M inverted;
      h = elastic_trial(d, L, h, inverted);
      note_failure(d, hn::And(home, inverted), i, "det(I + dt grad v)", result);
      store_symmetric(at, h, p.h, i);
    }
    store_strain(hencky_strain(d, h), chunk, l);
  });
}

/// Lines 10 and 11: return mapping, for batches in which a lane yields. What it leaves is strained anew, in a
/// loop of its own: short enough for the processor to overlap batches. The stress is always that of the
/// stored state, so that a resumed run has the same bits.
template <Model model, bool with_affine>
HWY_INLINE void return_particles(const StepConstants& c, const ParticlePointers& p, const ChunkRange& range,
                                 Chunk<with_affine>& chunk, LaneSums<hn::Vec<ParticleVector>>& sums) {
  const ParticleVector d;
  using V = hn::Vec<ParticleVector>;
  int yielding = 0, first[chunk_room];  // of the batches
  for_each_batch(p, range, [&](auto, std::size_t i, auto home, const auto& at) ANTICRACK_INLINE {
    const std::size_t l = i - range.begin;
    V kappa = at.load(p.kappa + i);
    const Returned<ParticleVector> r = return_to_yield_surface<model>(
        d, c.material, hn::Load(d, chunk.trace + l), hn::Load(d, chunk.norm + l), kappa);
    const auto yielded = hn::And(home, r.yielded);
    if (hn::AllFalse(d, yielded)) return;
    V L[3][3];
    for (int e = 0; e < 9; ++e) L[e / 3][e % 3] = hn::Load(d, chunk.L[e] + l);
    Symmetric<V> h = load_symmetric(at, p.h, i);
    apply_return(d, c, L, yielded, r, load_strain(chunk, l), h, kappa, sums);
    store_symmetric(at, h, p.h, i);
    store_symmetric(AllLanes<ParticleVector>{d}, h, chunk.returned, l);
    at.store(kappa, p.kappa + i);
    first[yielding++] = int(l);
  });
  for (int n = 0; n < yielding; ++n)
    store_strain(hencky_strain(d, load_symmetric(AllLanes<ParticleVector>{d}, chunk.returned, first[n])),
                 chunk, first[n]);
}

/// Lines 12 and 13, the new state; then, if `scattering`, what it contributes to the grid.
template <Model model, bool advancing, bool scattering, bool with_affine>
HWY_INLINE void store_particles(const StepConstants& c, const ParticlePointers& p, const ChunkRange& range,
                                bool observe, Chunk<with_affine>& chunk,
                                LaneSums<hn::Vec<ParticleVector>>& sums, BlockResult& result) {
  const ParticleVector d;
  using V = hn::Vec<ParticleVector>;
  using M = hn::Mask<ParticleVector>;
  for_each_batch(p, range, [&](auto everywhere, std::size_t i, M home, const auto& at) ANTICRACK_INLINE {
    const std::size_t l = i - range.begin;
    const HenckyStrain<V> strain = load_strain(chunk, l);
    V s[3], v[3], affine[9], kappa = hn::Zero(d);
    for (int a = 0; a < 3; ++a) s[a] = at.load(p.s[a] + i);
    for (int a = 0; a < 3; ++a) v[a] = at.load(p.v[a] + i);
    if constexpr (with_affine)
      for (int e = 0; e < 9; ++e) affine[e] = at.load(p.affine[e] + i);
    if constexpr (model != Model::hencky) kappa = at.load(p.kappa + i);
    M staying = home;
    if constexpr (advancing) {
      for (int a = 0; a < 3; ++a) s[a] = choose<everywhere>(home, hn::Load(d, chunk.s[a] + l), s[a]);
      for (int a = 0; a < 3; ++a) v[a] = choose<everywhere>(home, hn::Load(d, chunk.v[a] + l), v[a]);
      for (int a = 0; a < 3; ++a) at.store(s[a], p.s[a] + i);
      for (int a = 0; a < 3; ++a) at.store(v[a], p.v[a] + i);
      if constexpr (with_affine) {
        for (int e = 0; e < 9; ++e)
          affine[e] = choose<everywhere>(home, hn::Load(d, chunk.affine[e] + l), affine[e]);
        for (int e = 0; e < 9; ++e) at.store(affine[e], p.affine[e] + i);
      }
      staying = hn::And(home, inside_cell(d, s));
    }
    note_failure(d, hn::And(home, not_finite(d, strain, v, kappa)), i, "velocity, elastic strain or kappa",
                 result);
    if constexpr (!scattering) return;
    if (everywhere && HWY_LIKELY(hn::AllTrue(d, staying)))
      return contribute<true>(d, c, s, v, affine, kappa, staying, strain, int(l), chunk.contributions,
                              observe, sums);
    contribute<false>(d, c, s, v, affine, kappa, staying, strain, int(l), chunk.contributions, observe, sums);
    list_strays(d, hn::AndNot(staying, hn::FirstN(d, range.end - i)), i, result);
  });
}

/// Asks for what a pass reads of particle `i` from memory.
template <Model model, bool with_affine>
HWY_INLINE void prefetch_particle(const ParticlePointers& p, std::size_t i) {
  for (int a = 0; a < 3; ++a) hwy::Prefetch(p.s[a] + i);
  for (int a = 0; a < 3; ++a) hwy::Prefetch(p.v[a] + i);
  for (int e = 0; e < 6; ++e) hwy::Prefetch(p.h[e] + i);
  if constexpr (model != Model::hencky) hwy::Prefetch(p.kappa + i);
  if constexpr (with_affine)
    for (int e = 0; e < 9; ++e) hwy::Prefetch(p.affine[e] + i);
}

/// Lines 2 to 4 of the next step, cell by cell. Particles and nodes to come are asked for on the way, few at
/// a time: a chunk's at once would have to wait for each other.
template <Model model, bool with_affine>
HWY_INLINE void particles_to_grid(const StepConstants& c, const ParticlePointers& p,
                                  const OccupiedCells& cells, const ChunkRange& range,
                                  const Chunk<with_affine>& chunk, NodesAhead& ahead, Tile& tile) {
  constexpr std::size_t particles_ahead = 64;  // 32 to 160 are alike
  const int rows = (tile_edge * tile_edge + cells.count - 1) / cells.count;
  asm volatile("" ::: "memory");  // see make_polynomial
  for_each_cell(cells, range, [&](int first_node, std::size_t from, std::size_t to) ANTICRACK_INLINE {
    prefetch_particle<model, with_affine>(p, to + particles_ahead);
    ahead.ask(rows);
    add_to_cell(c.full_width, chunk.contributions, int(from - range.begin), int(to - range.begin),
                &tile[first_node], tile_edge * tile_edge, tile_edge);
  });
}

/// The particles at home in a block, chunk by chunk; `advancing` false: particle to grid alone.
template <Model model, Transfer transfer, bool advancing>
void pass_over_block(const StepConstants& c, const ParticlePointers& p, const BlockView& block,
                     const BlockView& next, bool observe, BlockResult& result) {
  const OccupiedCells cells(block);
  if (cells.count == 0) return;
  Tile nodes, tile;  // that the block reaches: to read, to write
  if constexpr (advancing) gather_nodes(block, nodes);
  std::memset(static_cast<void*>(&tile), 0, sizeof(Tile));

  const ParticleVector d;
  auto sums = zero_sums(d);
  Chunk<transfer == Transfer::apic> chunk;
  NodesAhead ahead(next);
  const std::size_t last = cells.begin[cells.count];
  int cell = 0;
  for (std::size_t begin = cells.begin[0], end; begin < last; begin = end) {
    // As many whole cells as fit, or a part of one.
    const int first_cell = cell;
    while (cell < cells.count && cells.begin[cell + 1] <= begin + chunk_size) ++cell;
    end = cell > first_cell ? cells.begin[cell] : begin + chunk_size;
    const ChunkRange range{begin, end, last, first_cell};
    if constexpr (advancing) grid_to_particles<transfer>(c, p, cells, nodes, range, chunk);
    strain_particles<advancing>(p, range, chunk, result);
    if constexpr (advancing && model != Model::hencky) return_particles<model>(c, p, range, chunk, sums);
    store_particles<model, advancing, true>(c, p, range, observe, chunk, sums, result);
    particles_to_grid<model>(c, p, cells, range, chunk, ahead, tile);
  }
  add_tile(tile, block);
  reduce(d, sums, observe, result.sums);
}

}  // namespace HWY_NAMESPACE
}  // namespace anticrack
HWY_AFTER_NAMESPACE();
#endif
