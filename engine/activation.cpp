#include "activation.h"

#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <unordered_set>

#include "errors.h"

namespace anticrack {

namespace {

/// Interleaves 19 bits of each coordinate: blocks near in space lie near in memory.
std::uint64_t morton(const Index3& c) {
  std::uint64_t key = 0;
  for (int a = 0; a < 3; ++a) {
    std::uint64_t x = std::uint64_t(c[a]) & 0x7FFFF;
    x = (x | x << 32) & 0x001F00000000FFFFull;
    x = (x | x << 16) & 0x001F0000FF0000FFull;
    x = (x | x << 8) & 0x100F00F00F00F00Full;
    x = (x | x << 4) & 0x10C30C30C30C30C3ull;
    x = (x | x << 2) & 0x1249249249249249ull;
    key |= x << (2 - a);
  }
  return key;
}

/// Order of blocks in space; wraps around at 2^19 blocks, far beyond any sample.
std::uint64_t block_key(const Index3& block) {
  constexpr int bias = 1 << 18;
  return morton({block[0] + bias, block[1] + bias, block[2] + bias});
}

struct DualCell {
  Index3 base;
  double s[3];
};

DualCell dual_cell(const Vec3& position, double cell_size, const Vec3& grid_offset) {
  DualCell c;
  for (int a = 0; a < 3; ++a) {
    const double X = position[a] / cell_size - grid_offset[a] - 0.5;
    if (!(std::abs(X) < 2e9))
      throw InputError("particle position is not finite or too far from the origin: " +
                       std::to_string(position[a]) + " m");
    const double base = std::floor(X);
    c.base[a] = int(base);
    c.s[a] = X - base;
  }
  return c;
}

Index3 block_of(const Index3& cell) {
  return {cell[0] >> 2, cell[1] >> 2, cell[2] >> 2};
}
int cell_in_block(const Index3& cell) {
  return leaf_index(cell[0] & 3, cell[1] & 3, cell[2] & 3);
}

/// Brings `array` into the order new -> old with a buffer of the same size, which takes its place.
void permute(AlignedArray& array, AlignedArray& buffer, const std::vector<std::uint32_t>& order) {
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, order.size(), 1 << 14), [&](const auto& range) {
    for (std::size_t i = range.begin(); i < range.end(); ++i) buffer[i] = array[order[i]];
  });
  std::swap(array, buffer);
}

void permute_all(Particles& particles, const std::vector<std::uint32_t>& order) {
  AlignedArray buffer = AlignedArray::uninitialized(particles.count);
  for (AlignedArray* array : particles.arrays()) permute(*array, buffer, order);
  std::vector<std::uint32_t> id(order.size());
  tbb::parallel_for(std::size_t(0), order.size(), [&](std::size_t i) { id[i] = particles.id[order[i]]; });
  particles.id = std::move(id);
}

/// The leaves that the particles of a block reach from their cells.
std::uint8_t leaves_reached(const CellRanges& cells) {
  std::uint8_t leaves = 0;
  for (int cell = 0; cell < block_cells; ++cell)
    if (cells[cell] < cells[cell + 1]) leaves |= leaves_up_to(farthest_leaf(cell));
  return leaves;
}

bool inside_cell(double s) {
  return s >= 0 && s <= 1;
}

/// Brings strays that ascend by particle into the order of their blocks, cells and particles.
void order_by_cell(std::vector<Stray>& strays, std::size_t blocks) {
  std::vector<std::uint32_t> end(blocks + 1, 0);  // of the strays of the blocks before, then of each
  for (const Stray& stray : strays) ++end[stray.block + 1];
  std::partial_sum(end.begin(), end.end(), end.begin());
  std::vector<Stray> by_block(strays.size());
  for (const Stray& stray : strays) by_block[end[stray.block]++] = stray;
  tbb::parallel_for(std::size_t(0), blocks, [&](std::size_t b) {
    std::array<std::uint32_t, block_cells + 1> to{};
    const std::uint32_t first = b == 0 ? 0 : end[b - 1];
    for (std::uint32_t n = first; n < end[b]; ++n) ++to[by_block[n].cell + 1];
    to[0] = first;
    std::partial_sum(to.begin(), to.end(), to.begin());
    for (std::uint32_t n = first; n < end[b]; ++n) strays[to[by_block[n].cell]++] = by_block[n];
  });
}

}  // namespace

void place_particles(std::span<const Vec3> positions, double cell_size, const Vec3& grid_offset,
                     ParticleFields fields, Particles& particles, SparseGrid& grid,
                     std::vector<CellRanges>& cells) {
  const std::size_t count = positions.size();
  if (count == 0) throw InputError("no particles");
  if (count >= SparseGrid::none) throw InputError("more than 4294967294 particles");
  struct Placed {
    std::uint64_t block, cell_and_id;
    bool operator<(const Placed& o) const {
      return block != o.block ? block < o.block : cell_and_id < o.cell_and_id;
    }
  };
  std::vector<Placed> order(count);
  tbb::parallel_for(std::size_t(0), count, [&](std::size_t i) {
    const Index3 base = dual_cell(positions[i], cell_size, grid_offset).base;
    order[i] = {block_key(block_of(base)), std::uint64_t(cell_in_block(base)) << 32 | i};
  });
  tbb::parallel_sort(order.begin(), order.end());

  particles = {};
  particles.count = count;
  for (auto& a : particles.s) a = AlignedArray(count);
  for (auto& a : particles.v) a = AlignedArray(count);
  for (auto& a : particles.h) a = AlignedArray(count);
  if (fields.kappa) particles.kappa = AlignedArray(count);
  if (fields.affine)
    for (auto& a : particles.affine) a = AlignedArray(count);
  particles.id.resize(count);
  std::vector<BlockReach> reaches;
  cells.clear();
  for (std::size_t n = 0; n < count; ++n) {
    const std::uint32_t i = std::uint32_t(order[n].cell_and_id);
    const DualCell c = dual_cell(positions[i], cell_size, grid_offset);
    for (int a = 0; a < 3; ++a) particles.s[a][n] = c.s[a];
    particles.id[n] = i;
    if (n == 0 || order[n].block != order[n - 1].block) {
      reaches.push_back({block_of(c.base), 0});
      cells.emplace_back();
      cells.back().fill(std::uint32_t(n));
    }
    for (int cell = int(order[n].cell_and_id >> 32) + 1; cell <= block_cells; ++cell)
      cells.back()[cell] = std::uint32_t(n + 1);
  }
  for (std::size_t b = 0; b < cells.size(); ++b) reaches[b].leaves = leaves_reached(cells[b]);
  grid.set_reach(reaches);
}

std::optional<std::uint32_t> locate_strays(std::span<const BlockResult> results, const Particles& particles,
                                           SparseGrid& grid, std::vector<CellRanges>& cells,
                                           std::vector<Stray>& strays) {
  std::vector<std::size_t> first(results.size() + 1, 0);
  for (std::size_t b = 0; b < results.size(); ++b) first[b + 1] = first[b] + results[b].strays.size();
  strays.resize(first.back());
  std::vector<BlockReach> reaches(strays.size());
  constexpr int nowhere = -1;
  tbb::parallel_for(std::size_t(0), results.size(), [&](std::size_t b) {
    const CellRanges& ranges = cells[b];
    int home = 0;
    const BlockReach& own = grid.blocks()[b].reach;
    Index3 entered_origin = own.origin;
    std::uint32_t entered = std::uint32_t(b);
    for (std::size_t n = first[b]; n < first[b + 1]; ++n) {
      const std::uint32_t particle = results[b].strays[n - first[b]];
      const std::uint32_t ahead = results[b].strays[std::min(n + 8, first[b + 1] - 1) - first[b]];
      for (const AlignedArray& s : particles.s) __builtin_prefetch(s.data() + ahead);
      while (ranges[home + 1] <= particle) ++home;  // they ascend
      Stray& stray = strays[n];
      stray = {particle, SparseGrid::none, nowhere, {}};
      Index3 cell = own.origin;
      bool finite = true, stays_in_block = true;
      for (int a = 0; a < 3; ++a) {
        const double s = particles.s[a][particle];
        finite = finite && std::abs(s) < 1e6;
        if (!finite) break;
        stray.shift[a] = inside_cell(s) ? 0 : int(std::floor(s));
        const int in_block = (home >> (4 - 2 * a) & 3) + stray.shift[a];
        stays_in_block = stays_in_block && in_block >= 0 && in_block < block_edge;
        cell[a] = cell[a] * block_edge + in_block;
      }
      if (!finite) continue;
      stray.cell = cell_in_block(cell);
      reaches[n] = {block_of(cell), leaves_up_to(farthest_leaf(stray.cell))};
      // Those that leave mostly go the same way.
      if (!stays_in_block && reaches[n].origin != entered_origin) {
        entered_origin = reaches[n].origin;
        entered = grid.find_block(entered_origin);
      }
      const std::uint32_t block = stays_in_block ? std::uint32_t(b) : entered;
      if (block != SparseGrid::none && grid.blocks()[block].reach.includes(reaches[n].leaves))
        stray.block = block;
    }
  });
  // Few enter blocks or reach leaves that are not active: one after the other, in order.
  for (std::size_t n = 0; n < strays.size(); ++n) {
    if (strays[n].cell == nowhere) return strays[n].particle;
    if (strays[n].block != SparseGrid::none) continue;
    strays[n].block = grid.activate(reaches[n]);
    if (strays[n].block == cells.size()) {
      cells.emplace_back();
      cells.back().fill(std::uint32_t(particles.count));
    }
  }
  order_by_cell(strays, cells.size());
  return {};
}

void sort_particles(std::vector<Stray>& strays, Particles& particles, SparseGrid& grid,
                    std::vector<CellRanges>& cells) {
  const std::size_t old_blocks = grid.blocks().size();
  std::vector<std::uint32_t> first_arrival(old_blocks + 1, std::uint32_t(strays.size()));
  std::vector<char> leaves_cell(particles.count, 0);
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, strays.size(), 1 << 12), [&](const auto& range) {
    for (std::size_t n = range.begin(); n < range.end(); ++n) {
      const Stray& stray = strays[n];
      for (std::uint32_t b = n == 0 ? 0 : strays[n - 1].block + 1; b <= stray.block; ++b)
        first_arrival[b] = std::uint32_t(n);
      leaves_cell[stray.particle] = 1;
      for (int a = 0; a < 3; ++a) particles.s[a][stray.particle] -= stray.shift[a];
    }
  });

  std::vector<std::uint32_t> count(old_blocks, 0);
  tbb::parallel_for(std::size_t(0), old_blocks, [&](std::size_t b) {
    for (std::uint32_t i = cells[b][0]; i < cells[b][block_cells]; ++i) count[b] += !leaves_cell[i];
    count[b] += first_arrival[b + 1] - first_arrival[b];
  });

  struct Kept {
    std::uint64_t key;
    std::uint32_t block, begin;
  };
  std::vector<Kept> kept;
  for (std::uint32_t b = 0; b < old_blocks; ++b)
    if (count[b] > 0) kept.push_back({block_key(grid.blocks()[b].reach.origin), b, 0});
  tbb::parallel_sort(kept.begin(), kept.end(), [](const Kept& a, const Kept& b) { return a.key < b.key; });
  std::uint32_t begin = 0;
  for (Kept& k : kept) {
    k.begin = begin;
    begin += count[k.block];
  }

  std::vector<std::uint32_t> order(particles.count);  // new -> old
  std::vector<CellRanges> new_cells(kept.size());
  std::vector<BlockReach> reaches(kept.size());
  tbb::parallel_for(std::size_t(0), kept.size(), [&](std::size_t n) {
    const std::uint32_t b = kept[n].block;
    std::uint32_t to = kept[n].begin, arrival = first_arrival[b];
    for (int cell = 0; cell < block_cells; ++cell) {
      new_cells[n][cell] = to;
      for (std::uint32_t i = cells[b][cell]; i < cells[b][cell + 1]; ++i)
        if (!leaves_cell[i]) order[to++] = i;
      for (; arrival < first_arrival[b + 1] && strays[arrival].cell == cell; ++arrival)
        order[to++] = strays[arrival].particle;
    }
    new_cells[n][block_cells] = to;
    reaches[n] = {grid.blocks()[b].reach.origin, leaves_reached(new_cells[n])};
  });
  permute_all(particles, order);
  grid.set_reach(reaches);
  cells = std::move(new_cells);
  strays.clear();
}

std::vector<Vec3> world_positions(const Particles& particles, const SparseGrid& grid,
                                  const std::vector<CellRanges>& cells, double cell_size,
                                  const Vec3& grid_offset) {
  std::vector<Vec3> x(particles.count);
  tbb::parallel_for(std::size_t(0), cells.size(), [&](std::size_t b) {
    for (int cell = 0; cell < block_cells; ++cell)
      for (std::uint32_t i = cells[b][cell]; i < cells[b][cell + 1]; ++i)
        for (int a = 0; a < 3; ++a) {
          const int base = grid.blocks()[b].reach.origin[a] * block_edge + (cell >> (4 - 2 * a) & 3);
          x[i][a] = (base + (particles.s[a][i] + 0.5) + grid_offset[a]) * cell_size;
        }
  });
  return x;
}

MemoryEstimate estimate_memory(std::span<const Vec3> positions, double cell_size, const Vec3& grid_offset,
                               ParticleFields fields) {
  Index3 lowest{};  // a simulation counts from there
  for (int a = 0; a < 3 && !positions.empty(); ++a) {
    const auto by_axis = [a](const Vec3& x, const Vec3& y) { return x[a] < y[a]; };
    lowest[a] = dual_cell(*std::ranges::min_element(positions, by_axis), cell_size, grid_offset).base[a];
  }
  std::vector<std::uint64_t> keys(positions.size());  // block, then what is reached there
  tbb::parallel_for(std::size_t(0), positions.size(), [&](std::size_t i) {
    Index3 cell = dual_cell(positions[i], cell_size, grid_offset).base;
    for (int a = 0; a < 3; ++a) cell[a] -= lowest[a];
    keys[i] = block_key(block_of(cell)) << 3 | std::uint64_t(farthest_leaf(cell_in_block(cell)));
  });
  tbb::parallel_sort(keys.begin(), keys.end());
  std::unordered_set<std::uint64_t> leaves, leaves_of_group;
  std::size_t blocks = 0, partials = 0;
  constexpr auto undo = [](std::uint64_t key, int shift) {
    int c = 0;
    for (int bit = 0; bit < 19; ++bit) c |= int(key >> (3 * bit + shift) & 1) << bit;
    return c;
  };
  for (std::size_t i = 0; i < keys.size(); ++i) {
    if (i > 0 && keys[i] == keys[i - 1]) continue;
    const std::uint64_t block = keys[i] >> 3;
    const bool is_new = i == 0 || block != keys[i - 1] >> 3;
    if (is_new && blocks++ % group_blocks == 0) {
      partials += leaves_of_group.size();
      leaves_of_group.clear();
    }
    for (int o = 0; o < 8; ++o) {
      if (!(leaves_up_to(int(keys[i] & 7)) >> o & 1)) continue;
      const std::uint64_t leaf =
          morton({undo(block, 2) + (o >> 2), undo(block, 1) + (o >> 1 & 1), undo(block, 0) + (o & 1)});
      leaves.insert(leaf);
      leaves_of_group.insert(leaf);
    }
  }
  partials += leaves_of_group.size();
  constexpr std::size_t table_entry = 64;
  const std::size_t sort_buffers = sizeof(double) + 2 * sizeof(std::uint32_t) + 1;
  const std::size_t per_particle = Particles::bytes_per_particle(fields) + sort_buffers;
  return {positions.size(), blocks, leaves.size(),
          positions.size() * per_particle + partials * block_cells * sizeof(Node) +
              blocks * (sizeof(SparseGrid::Block) + sizeof(CellRanges) + table_entry) +
              leaves.size() * (block_cells * sizeof(Node) + sizeof(SparseGrid::Leaf) + table_entry)};
}

}  // namespace anticrack
