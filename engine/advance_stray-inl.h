// Strays: the same lines as in advance_particles-inl.h, by the same functions. A chunk of strays is copied
// side by side, each in its true cell, so that every lane is full in the material. Per-target include guard.
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

/// Copies of up to `chunk_size` strays; s is the place in the true cell. What a scene has no array for is 0.
struct alignas(64) StrayChunk {
  double s[3][chunk_room] = {}, v[3][chunk_room] = {}, h[6][chunk_room] = {}, kappa[chunk_room] = {},
         affine[9][chunk_room] = {};
  const Stray* stray[chunk_size];
  int count = 0;

  ParticlePointers pointers() {
    ParticlePointers p;
    for (int a = 0; a < 3; ++a) p.s[a] = s[a];
    for (int a = 0; a < 3; ++a) p.v[a] = v[a];
    for (int e = 0; e < 6; ++e) p.h[e] = h[e];
    for (int e = 0; e < 9; ++e) p.affine[e] = affine[e];
    p.kappa = kappa;
    return p;
  }
  /// All lanes of the last vector may be written.
  ChunkRange range() const { return {0, std::size_t(count), chunk_room}; }
};

/// Calls visit(a number of all particles, the same of the chunk) for all that a stray has but s.
template <bool with_affine, class Visit>
HWY_INLINE void for_each_number(const ParticlePointers& p, StrayChunk& chunk, Visit visit) {
  for (int a = 0; a < 3; ++a) visit(p.v[a], chunk.v[a]);
  for (int e = 0; e < 6; ++e) visit(p.h[e], chunk.h[e]);
  if (p.kappa) visit(p.kappa, chunk.kappa);
  if constexpr (with_affine)
    for (int e = 0; e < 9; ++e) visit(p.affine[e], chunk.affine[e]);
}

/// Takes strays from `next` on, those only that are `away` from home if so asked, while there is room.
template <bool with_affine>
HWY_INLINE void take_strays(const ParticlePointers& p, bool away, const Stray*& next, const Stray* last,
                            StrayChunk& chunk) {
  chunk.count = 0;
  for (; next != last && chunk.count < chunk_size; ++next)
    if (!away || next->shift != Index3{}) chunk.stray[chunk.count++] = next;
  for (int a = 0; a < 3; ++a)
    for (int i = 0; i < chunk.count; ++i)
      chunk.s[a][i] = p.s[a][chunk.stray[i]->particle] - double(chunk.stray[i]->shift[a]);
  for_each_number<with_affine>(p, chunk, [&](const double* from, double* to) {
    for (int i = 0; i < chunk.count; ++i) to[i] = from[chunk.stray[i]->particle];
  });
}

template <bool with_affine>
HWY_INLINE void put_back(const ParticlePointers& p, StrayChunk& chunk) {
  for (int a = 0; a < 3; ++a)
    for (int i = 0; i < chunk.count; ++i) p.s[a][chunk.stray[i]->particle] = chunk.s[a][i];
  for_each_number<with_affine>(p, chunk, [&](double* to, const double* from) {
    for (int i = 0; i < chunk.count; ++i) to[chunk.stray[i]->particle] = from[i];
  });
}

/// Calls visit(node, k) for the 27 nodes of a cell, z fastest; `leaf` are the nodes of the leaves that its
/// block reaches.
template <class N, class Visit>
HWY_INLINE void for_each_node(N* const (&leaf)[8], int cell, Visit visit) {
  for (int k = 0; k < 27; ++k) {
    const int x = (cell >> 4) + k / 9, y = (cell >> 2 & 3) + k / 3 % 3, z = (cell & 3) + k % 3;
    visit(leaf[(x >> 2) * 4 + (y >> 2) * 2 + (z >> 2)] + leaf_index(x & 3, y & 3, z & 3), k);
  }
}

/// Whether the `i`-th stray of the chunk is the first of its cell.
inline bool first_of_cell(const StrayChunk& chunk, int i) {
  if (i == 0) return true;
  const Stray &stray = *chunk.stray[i], &before = *chunk.stray[i - 1];
  return stray.block != before.block || stray.cell != before.cell;
}

/// Lines 12 and 13, and dt grad v.
template <Transfer transfer>
HWY_INLINE void grid_to_strays(const StepConstants& c, const ParticlePointers& p, const SparseGrid& grid,
                               const StrayChunk& strays, Chunk<transfer == Transfer::apic>& chunk) {
  const OneLane d;
  using V = hn::Vec<OneLane>;
  Node nodes[27];
  for (int i = 0; i < strays.count; ++i) {
    const Stray& stray = *strays.stray[i];
    if (first_of_cell(strays, i)) {
      const Node* leaf[8];
      for (int o = 0; o < 8; ++o) leaf[o] = grid.leaves()[grid.blocks()[stray.block].leaf[o]].nodes;
      for_each_node(leaf, stray.cell, [&](const Node* node, int k) { nodes[k] = *node; });
    }
    V place[3], s[3], v[3];
    for (int a = 0; a < 3; ++a) place[a] = hn::LoadU(d, strays.s[a] + i);
    for (int a = 0; a < 3; ++a) s[a] = hn::LoadU(d, p.s[a] + stray.particle);
    for (int a = 0; a < 3; ++a) v[a] = hn::LoadU(d, strays.v[a] + i);
    Moved<V> moved[3];
    move_alone<transfer>(c, nodes, 9, 3, place, s, v, moved);
    for (int a = 0; a < 3; ++a) store_moved<transfer>(d, moved[a], a, i, chunk);
  }
}

/// Adds what the strays contribute to the sums of the groups of their blocks.
template <bool with_affine>
HWY_INLINE void strays_to_grid(const StepConstants& c, const SparseGrid& grid, const StrayChunk& strays,
                               const Chunk<with_affine>& chunk) {
  const NodeVector d;
  for (int i = 0, end; i < strays.count; i = end) {
    for (end = i + 1; end < strays.count && !first_of_cell(strays, end);) ++end;
    Node nodes[27] = {};
    add_to_cell(c.full_width, chunk.contributions, i, end, nodes, 9, 3);
    const Stray& stray = *strays.stray[i];
    Node* leaf[8];
    for (int o = 0; o < 8; ++o) leaf[o] = grid.blocks()[stray.block].partial[o];
    for_each_node(leaf, stray.cell, [&](Node* node, int k) ANTICRACK_INLINE {
      for (int n = 0; n < 8; n += int(hn::MaxLanes(d))) {
        double* const to = reinterpret_cast<double*>(node) + n;
        hn::Store(hn::Load(d, to) + hn::Load(d, reinterpret_cast<double*>(nodes + k) + n), d, to);
      }
    });
  }
}

template <Model model, Transfer transfer>
void advance_chunks(const StepConstants& c, const ParticlePointers& p, const SparseGrid& grid,
                    std::span<const Stray> strays, BlockResult& result) {
  constexpr bool with_affine = transfer == Transfer::apic;
  const ParticleVector d;
  auto sums = zero_sums(d);
  StrayChunk copies;
  Chunk<with_affine> chunk;
  const Stray* next = strays.data();
  for (const Stray* const last = next + strays.size(); next != last;) {
    take_strays<with_affine>(p, true, next, last, copies);
    grid_to_strays<transfer>(c, p, grid, copies, chunk);
    BlockResult of_chunk;
    strain_particles<true>(copies.pointers(), copies.range(), chunk, of_chunk);
    return_particles<model, true, false>(c, copies.pointers(), copies.range(), false, chunk, sums, of_chunk);
    put_back<with_affine>(p, copies);
    if (of_chunk.failure && !result.failure)
      result.failure = {copies.stray[of_chunk.failure->particle]->particle, of_chunk.failure->quantity};
  }
  reduce(d, sums, false, result.sums);
}

template <bool with_affine>
void scatter_chunks(const StepConstants& c, const ParticlePointers& p, const SparseGrid& grid,
                    std::span<const Stray> strays, bool observe, ParticleSums& out) {
  const ParticleVector d;
  auto sums = zero_sums(d);
  StrayChunk copies;
  Chunk<with_affine> chunk;
  const Stray* next = strays.data();
  for (const Stray* const last = next + strays.size(); next != last;) {
    take_strays<with_affine>(p, false, next, last, copies);
    BlockResult unused;  // nothing can fail or leave its cell here
    strain_particles<false>(copies.pointers(), copies.range(), chunk, unused);
    return_particles<Model::drucker_prager_implicit, false, true>(c, copies.pointers(), copies.range(),
                                                                  observe, chunk, sums, unused);
    strays_to_grid(c, grid, copies, chunk);
  }
  reduce(d, sums, observe, out);
}

}  // namespace HWY_NAMESPACE
}  // namespace anticrack
HWY_AFTER_NAMESPACE();
#endif
