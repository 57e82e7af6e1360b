#include "solid_field.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <string>

#include "errors.h"

namespace anticrack {

namespace {

constexpr int edge = SolidField::edge;
constexpr int tile_edge = edge + 2;  // a quadratic spline reaches two nodes beyond its first
constexpr int key_bits = 21;
constexpr int key_offset = 1 << (key_bits - 1);

using Index = std::array<int, 3>;

std::uint64_t key_of(const Index& block) {
  std::uint64_t key = 0;
  for (int axis = 2; axis >= 0; --axis)
    key = key << key_bits | std::uint64_t(block[std::size_t(axis)] + key_offset);
  return key;
}

Index block_of(std::uint64_t key) {
  Index block;
  for (auto& b : block) {
    b = int(key & ((1u << key_bits) - 1)) - key_offset;
    key >>= key_bits;
  }
  return block;
}

/// First node of a particle's stencil along one axis.
int first_node(float x, double spacing) {
  return int(std::floor(double(x) / spacing - 0.5));
}

struct Entry {
  std::uint64_t key;
  std::uint32_t particle;
  bool operator<(const Entry& other) const {
    return key != other.key ? key < other.key : particle < other.particle;
  }
};

/// What the particles of one block spread, with the two layers that lie in the blocks above it.
struct Tile {
  std::array<float, tile_edge * tile_edge * tile_edge> fraction{}, weighted{};
};

void spread(const Point& x, float scalar, double spacing, const Index& origin, Tile& tile) {
  float w[3][3];
  int base[3];
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const int first = first_node(x[axis], spacing);
    const float f = float(double(x[axis]) / spacing - first);  // in [1/2, 3/2)
    w[axis][0] = 0.5f * (1.5f - f) * (1.5f - f);
    w[axis][1] = 0.75f - (f - 1) * (f - 1);
    w[axis][2] = 0.5f * (f - 0.5f) * (f - 0.5f);
    base[axis] = first - origin[axis];
  }
  for (int k = 0; k < 3; ++k) {
    for (int j = 0; j < 3; ++j) {
      const float wjk = w[1][j] * w[2][k];
      const auto row = std::size_t(base[0] + tile_edge * (base[1] + j + tile_edge * (base[2] + k)));
      for (std::size_t i = 0; i < 3; ++i) {
        tile.fraction[row + i] += w[0][i] * wjk;
        tile.weighted[row + i] += w[0][i] * wjk * scalar;
      }
    }
  }
}

/// Adds the part of a tile that lies in the block `shift` blocks above the tile's own.
void add_tile(const Tile& tile, const Index& shift, SolidField::Block& block) {
  Index last;
  for (std::size_t axis = 0; axis < 3; ++axis) last[axis] = shift[axis] == 0 ? edge : tile_edge - edge;
  for (int k = 0; k < last[2]; ++k) {
    for (int j = 0; j < last[1]; ++j) {
      for (int i = 0; i < last[0]; ++i) {
        const auto node = std::size_t(i + edge * (j + edge * k));
        const auto from = std::size_t(i + edge * shift[0] +
                                      tile_edge * (j + edge * shift[1] + tile_edge * (k + edge * shift[2])));
        block.fraction[node] += tile.fraction[from];
        block.weighted[node] += tile.weighted[from];
      }
    }
  }
}

void check(std::span<const Point> positions, std::span<const float> scalar, double spacing) {
  if (positions.empty()) throw InputError("no particles to draw");
  if (scalar.size() != positions.size()) {
    throw InputError("got " + std::to_string(scalar.size()) + " values for " +
                     std::to_string(positions.size()) + " particles; expected one a particle");
  }
  if (!(spacing > 0)) throw InputError("particle spacing = " + std::to_string(spacing) + " m; expected > 0");
  const double reach = double(key_offset - 2) * edge * spacing;
  for (std::size_t i = 0; i < positions.size(); ++i) {
    for (float x : positions[i]) {
      if (!(std::abs(x) < reach)) {
        throw InputError("position of particle " + std::to_string(i) + " is " + std::to_string(x) +
                         " m; expected a finite number below " + std::to_string(reach) + " m");
      }
    }
    if (!std::isfinite(scalar[i]))
      throw InputError("value of particle " + std::to_string(i) + " is not finite");
  }
}

}  // namespace

SolidField::SolidField(std::span<const Point> positions, std::span<const float> scalar, double spacing)
    : spacing_(spacing) {
  check(positions, scalar, spacing);

  // Bring the particles of a block together, in a fixed order.
  std::vector<Entry> entries(positions.size());
  tbb::parallel_for(std::size_t(0), positions.size(), [&](std::size_t p) {
    Index block;
    for (std::size_t axis = 0; axis < 3; ++axis) block[axis] = first_node(positions[p][axis], spacing) >> 3;
    entries[p] = {key_of(block), std::uint32_t(p)};
  });
  tbb::parallel_sort(entries.begin(), entries.end());
  std::vector<std::size_t> begin;
  std::vector<std::uint64_t> occupied;
  for (std::size_t e = 0; e < entries.size(); ++e) {
    if (e > 0 && entries[e].key == entries[e - 1].key) continue;
    begin.push_back(e);
    occupied.push_back(entries[e].key);
  }
  begin.push_back(entries.size());

  // Each block spreads its own particles ...
  std::vector<Tile> tiles(occupied.size());
  tbb::parallel_for(std::size_t(0), occupied.size(), [&](std::size_t t) {
    Index origin = block_of(occupied[t]);
    for (int& o : origin) o *= edge;
    for (std::size_t e = begin[t]; e < begin[t + 1]; ++e) {
      const std::uint32_t p = entries[e].particle;
      spread(positions[p], scalar[p], spacing, origin, tiles[t]);
    }
  });

  // ... and every block near them gathers in a fixed order. One more layer all around holds the surface's
  // void side.
  for (const std::uint64_t key : occupied) {
    const Index b = block_of(key);
    for (int n = 0; n < 27; ++n)
      keys_.push_back(key_of({b[0] + n % 3 - 1, b[1] + n / 3 % 3 - 1, b[2] + n / 9 - 1}));
  }
  tbb::parallel_sort(keys_.begin(), keys_.end());
  keys_.erase(std::unique(keys_.begin(), keys_.end()), keys_.end());
  keys_.shrink_to_fit();
  blocks_.resize(keys_.size());
  const auto index_in = [](const std::vector<std::uint64_t>& keys, std::uint64_t key) {
    const auto it = std::lower_bound(keys.begin(), keys.end(), key);
    return it != keys.end() && *it == key ? std::int32_t(it - keys.begin()) : -1;
  };
  tbb::parallel_for(std::size_t(0), keys_.size(), [&](std::size_t i) {
    Block& block = blocks_[i];
    const Index b = block_of(keys_[i]);
    for (std::size_t axis = 0; axis < 3; ++axis) block.origin[axis] = edge * b[axis];
    block.fraction.fill(0);
    block.weighted.fill(0);
    for (int n = 0; n < 27; ++n) {
      block.near[std::size_t(n)] =
          index_in(keys_, key_of({b[0] + n % 3 - 1, b[1] + n / 3 % 3 - 1, b[2] + n / 9 - 1}));
    }
    for (int s = 0; s < 8; ++s) {
      const Index shift{s & 1, s >> 1 & 1, s >> 2};
      const std::int32_t tile =
          index_in(occupied, key_of({b[0] - shift[0], b[1] - shift[1], b[2] - shift[2]}));
      if (tile >= 0) add_tile(tiles[std::size_t(tile)], shift, block);
    }
  });
  smooth();
  surface_fraction_ = find_surface_fraction();
}

float SolidField::find_surface_fraction() const {
  double volume = 0;  // in nodes; where particles crowd, a node still holds no more than itself
  std::vector<float> candidates;
  std::size_t above = 0;
  constexpr float least = 0.3f;
  constexpr float most = 0.499f;
  for (const Block& block : blocks_) {
    for (const float f : block.fraction) {
      volume += std::min(f, 1.0f);
      if (f >= most) {
        ++above;
      } else if (f >= least) {
        candidates.push_back(f);
      }
    }
  }
  const auto wanted = std::size_t(std::lround(volume));
  if (wanted <= above) return most;
  const std::size_t rank = wanted - above - 1;
  if (rank >= candidates.size()) return least;
  std::nth_element(candidates.begin(), candidates.begin() + std::ptrdiff_t(rank), candidates.end(),
                   std::greater<>());
  return candidates[rank];
}

void SolidField::smooth() {
  constexpr int n = edge + 3;
  std::vector<std::array<float, nodes>> smoothed(blocks_.size());
  for (const auto channel : {&Block::fraction, &Block::weighted}) {
    tbb::parallel_for(std::size_t(0), blocks_.size(), [&](std::size_t b) {
      std::array<float, n * n * n> v;
      gather(blocks_[b], channel, 1, v.data());
      for (const int stride : {1, n, n * n}) {
        // Each value is overwritten by the filtered one of the node after it, so one array is enough.
        for (int i = 0; i + 2 * stride < n * n * n; ++i) {
          v[std::size_t(i)] = 0.25f * (v[std::size_t(i)] + v[std::size_t(i + 2 * stride)]) +
                              0.5f * v[std::size_t(i + stride)];
        }
      }
      for (int k = 0; k < edge; ++k) {
        for (int j = 0; j < edge; ++j) {
          for (int i = 0; i < edge; ++i) {
            smoothed[b][std::size_t(i + edge * (j + edge * k))] = v[std::size_t(i + n * (j + n * k))];
          }
        }
      }
    });
    for (std::size_t b = 0; b < blocks_.size(); ++b) blocks_[b].*channel = smoothed[b];
  }
}

void SolidField::gather(const Block& block, const std::array<float, nodes> Block::*channel, int margin,
                        float* out) const {
  const int n = edge + 1 + 2 * margin;
  for (int k = 0; k < n; ++k) {
    const int z = k - margin + edge;  // counted from the first node of the block below: 0 .. 3 edge - 1
    for (int j = 0; j < n; ++j) {
      const int y = j - margin + edge;
      for (int i = 0; i < n; ++i) {
        const int x = i - margin + edge;
        const std::int32_t near = block.near[std::size_t((x >> 3) + 3 * ((y >> 3) + 3 * (z >> 3)))];
        *out++ = near < 0 ? 0
                          : (blocks_[std::size_t(near)].*
                             channel)[std::size_t((x & 7) + edge * ((y & 7) + edge * (z & 7)))];
      }
    }
  }
}

const SolidField::Block* SolidField::find(const Index& block) const {
  for (const int b : block) {
    if (std::abs(b) >= key_offset) return nullptr;
  }
  const auto it = std::lower_bound(keys_.begin(), keys_.end(), key_of(block));
  return it != keys_.end() && *it == key_of(block) ? &blocks_[std::size_t(it - keys_.begin())] : nullptr;
}

SolidField::Sample SolidField::at(const Point& x) const {
  Index first;
  float f[3];
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double s = double(x[axis]) / spacing_;
    first[axis] = int(std::floor(s));
    f[axis] = float(s - first[axis]);
  }
  const Block* home = find({first[0] >> 3, first[1] >> 3, first[2] >> 3});
  if (home == nullptr) return {};

  float fraction = 0;
  float weighted = 0;
  for (int corner = 0; corner < 8; ++corner) {
    int local[3];
    int neighbour = 13;
    float w = 1;
    for (int axis = 0, stride = 1; axis < 3; ++axis, stride *= 3) {
      const int up = corner >> axis & 1;
      local[axis] = first[std::size_t(axis)] - home->origin[std::size_t(axis)] + up;
      w *= up ? f[axis] : 1 - f[axis];
      if (local[axis] == edge) {
        local[axis] = 0;
        neighbour += stride;
      }
    }
    const std::int32_t index = home->near[std::size_t(neighbour)];
    if (index < 0) continue;
    const Block& block = blocks_[std::size_t(index)];
    const auto node = std::size_t(local[0] + edge * (local[1] + edge * local[2]));
    fraction += w * block.fraction[node];
    weighted += w * block.weighted[node];
  }
  return {fraction, fraction > 0 ? weighted / fraction : 0};
}

}  // namespace anticrack
