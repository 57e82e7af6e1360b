#include "io/solid_raster.h"

#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/parallel_for.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstdint>

namespace anticrack {
namespace {

constexpr int edge = SolidRaster::edge;

// Rounds down; a conversion to int is one instruction where std::floor is a call.
int floor_to_int(double x) {
  constexpr double shift = 1 << 24;  // makes every x positive
  return int(x + shift) - int(shift);
}

// The spline of a particle reaches three voxels along each axis; this is the lowest of them.
std::array<int, 3> base_voxel(const std::array<float, 3>& position, double inverse_spacing) {
  std::array<int, 3> base;
  for (int axis = 0; axis < 3; ++axis) base[axis] = floor_to_int(position[axis] * inverse_spacing - 1);
  return base;
}

using Weights = std::array<std::array<float, 4>, 3>;  // the fourth is 0: so many fill a vector

Weights spline_weights(const std::array<float, 3>& position, const std::array<int, 3>& base,
                       double inverse_spacing) {
  Weights weights;
  for (int axis = 0; axis < 3; ++axis) {
    // From the lowest voxel's centre, in [1/2, 3/2); centres are at whole numbers plus 1/2.
    const float d = float(position[axis] * inverse_spacing - 0.5 - base[axis]);
    weights[axis] = {0.5f * (1.5f - d) * (1.5f - d), 0.75f - (d - 1) * (d - 1),
                     0.5f * (d - 0.5f) * (d - 0.5f), 0};
  }
  return weights;
}

// Block coordinates in one number whose order is that of (x, y, z); 21 bits an axis.
using BlockKey = std::uint64_t;
constexpr std::int64_t key_offset = 1 << 20;

BlockKey key_of(const std::array<int, 3>& block) {
  return BlockKey(block[0] + key_offset) << 42 | BlockKey(block[1] + key_offset) << 21 |
         BlockKey(block[2] + key_offset);
}

std::array<int, 3> block_of(BlockKey key) {
  constexpr BlockKey mask = (1 << 21) - 1;
  return {int(std::int64_t(key >> 42) - key_offset), int(std::int64_t(key >> 21 & mask) - key_offset),
          int(std::int64_t(key & mask) - key_offset)};
}

// Successive particles whose base voxel lies in one block.
struct Run {
  BlockKey key;
  std::uint32_t begin, end;
};

std::vector<Run> runs_by_block(std::span<const std::array<float, 3>> position, double inverse_spacing) {
  std::vector<BlockKey> key(position.size());
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, key.size(), 1 << 14), [&](const auto& range) {
    for (std::size_t i = range.begin(); i != range.end(); ++i) {
      const auto [x, y, z] = base_voxel(position[i], inverse_spacing);
      key[i] = key_of({x >> 3, y >> 3, z >> 3});
    }
  });
  std::vector<Run> runs;
  for (std::uint32_t i = 0; i < key.size(); ++i) {
    if (runs.empty() || runs.back().key != key[i]) runs.push_back({key[i], i, i});
    runs.back().end = i + 1;
  }
  std::ranges::sort(runs, {}, [](const Run& run) { return std::pair(run.key, run.begin); });
  return runs;
}

// Stencils reach two voxels up, so a block takes from itself and the seven below it.
std::vector<BlockKey> blocks_reached(const std::vector<Run>& runs) {
  std::vector<BlockKey> keys;
  for (std::size_t i = 0; i < runs.size(); ++i) {
    if (i > 0 && runs[i].key == runs[i - 1].key) continue;
    const auto block = block_of(runs[i].key);
    for (int corner = 0; corner < 8; ++corner)
      keys.push_back(
          key_of({block[0] + (corner >> 2), block[1] + (corner >> 1 & 1), block[2] + (corner & 1)}));
  }
  std::ranges::sort(keys);
  const auto repeated = std::ranges::unique(keys);
  keys.erase(repeated.begin(), repeated.end());
  return keys;
}

// Sums over a block with two voxels to spare on each side, so that no stencil needs a bounds check, and one
// more at the end for the last fourth weight.
struct Tile {
  static constexpr int width = edge + 4;
  std::array<float, width * width * width + 1> solid{};
  std::array<float, width * width * width + 1> solid_kappa{};

  static constexpr int at(int x, int y, int z) { return ((x + 2) * width + y + 2) * width + z + 2; }

  void add(const std::array<int, 3>& base, const Weights& weights, float kappa) {
    const int lowest = at(base[0], base[1], base[2]);
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) {
        const float weight_xy = weights[0][i] * weights[1][j];
        using Vector = Eigen::Array4f;
        const Vector weight = weight_xy * Vector::Map(weights[2].data());
        Vector::Map(&solid[lowest + (i * width + j) * width]) += weight;
        Vector::Map(&solid_kappa[lowest + (i * width + j) * width]) += weight * kappa;
      }
    }
  }
};

}  // namespace

SolidRaster rasterize_solid(std::span<const std::array<float, 3>> position, std::span<const float> kappa,
                            double spacing) {
  const double inverse_spacing = 1 / spacing;
  const auto runs = runs_by_block(position, inverse_spacing);
  const auto keys = blocks_reached(runs);

  SolidRaster raster;
  raster.origin.resize(keys.size());
  raster.solid.resize(keys.size());
  if (!kappa.empty()) raster.kappa.resize(keys.size());
  std::vector<char> has_solid(keys.size());

  tbb::parallel_for(std::size_t(0), keys.size(), [&](std::size_t b) {
    const auto block = block_of(keys[b]);
    const std::array<int, 3> origin = {block[0] * edge, block[1] * edge, block[2] * edge};
    Tile tile;
    for (int corner = 0; corner < 8; ++corner) {
      const BlockKey source =
          key_of({block[0] - (corner >> 2), block[1] - (corner >> 1 & 1), block[2] - (corner & 1)});
      for (auto run = std::ranges::lower_bound(runs, source, {}, &Run::key);
           run != runs.end() && run->key == source; ++run) {
        for (std::uint32_t i = run->begin; i < run->end; ++i) {
          const auto base = base_voxel(position[i], inverse_spacing);
          const std::array<int, 3> local = {base[0] - origin[0], base[1] - origin[1], base[2] - origin[2]};
          // From a block below, only the last two layers of base voxels reach up here.
          if (local[0] < -2 || local[1] < -2 || local[2] < -2) continue;
          tile.add(local, spline_weights(position[i], base, inverse_spacing), kappa.empty() ? 0 : kappa[i]);
        }
      }
    }

    raster.origin[b] = origin;
    int voxel = 0;
    for (int x = 0; x < edge; ++x) {
      for (int y = 0; y < edge; ++y) {
        for (int z = 0; z < edge; ++z, ++voxel) {
          const float solid = tile.solid[Tile::at(x, y, z)];
          raster.solid[b][voxel] = solid;
          has_solid[b] |= solid > 0;
          if (!kappa.empty())
            raster.kappa[b][voxel] = solid > 0 ? tile.solid_kappa[Tile::at(x, y, z)] / solid : 0;
        }
      }
    }
  });

  // Close the gaps of the blocks that nothing reached.
  std::size_t kept = 0;
  for (std::size_t b = 0; b < keys.size(); ++b) {
    if (!has_solid[b]) continue;
    if (kept != b) {
      raster.origin[kept] = raster.origin[b];
      raster.solid[kept] = raster.solid[b];
      if (!kappa.empty()) raster.kappa[kept] = raster.kappa[b];
    }
    ++kept;
  }
  raster.origin.resize(kept);
  raster.solid.resize(kept);
  if (!kappa.empty()) raster.kappa.resize(kept);
  return raster;
}

}  // namespace anticrack
