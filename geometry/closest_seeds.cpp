#include "closest_seeds.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>

namespace anticrack {
namespace {

constexpr int padding = PaddedField::padding;
constexpr int rings =
    4;  // lattice points beside the surface, and three more: a distance of 3 in every direction

// Offset from a lattice point to its seed in units of 1/32 voxel, a byte an axis, and the ring that found it
// (0: none).
struct Seed {
  Index3 offset;
  int ring;
};
constexpr int steps = 32;
constexpr double unit = 1.0 / steps;
constexpr int largest_offset = 127;

std::uint32_t pack(const Seed& seed) {
  const auto byte = [](int value) { return std::uint32_t(std::uint8_t(std::int8_t(value))); };
  return byte(seed.offset[0]) | byte(seed.offset[1]) << 8 | byte(seed.offset[2]) << 16 |
         std::uint32_t(seed.ring) << 24;
}

Seed unpack(std::uint32_t word) {
  const auto byte = [](std::uint32_t value) { return int(std::int8_t(std::uint8_t(value))); };
  return {{byte(word), byte(word >> 8), byte(word >> 16)}, int(word >> 24)};
}

}  // namespace

ClosestSeeds::ClosestSeeds(const PaddedField& field)
    : points_(field.points), layout_{field.points, {}}, packed_(field.values.size(), 0) {
  start_ring(field);
  for (int ring = 2; ring <= rings; ++ring) grow_ring(ring);
}

ClosestSeeds::Choice ClosestSeeds::at(int i, int j, int k) const {
  const Neighbours near = neighbours(i, j, k, rings);
  const Offset* first = near.nearest();
  if (!first) return {};
  const auto position = [&](const Offset& offset) {
    return Vec3(i + unit * offset.way[0], j + unit * offset.way[1], k + unit * offset.way[2]);
  };
  Choice choice = {position(*first), std::nullopt};

  // Another sheet of the surface may prove nearer after all.
  constexpr double apart = 1.5 * steps, slack = 0.4 * steps;
  const double reach = std::sqrt(double(first->squared)) + slack;
  const Offset* second = nullptr;
  for (const Offset& offset : near) {
    if (offset.squared > reach * reach || (second && offset.squared >= second->squared)) continue;
    double gap = 0.0;
    for (int axis = 0; axis < 3; ++axis)
      gap += double(offset.way[axis] - first->way[axis]) * (offset.way[axis] - first->way[axis]);
    if (gap > apart * apart) second = &offset;
  }
  if (second) choice.second = position(*second);
  return choice;
}

ClosestSeeds::Neighbours ClosestSeeds::neighbours(int i, int j, int k, int last_ring) const {
  Index3 lower, upper;
  const Index3 centre = {i, j, k};
  for (int axis = 0; axis < 3; ++axis) {
    lower[axis] = std::max(centre[axis] - 1, -padding);
    upper[axis] = std::min(centre[axis] + 1, points_[axis] + padding - 1);
  }
  Neighbours result;
  for (int nk = lower[2]; nk <= upper[2]; ++nk) {
    for (int nj = lower[1]; nj <= upper[1]; ++nj) {
      const std::size_t row = layout_.offset(0, nj, nk);
      for (int ni = lower[0]; ni <= upper[0]; ++ni) {
        const std::uint32_t word = load(row + ni);
        if (word == 0) continue;
        const Seed seed = unpack(word);
        if (seed.ring > last_ring) continue;
        const Index3 way = {seed.offset[0] + steps * (ni - i), seed.offset[1] + steps * (nj - j),
                            seed.offset[2] + steps * (nk - k)};
        result.offsets[result.count++] = {way, way[0] * way[0] + way[1] * way[1] + way[2] * way[2]};
      }
    }
  }
  return result;
}

// Lattice points of the box with a neighbour on the other side of the surface. They step along the gradient,
// but no farther than to the nearest crossing of a lattice edge, which they take where the gradient misleads.
void ClosestSeeds::start_ring(const PaddedField& field) {
  const std::array<std::ptrdiff_t, 3> stride = {1, std::ptrdiff_t(layout_.row_stride()),
                                                std::ptrdiff_t(layout_.plane_stride())};
  tbb::parallel_for(0, points_[2], [&](int k) {
    for (int j = 0; j < points_[1]; ++j) {
      for (int i = 0; i < points_[0]; ++i) {
        const Index3 index = {i, j, k};
        const std::size_t offset = layout_.offset(i, j, k);
        const double here = field.values[offset];
        Vec3 gradient, crossing = Vec3::Zero();
        double nearest = 2.0;
        for (int axis = 0; axis < 3; ++axis) {
          for (int side : {-1, 1}) {
            const double there = field.values[offset + side * stride[axis]];
            gradient[axis] = side < 0 ? -0.5 * there : gradient[axis] + 0.5 * there;
            if ((here > 0) == (there > 0)) continue;
            const double way = here / (here - there);
            const bool leaves = side < 0 ? index[axis] == 0 : index[axis] == points_[axis] - 1;
            if (way < nearest && (!leaves || way <= 0.5))
              nearest = way, crossing = Vec3::Unit(axis) * (side * way);
          }
        }
        if (nearest > 1.0) continue;
        Vec3 step = gradient * (-here / gradient.squaredNorm());
        if (!(step.squaredNorm() <= nearest * nearest)) step = crossing;
        Seed seed{{}, 1};
        for (int axis = 0; axis < 3; ++axis) {
          const int lower = index[axis] == 0 ? -steps / 2 : -largest_offset;
          const int upper = index[axis] == points_[axis] - 1 ? steps / 2 : largest_offset;
          seed.offset[axis] = std::clamp(int(std::lround(step[axis] / unit)), lower, upper);
        }
        packed_[offset] = pack(seed);
      }
    }
  });
}

// Points without a seed take the nearest of their neighbours' seeds from the rings before. Threads read words
// that others may be writing, but overlook those of this ring, so the result does not depend on who is first.
void ClosestSeeds::grow_ring(int ring) {
  tbb::parallel_for(-padding, points_[2] + padding, [&](int k) {
    for (int j = -padding; j < points_[1] + padding; ++j) {
      for (int i = -padding; i < points_[0] + padding; ++i) {
        const std::size_t offset = layout_.offset(i, j, k);
        if (load(offset) != 0) continue;
        const Neighbours near = neighbours(i, j, k, ring - 1);
        const Offset* first = near.nearest();
        if (!first || std::ranges::any_of(first->way, [](int w) { return std::abs(w) > largest_offset; }))
          continue;
        std::atomic_ref(packed_[offset]).store(pack({first->way, ring}), std::memory_order_relaxed);
      }
    }
  });
}

std::uint32_t ClosestSeeds::load(std::size_t offset) const {
  return std::atomic_ref(const_cast<std::uint32_t&>(packed_[offset])).load(std::memory_order_relaxed);
}

}  // namespace anticrack
