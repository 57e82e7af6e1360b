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
  std::uint32_t particle[chunk_size];  ///< theirs
  int count = 0;
  std::span<const Stray> to_come;

  ParticlePointers pointers() {
    ParticlePointers p;
    for (int a = 0; a < 3; ++a) p.s[a] = s[a];
    for (int a = 0; a < 3; ++a) p.v[a] = v[a];
    for (int e = 0; e < 6; ++e) p.h[e] = h[e];
    for (int e = 0; e < 9; ++e) p.affine[e] = affine[e];
    p.kappa = kappa;
    return p;
  }
  ChunkRange range() const { return {0, std::size_t(count), chunk_room, 0}; }
};

/// Calls visit(array of all particles, array of the chunk) for what a stray has.
template <bool with_affine, class Visit>
HWY_INLINE void for_each_array(const ParticlePointers& p, StrayChunk& strays, Visit visit) {
  for (int a = 0; a < 3; ++a) visit(p.s[a], strays.s[a]);
  for (int a = 0; a < 3; ++a) visit(p.v[a], strays.v[a]);
  for (int e = 0; e < 6; ++e) visit(p.h[e], strays.h[e]);
  if (p.kappa) visit(p.kappa, strays.kappa);
  if constexpr (with_affine)
    for (int e = 0; e < 9; ++e) visit(p.affine[e], strays.affine[e]);
}

/// Takes as many of the strays to come as there is room for; `all` false: those only that are not at home.
template <bool all, bool with_affine>
HWY_INLINE void take_strays(const ParticlePointers& p, StrayChunk& strays) {
  std::size_t taken = 0;
  for (strays.count = 0; taken < strays.to_come.size() && strays.count < chunk_size; ++taken)
    if (all || strays.to_come[taken].shift != Index3{}) {
      strays.particle[strays.count] = strays.to_come[taken].particle;
      strays.stray[strays.count++] = &strays.to_come[taken];
    }
  strays.to_come = strays.to_come.subspan(taken);
  for_each_array<with_affine>(p, strays, [&](const double* from, double* to) ANTICRACK_INLINE {
    for (int i = 0; i < strays.count; ++i) to[i] = from[strays.particle[i]];
  });
  for (int a = 0; a < 3; ++a)
    for (int i = 0; i < strays.count; ++i) strays.s[a][i] -= strays.stray[i]->shift[a];
}

template <bool with_affine>
HWY_INLINE void put_back(const ParticlePointers& p, StrayChunk& strays) {
  for_each_array<with_affine>(p, strays, [&](double* to, const double* from) ANTICRACK_INLINE {
    for (int i = 0; i < strays.count; ++i) to[strays.particle[i]] = from[i];
  });
}

/// Asks for what the next chunk takes of its i-th stray.
template <bool with_affine>
HWY_INLINE void prefetch_stray(const ParticlePointers& p, StrayChunk& strays, int i) {
  if (std::size_t(i) >= strays.to_come.size()) return;
  const std::uint32_t particle = strays.to_come[i].particle;
  for_each_array<with_affine>(
      p, strays, [&](const double* from, double*) ANTICRACK_INLINE { hwy::Prefetch(from + particle); });
}

/// Strays [begin, end) of a chunk, all of one block, and the nodes of its tile, from `low` to `high`, that
/// they reach.
struct StrayRun {
  int begin, end, low[3], high[3];
};

/// Calls visit(run, block) for the strays of each block in turn.
template <class Visit>
HWY_INLINE void for_each_run(const SparseGrid& grid, const StrayChunk& strays, Visit visit) {
  for (int begin = 0; begin < strays.count;) {
    StrayRun run{begin, begin, {3, 3, 3}, {0, 0, 0}};
    const std::uint32_t block = strays.stray[begin]->block;
    for (; run.end < strays.count && strays.stray[run.end]->block == block; ++run.end)
      for (int a = 0; a < 3; ++a) {
        const int at = strays.stray[run.end]->cell >> (4 - 2 * a) & 3;
        run.low[a] = std::min(run.low[a], at);
        run.high[a] = std::max(run.high[a], at + 2);
      }
    visit(run, grid.blocks()[block]);
    begin = run.end;
  }
}

/// Calls visit(numbers of nodes of a leaf, the same in the tile, how many) for the nodes that a run reaches;
/// `leaf` are those that its block does.
template <class Visit>
HWY_INLINE void for_each_row(const StrayRun& run, const std::array<Node*, 8>& leaf, Tile& tile, Visit visit) {
  for (int x = run.low[0]; x <= run.high[0]; ++x)
    for (int y = run.low[1]; y <= run.high[1]; ++y)
      for (int oz = 0; oz < 2; ++oz) {
        const int first = std::max(run.low[2], 4 * oz), last = std::min(run.high[2], 4 * oz + 3);
        Node* const nodes = leaf[(x >> 2) * 4 + (y >> 2) * 2 + oz];
        if (first > last || !nodes) continue;
        visit(reinterpret_cast<double*>(nodes + leaf_index(x & 3, y & 3, first & 3)),
              reinterpret_cast<double*>(&tile[(x * tile_edge + y) * tile_edge + first]),
              8 * (last - first + 1));
      }
}

/// Lines 12 and 13, and dt grad v.
template <Transfer transfer>
HWY_INLINE void grid_to_strays(const StepConstants& c, const ParticlePointers& p, const SparseGrid& grid,
                               StrayChunk& strays, Chunk<transfer == Transfer::apic>& chunk) {
  const NodeVector across;
  const OneLane d;
  using V = hn::Vec<OneLane>;
  Tile tile;
  for_each_run(grid, strays, [&](const StrayRun& run, const SparseGrid::Block& block) ANTICRACK_INLINE {
    for_each_row(run, block.nodes, tile, [&](const double* from, double* to, int count) ANTICRACK_INLINE {
      for (int n = 0; n < count; n += int(hn::MaxLanes(across)))
        hn::Store(hn::Load(across, from + n), across, to + n);
    });
    for (int i = run.begin; i < run.end; ++i) {
      prefetch_stray<transfer == Transfer::apic>(p, strays, i);
      const Stray& stray = *strays.stray[i];
      V place[3], s[3], v[3];
      for (int a = 0; a < 3; ++a) place[a] = hn::LoadU(d, strays.s[a] + i);
      for (int a = 0; a < 3; ++a) s[a] = hn::LoadU(d, p.s[a] + strays.particle[i]);
      for (int a = 0; a < 3; ++a) v[a] = hn::LoadU(d, strays.v[a] + i);
      Moved<V> moved[3];
      move_alone<transfer>(c, &tile[first_node_of(stray.cell)], tile_edge * tile_edge, tile_edge, place, s, v,
                           moved);
      for (int a = 0; a < 3; ++a) store_moved<transfer>(d, moved[a], a, i, chunk);
    }
  });
}

/// Adds what the strays contribute to the sums of the groups of their blocks.
template <bool with_affine>
HWY_INLINE void strays_to_grid(const StepConstants& c, const ParticlePointers& p, const SparseGrid& grid,
                               StrayChunk& strays, const Chunk<with_affine>& chunk) {
  const NodeVector d;
  constexpr int lanes = int(hn::MaxLanes(d));
  Tile tile;
  for_each_run(grid, strays, [&](const StrayRun& run, const SparseGrid::Block& block) ANTICRACK_INLINE {
    for_each_row(run, block.partial, tile, [&](const double*, double* nodes, int count) ANTICRACK_INLINE {
      for (int n = 0; n < count; n += lanes) hn::Store(hn::Zero(d), d, nodes + n);
    });
    for (int i = run.begin, end; i < run.end; i = end) {
      const Stray& stray = *strays.stray[i];
      for (end = i; end < run.end && strays.stray[end]->cell == stray.cell; ++end)
        prefetch_stray<with_affine>(p, strays, end);
      add_to_cell(c.full_width, chunk.contributions, i, end, &tile[first_node_of(stray.cell)],
                  tile_edge * tile_edge, tile_edge);
    }
    for_each_row(run, block.partial, tile,
                 [&](double* sums, const double* nodes, int count) ANTICRACK_INLINE {
                   for (int n = 0; n < count; n += lanes)
                     hn::Store(hn::Load(d, sums + n) + hn::Load(d, nodes + n), d, sums + n);
                 });
  });
}

/// The strays that are not at home, chunk by chunk.
template <Model model, Transfer transfer>
void advance_chunks(const StepConstants& c, const ParticlePointers& p, const SparseGrid& grid,
                    std::span<const Stray> all, BlockResult& result) {
  constexpr bool with_affine = transfer == Transfer::apic;
  const ParticleVector d;
  auto sums = zero_sums(d);
  StrayChunk strays;
  Chunk<with_affine> chunk;
  for (strays.to_come = all; !strays.to_come.empty();) {
    take_strays<false, with_affine>(p, strays);
    grid_to_strays<transfer>(c, p, grid, strays, chunk);
    BlockResult of_chunk;
    strain_particles<true>(strays.pointers(), strays.range(), chunk, of_chunk);
    if constexpr (model != Model::hencky)
      return_particles<model>(c, strays.pointers(), strays.range(), chunk, sums);
    store_particles<model, true, false>(c, strays.pointers(), strays.range(), false, chunk, sums, of_chunk);
    put_back<with_affine>(p, strays);
    if (of_chunk.failure && !result.failure)
      result.failure = {strays.particle[of_chunk.failure->particle], of_chunk.failure->quantity};
  }
  reduce(d, sums, false, result.sums);
}

template <bool with_affine>
void scatter_chunks(const StepConstants& c, const ParticlePointers& p, const SparseGrid& grid,
                    std::span<const Stray> all, bool observe, ParticleSums& out) {
  const ParticleVector d;
  auto sums = zero_sums(d);
  StrayChunk strays;
  Chunk<with_affine> chunk;
  for (strays.to_come = all; !strays.to_come.empty();) {
    take_strays<true, with_affine>(p, strays);
    BlockResult unused;  // all are in their true cells, and have been found finite
    strain_particles<false>(strays.pointers(), strays.range(), chunk, unused);
    store_particles<Model::drucker_prager_implicit, false, true>(c, strays.pointers(), strays.range(),
                                                                 observe, chunk, sums, unused);
    strays_to_grid(c, p, grid, strays, chunk);
  }
  reduce(d, sums, observe, out);
}

}  // namespace HWY_NAMESPACE
}  // namespace anticrack
HWY_AFTER_NAMESPACE();
#endif
