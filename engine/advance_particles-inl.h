// One pass over particles: grid to particle, material, and particle to grid of the next step. Per-target
// include guard.
#if defined(ANTICRACK_ADVANCE_PARTICLES_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef ANTICRACK_ADVANCE_PARTICLES_INL_H
#undef ANTICRACK_ADVANCE_PARTICLES_INL_H
#else
#define ANTICRACK_ADVANCE_PARTICLES_INL_H
#endif

#include <algorithm>
#include <cmath>
#include <cstring>

#include "kernels.h"
#include "material/drucker_prager_softening-inl.h"
#include "material/hencky-inl.h"
#include "transfer/grid_to_particles-inl.h"
#include "transfer/particles_to_grid-inl.h"

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

/// State of a batch in registers.
template <class V>
struct Batch {
  V s[3], v[3];
  Symmetric<V> h;
  V kappa;
};

template <class D, class V = hn::Vec<D>, class M = hn::Mask<D>>
HWY_INLINE Batch<V> load_batch(D d, const ParticlePointers& p, std::size_t i, M active, bool has_kappa) {
  Batch<V> b;
  for (int a = 0; a < 3; ++a) b.s[a] = hn::MaskedLoad(active, d, p.s[a] + i);
  for (int a = 0; a < 3; ++a) b.v[a] = hn::MaskedLoad(active, d, p.v[a] + i);
  V* const h[6] = {&b.h.xx, &b.h.yy, &b.h.zz, &b.h.xy, &b.h.xz, &b.h.yz};
  for (int e = 0; e < 6; ++e) *h[e] = hn::MaskedLoad(active, d, p.h[e] + i);
  b.kappa = has_kappa ? hn::MaskedLoad(active, d, p.kappa + i) : hn::Zero(d);
  return b;
}

/// `full`: every lane may be written. Masked stores are slow where they are microcode (AMD).
template <class D, class V = hn::Vec<D>, class M = hn::Mask<D>>
HWY_INLINE void store_batch(D d, const ParticlePointers& p, std::size_t i, bool full, M active, bool has_kappa,
                            const Batch<V>& b) {
  const auto store = [&](V value, double* to) HWY_ATTR {
    if (HWY_LIKELY(full))
      hn::StoreU(value, d, to);
    else
      hn::BlendedStore(value, active, d, to);
  };
  for (int a = 0; a < 3; ++a) store(b.s[a], p.s[a] + i);
  for (int a = 0; a < 3; ++a) store(b.v[a], p.v[a] + i);
  const V* const h[6] = {&b.h.xx, &b.h.yy, &b.h.zz, &b.h.xy, &b.h.xz, &b.h.yz};
  for (int e = 0; e < 6; ++e) store(*h[e], p.h[e] + i);
  if (has_kappa) store(b.kappa, p.kappa + i);
}

template <class D, class V = hn::Vec<D>>
HWY_INLINE hn::Mask<D> inside_cell(D d, const V (&s)[3]) {
  const V zero = hn::Zero(d), one = hn::Set(d, 1.0);
  hn::Mask<D> inside = hn::And(s[0] >= zero, s[0] <= one);
  for (int a = 1; a < 3; ++a) inside = hn::And(inside, hn::And(s[a] >= zero, s[a] <= one));
  return inside;
}

/// psi = K/2 (tr eps)^2 + mu |dev eps|^2, Eq. 6.
template <class D, class V = hn::Vec<D>>
HWY_INLINE V energy_density(D d, const MaterialConstants& m, V trace, V norm) {
  return hn::MulAdd(hn::Set(d, 0.5 * m.bulk_modulus) * trace, trace, hn::Set(d, m.mu) * norm * norm);
}

/// Velocity and place after the step, and the gradient that strains the particle.
template <class V>
struct Moved {
  V s[3], v[3];
  V L[3][3];  ///< dt grad v
};

/// Lines 12 and 13 of Algorithm 1, and dt grad v for line 7; `place` is relative to the cell of `grid`, `s` to the
/// particle's own.
template <class D, class V = hn::Vec<D>>
HWY_INLINE Moved<V> interpolate(D d, const StepConstants& c, const CellPolynomial& grid, const V (&place)[3],
                                const V (&s)[3], const V (&v)[3]) {
  const V dt_over_dx = hn::Set(d, c.dt / c.cell_size), flip = hn::Set(d, c.flip);
  const Place<V> at = place_of(d, place);
  Moved<V> moved;
  for (int a = 0; a < 3; ++a) {
    const Sampled<V> pic = sample<true>(d, grid, a, at);
    const Sampled<V> dv = sample<false>(d, grid, a + 4, at);
    moved.s[a] = hn::MulAdd(dt_over_dx, pic.value, s[a]);                       // line 13
    moved.v[a] = hn::MulAdd(flip, v[a] + dv.value - pic.value, pic.value);  // line 12
    for (int e = 0; e < 3; ++e) moved.L[a][e] = dt_over_dx * pic.gradient[e];
  }
  return moved;
}

/// Lines 7-11: the elastic state h and kappa of the lanes `active` after a step of dt grad v = L. Returns the
/// Hencky strain of the new state; `failed` gets the lanes whose I + L is inverted or whose state is not finite.
template <Model model, class D, class V = hn::Vec<D>, class M = hn::Mask<D>>
HWY_INLINE HenckyStrain<V> update_material(D d, const StepConstants& c, const V (&L)[3][3], M active, Batch<V>& b,
                                           LaneSums<V>& sums, M& failed) {
  constexpr bool plastic = model != Model::hencky;
  const V one = hn::Set(d, 1.0);
  // Line 7 in b: b_tr = (I + L) b (I + L)^T, and with M = L b: h_tr = h + M + M^T + M L^T.
  const Symmetric<V> h = b.h;
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
  failed = hn::AndNot(det > hn::Zero(d), active);
  b.h = {hn::IfThenElseZero(active, trial[0]), hn::IfThenElseZero(active, trial[1]),
         hn::IfThenElseZero(active, trial[2]), hn::IfThenElseZero(active, trial[3]),
         hn::IfThenElseZero(active, trial[4]), hn::IfThenElseZero(active, trial[5])};

  HenckyStrain<V> strain = hencky_strain(d, b.h);  // lines 8, 9
  if constexpr (plastic) {                         // lines 10, 11
    const Returned<D> r = return_to_yield_surface<model>(d, c.material, strain.trace, strain.norm, b.kappa);
    const M yielded = hn::And(active, r.yielded);
    if (!hn::AllFalse(d, yielded)) {
      b.kappa = hn::IfThenElse(yielded, r.kappa, b.kappa);
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
      b.h = {hn::IfThenElse(yielded, returned.xx, b.h.xx), hn::IfThenElse(yielded, returned.yy, b.h.yy),
             hn::IfThenElse(yielded, returned.zz, b.h.zz), hn::IfThenElse(yielded, returned.xy, b.h.xy),
             hn::IfThenElse(yielded, returned.xz, b.h.xz), hn::IfThenElse(yielded, returned.yz, b.h.yz)};
      // The stress is always that of the stored state, so that a resumed run has the same bits.
      strain = hencky_strain(d, b.h);
    }
  }
  b.h = {hn::IfThenElse(active, b.h.xx, h.xx), hn::IfThenElse(active, b.h.yy, h.yy),
         hn::IfThenElse(active, b.h.zz, h.zz), hn::IfThenElse(active, b.h.xy, h.xy),
         hn::IfThenElse(active, b.h.xz, h.xz), hn::IfThenElse(active, b.h.yz, h.yz)};
  const V speed = hn::Abs(b.v[0]) + hn::Abs(b.v[1]) + hn::Abs(b.v[2]);
  const V size = strain.norm + hn::Abs(strain.trace) + speed + b.kappa;
  failed = hn::Or(failed, hn::AndNot(size < hn::Set(d, 1e300), active));
  return strain;
}

/// What the lanes `active`, at `place` in their cell, give to the grid, as particles `first`, `first` + 1, ... of
/// `giving`; and what the observables need.
template <class D, int size, class V = hn::Vec<D>, class M = hn::Mask<D>>
HWY_INLINE void give(D d, const StepConstants& c, const V (&place)[3], M active, const Batch<V>& b,
                     const HenckyStrain<V>& strain, int first, Giving<size>& giving, bool observe, LaneSums<V>& sums) {
  const V two_mu = hn::Set(d, 2 * c.material.mu);
  const V trace = hn::IfThenElseZero(active, strain.trace), norm = hn::IfThenElseZero(active, strain.norm);
  const V minus_p = hn::Set(d, c.material.bulk_modulus) * trace;
  const Symmetric<V>& dev = strain.deviator;
  const Symmetric<V> tau{hn::IfThenElseZero(active, hn::MulAdd(two_mu, dev.xx, minus_p)),
                         hn::IfThenElseZero(active, hn::MulAdd(two_mu, dev.yy, minus_p)),
                         hn::IfThenElseZero(active, hn::MulAdd(two_mu, dev.zz, minus_p)),
                         hn::IfThenElseZero(active, two_mu * dev.xy),
                         hn::IfThenElseZero(active, two_mu * dev.xz),
                         hn::IfThenElseZero(active, two_mu * dev.yz)};  // Eq. 7
  const V f = hn::Set(d, -c.volume / c.cell_size);
  const V mass = hn::IfThenElseZero(active, hn::Set(d, c.mass));
  const V v[3] = {hn::IfThenElseZero(active, b.v[0]), hn::IfThenElseZero(active, b.v[1]),
                  hn::IfThenElseZero(active, b.v[2])};
  const V momentum[3] = {mass * v[0], mass * v[1], mass * v[2]};
  const V s[3] = {hn::IfThenElseZero(active, place[0]), hn::IfThenElseZero(active, place[1]),
                  hn::IfThenElseZero(active, place[2])};
  note_giving(d, s, momentum, mass, {f * tau.xx, f * tau.yy, f * tau.zz, f * tau.xy, f * tau.xz, f * tau.yz}, first,
              giving);

  const V speed_squared = hn::MulAdd(v[0], v[0], hn::MulAdd(v[1], v[1], v[2] * v[2]));
  const V q = hn::Set(d, std::sqrt(6.0) * c.material.mu) * norm;  // sqrt(3/2) |dev tau|
  sums.speed_squared = sums.speed_squared + speed_squared;
  sums.max_speed_squared = hn::Max(sums.max_speed_squared, speed_squared);
  sums.max_compression =
      hn::Max(sums.max_compression, hn::MulAdd(hn::Set(d, 2.0 / 3.0), q, hn::Neg(minus_p)));
  if (HWY_UNLIKELY(observe)) {
    const V J = hn::IfThenElseZero(active, hn::Exp(d, trace));
    const V* const t[6] = {&tau.xx, &tau.yy, &tau.zz, &tau.xy, &tau.xz, &tau.yz};
    for (int e = 0; e < 6; ++e) sums.tau[e] = sums.tau[e] + *t[e];
    for (int e = 0; e < 6; ++e) sums.tau_J[e] = hn::MulAdd(*t[e], J, sums.tau_J[e]);
    sums.q = sums.q + q;
    sums.J = sums.J + J;
    sums.elastic_energy = sums.elastic_energy + energy_density(d, c.material, trace, norm);
    sums.plastic = sums.plastic + hn::IfThenElseZero(hn::And(active, b.kappa > hn::Zero(d)), hn::Set(d, 1.0));
  }
}

template <class D, class M = hn::Mask<D>>
HWY_INLINE void note_failure(D d, M failed, std::size_t first, BlockResult& result) {
  if (HWY_UNLIKELY(!hn::AllFalse(d, failed)) && !result.failure)
    result.failure = {std::uint32_t(first + hn::FindFirstTrue(d, failed)),
                      "det(I + dt grad v), its velocity, elastic strain or kappa"};
}

/// Consecutive particles of a block on their way from the grid through the material to the grid.
constexpr int chunk_size = 40;
constexpr int chunk_room = chunk_size + 8;  ///< vectors may write beyond the last particle

/// `Moved` for the particles of a chunk.
struct alignas(64) MovedChunk {
  double s[3][chunk_room], v[3][chunk_room], L[9][chunk_room];
};

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

/// Calls visit(first node of the cell in a tile, from, to) for the cells of particles [begin, end).
template <class Visit>
HWY_INLINE void for_each_cell(const BlockView& block, std::size_t begin, std::size_t end, Visit visit) {
  int cell = int(std::upper_bound(block.cell_begin, block.cell_begin + block_cells, begin) - block.cell_begin) - 1;
  for (std::size_t from = begin; from < end; ++cell) {
    const std::size_t to = std::min<std::size_t>(block.cell_begin[cell + 1], end);
    if (to > from) visit(((cell >> 4) * tile_edge + (cell >> 2 & 3)) * tile_edge + (cell & 3), from, to);
    from = to;
  }
}

/// The particles at home in a block, chunk by chunk: grid to particle cell by cell, material with every lane full,
/// particle to grid cell by cell. `advancing` false: particle to grid alone.
template <Model model, bool advancing>
void pass_over_block(const StepConstants& c, const ParticlePointers& p, const BlockView& block, bool observe,
                     BlockResult& result) {
  using D = hn::CappedTag<double, 8>;
  using V = hn::Vec<D>;
  const D d;
  constexpr std::size_t lanes = hn::MaxLanes(d);
  constexpr bool plastic = model != Model::hencky;
  constexpr int stride_x = tile_edge * tile_edge, stride_y = tile_edge;

  Tile nodes;
  if constexpr (advancing) gather_nodes(block, nodes);
  std::memset(static_cast<void*>(block.tile), 0, sizeof(Tile));

  LaneSums<V> sums = zero_sums(d);
  MovedChunk moved;
  Giving<chunk_room> giving;
  const std::size_t last = block.cell_begin[block_cells];
  for (std::size_t begin = block.cell_begin[0], end; begin < last; begin = end) {
    // As many whole cells as fit, or a part of one.
    end = *(std::upper_bound(block.cell_begin, block.cell_begin + block_cells + 1, begin + chunk_size) - 1);
    if (end == begin) end = begin + chunk_size;

    if constexpr (advancing)
      for_each_cell(block, begin, end, [&](int first_node, std::size_t from, std::size_t to) HWY_ATTR {
        CellPolynomial grid;
        make_polynomial<8>(&nodes[first_node], stride_x, stride_y, grid);
        for (std::size_t i = from; i < to; i += lanes) {
          const auto here = hn::FirstN(d, to - i);
          V s[3], v[3];
          for (int a = 0; a < 3; ++a) s[a] = hn::MaskedLoad(here, d, p.s[a] + i);
          for (int a = 0; a < 3; ++a) v[a] = hn::MaskedLoad(here, d, p.v[a] + i);
          const Moved<V> m = interpolate(d, c, grid, s, s, v);
          for (int a = 0; a < 3; ++a) hn::StoreU(m.s[a], d, moved.s[a] + (i - begin));
          for (int a = 0; a < 3; ++a) hn::StoreU(m.v[a], d, moved.v[a] + (i - begin));
          for (int e = 0; e < 9; ++e) hn::StoreU(m.L[e / 3][e % 3], d, moved.L[e] + (i - begin));
        }
      });

    for (std::size_t i = begin; i < end; i += lanes) {
      const auto ours = hn::FirstN(d, last - i), stored = hn::FirstN(d, end - i);
      Batch<V> b = load_batch(d, p, i, ours, plastic);
      const auto home = hn::And(stored, inside_cell(d, b.s));
      HenckyStrain<V> strain;
      hn::Mask<D> staying = home;
      if constexpr (advancing) {
        V L[3][3];
        for (int e = 0; e < 9; ++e) L[e / 3][e % 3] = hn::IfThenElseZero(home, hn::LoadU(d, moved.L[e] + (i - begin)));
        for (int a = 0; a < 3; ++a) b.s[a] = hn::IfThenElse(home, hn::LoadU(d, moved.s[a] + (i - begin)), b.s[a]);
        for (int a = 0; a < 3; ++a) b.v[a] = hn::IfThenElse(home, hn::LoadU(d, moved.v[a] + (i - begin)), b.v[a]);
        hn::Mask<D> failed;
        strain = update_material<model>(d, c, L, home, b, sums, failed);
        note_failure(d, failed, i, result);
        store_batch(d, p, i, i + lanes <= last, ours, plastic, b);
        staying = hn::And(home, inside_cell(d, b.s));
      } else {
        strain = hencky_strain(d, b.h);
      }
      give(d, c, b.s, staying, b, strain, int(i - begin), giving, observe, sums);
      if (HWY_UNLIKELY(!hn::AllTrue(d, hn::Or(staying, hn::Not(stored)))))
        for (std::size_t l = i; l < std::min(i + lanes, end); ++l)
          if (!(p.s[0][l] >= 0 && p.s[0][l] <= 1 && p.s[1][l] >= 0 && p.s[1][l] <= 1 && p.s[2][l] >= 0 &&
                p.s[2][l] <= 1))
            result.strays.push_back(std::uint32_t(l));
    }

    asm volatile("" ::: "memory");  // see make_polynomial
    for_each_cell(block, begin, end, [&](int first_node, std::size_t from, std::size_t to) HWY_ATTR {
      add_to_cell(giving, int(from - begin), int(to - begin), &(*block.tile)[first_node], stride_x, stride_y);
    });
  }
  reduce(d, sums, observe, result.sums);
}

using OneLane = hn::CappedTag<double, 1>;

HWY_INLINE void shifted(const Batch<hn::Vec<OneLane>>& b, const Index3& shift, hn::Vec<OneLane> (&place)[3]) {
  const OneLane d;
  for (int a = 0; a < 3; ++a) place[a] = b.s[a] - hn::Set(d, double(shift[a]));
}

template <Model model>
void advance_one(const StepConstants& c, const ParticlePointers& p, std::uint32_t particle,
                 const Node nodes[27], const Index3& shift, BlockResult& result) {
  const OneLane d;
  constexpr bool plastic = model != Model::hencky;
  const auto all = hn::FirstN(d, 1);
  CellPolynomial grid;
  make_polynomial<8>(nodes, 9, 3, grid);
  Batch<hn::Vec<OneLane>> b = load_batch(d, p, particle, all, plastic);
  hn::Vec<OneLane> place[3];
  shifted(b, shift, place);
  const Moved<hn::Vec<OneLane>> moved = interpolate(d, c, grid, place, b.s, b.v);
  for (int a = 0; a < 3; ++a) b.s[a] = moved.s[a];
  for (int a = 0; a < 3; ++a) b.v[a] = moved.v[a];
  LaneSums<hn::Vec<OneLane>> sums = zero_sums(d);
  hn::Mask<OneLane> failed;
  update_material<model>(d, c, moved.L, all, b, sums, failed);
  note_failure(d, failed, particle, result);
  store_batch(d, p, particle, true, all, plastic, b);
  reduce(d, sums, false, result.sums);
}

template <Model model>
void scatter_one(const StepConstants& c, const ParticlePointers& p, std::uint32_t particle,
                 const Index3& shift, Node* first, bool observe, ParticleSums& out) {
  const OneLane d;
  const auto all = hn::FirstN(d, 1);
  const Batch<hn::Vec<OneLane>> b = load_batch(d, p, particle, all, model != Model::hencky);
  hn::Vec<OneLane> place[3];
  shifted(b, shift, place);
  LaneSums<hn::Vec<OneLane>> sums = zero_sums(d);
  Giving<1> giving;
  give(d, c, place, all, b, hencky_strain(d, b.h), 0, giving, observe, sums);
  add_to_cell(giving, 0, 1, first, tile_edge * tile_edge, tile_edge);
  reduce(d, sums, observe, out);
}

}  // namespace HWY_NAMESPACE
}  // namespace anticrack
HWY_AFTER_NAMESPACE();
#endif
