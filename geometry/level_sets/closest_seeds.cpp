#include "level_sets/closest_seeds.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <limits>

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

int square(int value) {
  return value * value;
}

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

ClosestSeeds::ClosestSeeds(const CutSolid& solid)
    : points_(solid.points()), layout_{points_, {}}, packed_(solid.fields[0].values.size(), 0) {
  std::vector<Plane> frontier(std::size_t(points_[2] + 2 * padding));
  start_ring(solid, frontier);
  for (int ring = 2; ring <= rings; ++ring) frontier = grow_ring(ring, frontier);
}

ClosestSeeds::ClosestSeeds(const Index3& points)
    : points_(points),
      layout_{points, {}},
      packed_(layout_.plane_stride() * std::size_t(points[2] + 2 * padding), 0) {}

void ClosestSeeds::put(const Index3& index, const Vec3& seed) {
  Seed offset{{}, 1};
  for (int axis = 0; axis < 3; ++axis) {
    offset.offset[axis] = int(std::lround((seed[axis] - index[axis]) / unit));
    if (std::abs(offset.offset[axis]) > largest_offset) return;
  }
  packed_[layout_.offset(index[0], index[1], index[2])] = pack(offset);
}

std::optional<Vec3> ClosestSeeds::of(const Index3& index) const {
  const auto seed = neighbour(index, {}, rings);
  if (!seed) return std::nullopt;
  return Vec3(index[0] + unit * seed->way[0], index[1] + unit * seed->way[1], index[2] + unit * seed->way[2]);
}

ClosestSeeds::Choice ClosestSeeds::at(int i, int j, int k) const {
  constexpr std::array<Index3, 7> near = {Index3{0, 0, 0}, {-1, 0, 0}, {1, 0, 0}, {0, -1, 0},
                                          {0, 1, 0},       {0, 0, -1}, {0, 0, 1}};
  std::array<Offset, near.size()> offsets;
  int count = 0;
  for (const Index3& step : near)
    if (const auto offset = neighbour({i, j, k}, step, rings)) offsets[count++] = *offset;
  if (count == 0) return {};

  const auto end = offsets.begin() + count;
  const Offset& first = *std::min_element(
      offsets.begin(), end, [](const Offset& a, const Offset& b) { return a.squared < b.squared; });
  const auto position = [&](const Offset& offset) {
    return Vec3(i + unit * offset.way[0], j + unit * offset.way[1], k + unit * offset.way[2]);
  };
  Choice choice = {position(first), std::nullopt};

  // Another sheet of the surface may prove nearer after all.
  constexpr int apart = 3 * steps / 2;
  constexpr double slack = 0.4 * steps;
  const double reach = std::sqrt(double(first.squared)) + slack;
  double least = reach * reach;
  for (auto offset = offsets.begin(); offset != end; ++offset) {
    int gap = 0;
    for (int axis = 0; axis < 3; ++axis) gap += square(offset->way[axis] - first.way[axis]);
    if (gap > apart * apart && offset->squared < least)
      least = offset->squared, choice.second = position(*offset);
  }
  return choice;
}

std::vector<Vec3> ClosestSeeds::all_around(int i, int j, int k) const {
  std::vector<Offset> offsets;
  for (int dk = -1; dk <= 1; ++dk)
    for (int dj = -1; dj <= 1; ++dj)
      for (int di = -1; di <= 1; ++di)
        if (const auto offset = neighbour({i, j, k}, {di, dj, dk}, rings)) offsets.push_back(*offset);
  std::ranges::stable_sort(offsets, {}, &Offset::squared);

  constexpr int apart = steps / 2;
  std::vector<Offset> taken;
  std::vector<Vec3> seeds;
  for (const Offset& offset : offsets) {
    const bool is_new = std::ranges::all_of(taken, [&](const Offset& other) {
      int gap = 0;
      for (int axis = 0; axis < 3; ++axis) gap += square(offset.way[axis] - other.way[axis]);
      return gap > apart * apart;
    });
    if (!is_new) continue;
    taken.push_back(offset);
    seeds.emplace_back(i + unit * offset.way[0], j + unit * offset.way[1], k + unit * offset.way[2]);
  }
  return seeds;
}

std::optional<ClosestSeeds::Offset> ClosestSeeds::neighbour(const Index3& point, const Index3& step,
                                                            int last_ring) const {
  const Index3 at = {point[0] + step[0], point[1] + step[1], point[2] + step[2]};
  for (int axis = 0; axis < 3; ++axis)
    if (at[axis] < -padding || at[axis] >= points_[axis] + padding) return std::nullopt;
  const std::uint32_t word = load(layout_.offset(at[0], at[1], at[2]));
  const Seed seed = unpack(word);
  if (word == 0 || seed.ring > last_ring) return std::nullopt;
  const Index3 way = {seed.offset[0] + steps * step[0], seed.offset[1] + steps * step[1],
                      seed.offset[2] + steps * step[2]};
  return Offset{way, square(way[0]) + square(way[1]) + square(way[2])};
}

// From a lattice point with a neighbour on the other side of the sheet: along the gradient, but no farther
// than to the nearest crossing of a lattice edge, which is taken where the gradient misleads.
std::optional<Vec3> ClosestSeeds::first_order(const Sheet& sheet, const Index3& index) const {
  const std::array<std::ptrdiff_t, 3> stride = {1, std::ptrdiff_t(layout_.row_stride()),
                                                std::ptrdiff_t(layout_.plane_stride())};
  const float* values = &sheet.field->values[layout_.offset(index[0], index[1], index[2])];
  const double here = values[0] - sheet.level;
  Vec3 gradient, crossing = Vec3::Zero();
  double nearest = 2.0;
  for (int axis = 0; axis < 3; ++axis) {
    for (int side : {-1, 1}) {
      const double there = values[side * stride[axis]] - sheet.level;
      gradient[axis] = side < 0 ? -0.5 * there : gradient[axis] + 0.5 * there;
      if ((here > 0) == (there > 0)) continue;
      const double way = here / (here - there);
      const bool leaves = side < 0 ? index[axis] == 0 : index[axis] == points_[axis] - 1;
      if (way < nearest && (!leaves || way <= 0.5)) nearest = way, crossing = Vec3::Unit(axis) * (side * way);
    }
  }
  if (nearest > 1.0) return std::nullopt;
  const Vec3 step = gradient * (-here / gradient.squaredNorm());
  return step.squaredNorm() <= nearest * nearest ? step : crossing;
}

// The step to the sheet, prolonged to the crease where the other field does not let the sheet bound the
// solid there; to first order. Nothing if the crease is too far for that.
std::optional<Vec3> ClosestSeeds::to_boundary(const CutSolid& solid, const Sheet& sheet, const Index3& index,
                                              const Vec3& step) const {
  if (solid.fields.size() == 1) return step;
  const PaddedField& other = solid.fields[sheet.field == &solid.fields[0] ? 1 : 0];
  const auto gradient_of = [&, i = index[0], j = index[1], k = index[2]](const PaddedField& field) {
    return Vec3(0.5 * Vec3(field.at(i + 1, j, k) - field.at(i - 1, j, k),
                           field.at(i, j + 1, k) - field.at(i, j - 1, k),
                           field.at(i, j, k + 1) - field.at(i, j, k - 1)));
  };
  const Vec3 gradient = gradient_of(other), normal = gradient_of(*sheet.field).normalized();
  const double there = other.at(index[0], index[1], index[2]) + gradient.dot(step);
  if (solid.on_boundary(there) >= 0) return step;
  const Vec3 along = gradient - gradient.dot(normal) * normal;  // the sheet
  const double missing = std::copysign(solid.threshold, there) - there;
  const Vec3 rest = along * (missing / along.squaredNorm());
  constexpr double farthest = 1.0;  // voxels
  if (!(rest.squaredNorm() < farthest * farthest)) return std::nullopt;
  return Vec3(step + rest);
}

// Lattice points of the box beside a sheet, where it bounds the solid.
void ClosestSeeds::start_ring(const CutSolid& solid, std::vector<Plane>& found) {
  const std::vector<Sheet> sheets = solid.sheets();
  tbb::parallel_for(0, points_[2], [&](int k) {
    for (int j = 0; j < points_[1]; ++j) {
      for (int i = 0; i < points_[0]; ++i) {
        const Index3 index = {i, j, k};
        Vec3 step = Vec3::Zero();
        double least = std::numeric_limits<double>::infinity();
        for (const Sheet& sheet : sheets) {
          const std::optional<Vec3> candidate = first_order(sheet, index);
          if (!candidate || candidate->squaredNorm() >= least) continue;
          const std::optional<Vec3> bound = to_boundary(solid, sheet, index, *candidate);
          if (!bound || bound->squaredNorm() >= least) continue;
          step = *bound, least = step.squaredNorm();
        }
        if (!std::isfinite(least)) continue;
        Seed seed{{}, 1};
        for (int axis = 0; axis < 3; ++axis) {
          const int lower = index[axis] == 0 ? -steps / 2 : -largest_offset;
          const int upper = index[axis] == points_[axis] - 1 ? steps / 2 : largest_offset;
          seed.offset[axis] = std::clamp(int(std::lround(step[axis] / unit)), lower, upper);
        }
        packed_[layout_.offset(i, j, k)] = pack(seed);
        found[std::size_t(k + padding)].push_back(in_plane(i, j));
      }
    }
  });
}

std::uint32_t ClosestSeeds::in_plane(int i, int j) const {
  return std::uint32_t(std::size_t(j + padding) * layout_.row_stride() + std::size_t(i + padding));
}

// Points without a seed beside the points of the ring before take the nearest of their neighbours' seeds.
// Threads read words that others may be writing, but overlook those of this ring, so the result does not
// depend on who is first.
std::vector<ClosestSeeds::Plane> ClosestSeeds::grow_ring(int ring, const std::vector<Plane>& frontier) {
  std::vector<Plane> found(frontier.size());
  const int width = int(layout_.row_stride()), height = points_[1] + 2 * padding;
  tbb::parallel_for(0, int(frontier.size()), [&](int plane) {
    std::vector<bool> beside(layout_.plane_stride());
    for (int other = std::max(plane - 1, 0); other <= std::min(plane + 1, int(frontier.size()) - 1); ++other)
      for (const std::uint32_t at : frontier[std::size_t(other)]) {
        const int i = int(at) % width, j = int(at) / width;
        for (int y = std::max(j - 1, 0); y <= std::min(j + 1, height - 1); ++y)
          for (int x = std::max(i - 1, 0); x <= std::min(i + 1, width - 1); ++x)
            beside[std::size_t(y) * std::size_t(width) + std::size_t(x)] = true;
      }
    const int k = plane - padding;
    for (int j = -padding; j < points_[1] + padding; ++j)
      for (int i = -padding; i < points_[0] + padding; ++i) {
        const std::size_t offset = layout_.offset(i, j, k);
        if (!beside[in_plane(i, j)] || load(offset) != 0) continue;
        Offset best{{}, std::numeric_limits<int>::max()};
        for (int dk = -1; dk <= 1; ++dk)
          for (int dj = -1; dj <= 1; ++dj)
            for (int di = -1; di <= 1; ++di)
              if (const auto seed = neighbour({i, j, k}, {di, dj, dk}, ring - 1);
                  seed && seed->squared < best.squared)
                best = *seed;
        if (best.squared > square(largest_offset)) continue;
        std::atomic_ref(packed_[offset]).store(pack({best.way, ring}), std::memory_order_relaxed);
        found[std::size_t(plane)].push_back(in_plane(i, j));
      }
  });
  return found;
}

std::uint32_t ClosestSeeds::load(std::size_t offset) const {
  return std::atomic_ref(const_cast<std::uint32_t&>(packed_[offset])).load(std::memory_order_relaxed);
}

}  // namespace anticrack
