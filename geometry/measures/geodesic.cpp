#include "measures/geodesic.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "errors.h"

namespace anticrack {
namespace {

using Offset = std::uint32_t;

// The lattice with a border of one voxel around it, so that every voxel of the image has six neighbours.
struct Bordered {
  Index3 size;  // of the image

  explicit Bordered(const PhaseImage& image) : size(image.size) {
    if (count() > std::size_t(never_burned))
      throw InputError(
          fmt::format("paths through {} x {} x {} voxels; expected fewer than 2^32 with a border", size[0],
                      size[1], size[2]));
  }

  std::size_t stride(int axis) const {
    return axis == 0 ? 1 : axis == 1 ? std::size_t(size[0] + 2) : stride(1) * std::size_t(size[1] + 2);
  }
  std::size_t count() const { return stride(2) * std::size_t(size[2] + 2); }
  std::size_t offset(int i, int j, int k) const {
    return std::size_t(k + 1) * stride(2) + std::size_t(j + 1) * stride(1) + std::size_t(i + 1);
  }
  std::array<std::ptrdiff_t, 6> neighbours() const {
    const auto x = std::ptrdiff_t(stride(0)), y = std::ptrdiff_t(stride(1)), z = std::ptrdiff_t(stride(2));
    return {-z, -y, -x, x, y, z};
  }

  template <class Value>
  std::vector<Value> spread(const PhaseImage& image, Phase phase, Value open, Value wall) const {
    std::vector<Value> values(count(), wall);
    for (int k = 0; k < size[2]; ++k)
      for (int j = 0; j < size[1]; ++j) {
        const std::size_t row = image.offset(0, j, k), to = offset(0, j, k);
        for (int i = 0; i < size[0]; ++i)
          if (image.is(phase, row + i)) values[to + i] = open;
      }
    return values;
  }

  // In place: a row moves to lower addresses only.
  template <class Value>
  void strip_border(std::vector<Value>& values, Value wall, Value open, Value never) const {
    std::size_t to = 0;
    for (int k = 0; k < size[2]; ++k)
      for (int j = 0; j < size[1]; ++j) {
        const std::size_t row = offset(0, j, k);
        for (int i = 0; i < size[0]; ++i, ++to) {
          const Value value = values[row + i];
          values[to] = value == wall || value == open ? never : value;
        }
      }
    values.resize(to);
  }

  template <class Action>
  void for_each_on(const BoxFace& face, const Action& action) const {
    Index3 first{0, 0, 0}, last = size;
    first[face.axis] = face.upper ? size[face.axis] - 1 : 0;
    last[face.axis] = first[face.axis] + 1;
    for (int k = first[2]; k < last[2]; ++k)
      for (int j = first[1]; j < last[1]; ++j)
        for (int i = first[0]; i < last[0]; ++i) action(offset(i, j, k));
  }
};

// |grad t| = 1 by first differences towards the earlier neighbours along each axis.
float upwind_time(const std::vector<float>& t, std::size_t voxel, std::size_t stride_y,
                  std::size_t stride_z) {
  float a = std::min(t[voxel - 1], t[voxel + 1]);
  float b = std::min(t[voxel - stride_y], t[voxel + stride_y]);
  float c = std::min(t[voxel - stride_z], t[voxel + stride_z]);
  if (a > b) std::swap(a, b);
  if (b > c) std::swap(b, c);
  if (a > b) std::swap(a, b);
  // Differences from the earliest: late times keep their digits.
  const float d = b - a, e = c - a;
  if (!(d < 1)) return a + 1;
  const float two = 0.5f * (d + std::sqrt(2 - d * d));
  if (!(e < two)) return a + two;
  return a + (d + e + std::sqrt(std::max(0.0f, (d + e) * (d + e) - 3 * (d * d + e * e - 1)))) / 3;
}

template <class Value>
std::optional<Tortuosity> mean_over_outlet(const std::vector<Value>& times, Value never,
                                           const PhaseImage& image, int axis) {
  Index3 first{0, 0, 0};
  first[axis] = image.size[axis] - 1;
  double sum = 0, least = HUGE_VAL;
  std::uint64_t reached = 0;
  for (int k = first[2]; k < image.size[2]; ++k)
    for (int j = first[1]; j < image.size[1]; ++j)
      for (int i = first[0]; i < image.size[0]; ++i) {
        const Value time = times[image.offset(i, j, k)];
        if (time == never) continue;
        ++reached;
        sum += double(time);
        least = std::min(least, double(time));
      }
  if (reached == 0) return std::nullopt;
  const double straight = image.size[axis] - 1;
  return Tortuosity{sum / double(reached) / straight, least / straight, reached};
}

void require_length(const PhaseImage& image, int axis) {
  if (image.size[axis] < 2)
    throw InputError(
        fmt::format("tortuosity along axis {} of {} x {} x {} voxels; expected at least 2 along it", axis,
                    image.size[0], image.size[1], image.size[2]));
}

}  // namespace

std::vector<std::uint32_t> burning_times(const PhaseImage& image, Phase phase, const BoxFace& face) {
  constexpr std::uint32_t wall = never_burned - 1;
  const Bordered lattice(image);
  std::vector<std::uint32_t> times = lattice.spread(image, phase, never_burned, wall);
  std::vector<Offset> burning, next;
  const auto ignite = [&](std::size_t voxel, std::uint32_t step) {
    if (times[voxel] != never_burned) return;
    times[voxel] = step;
    next.push_back(Offset(voxel));
  };
  lattice.for_each_on(face, [&](std::size_t voxel) { ignite(voxel, 0); });
  const auto neighbours = lattice.neighbours();
  for (std::uint32_t step = 1; !next.empty(); ++step) {
    burning.swap(next);
    next.clear();
    for (const Offset voxel : burning)
      for (const std::ptrdiff_t neighbour : neighbours) ignite(std::size_t(voxel + neighbour), step);
  }
  lattice.strip_border(times, wall, never_burned, never_burned);
  return times;
}

std::uint64_t burned_from_both_faces(const PhaseImage& image, Phase phase, int axis) {
  const auto from_lower = burning_times(image, phase, {axis, false});
  const auto from_upper = burning_times(image, phase, {axis, true});
  std::uint64_t burned = 0;
  for (std::size_t voxel = 0; voxel < from_lower.size(); ++voxel)
    burned += from_lower[voxel] != never_burned && from_upper[voxel] != never_burned;
  return burned;
}

std::vector<float> arrival_times(const PhaseImage& image, Phase phase, const BoxFace& face) {
  constexpr float wall = HUGE_VALF, unreached = std::numeric_limits<float>::max();
  const Bordered lattice(image);
  std::vector<float> times = lattice.spread(image, phase, unreached, wall);

  // Buckets of times instead of a heap. Within the bucket at hand voxels are taken in any order, and again
  // when their time falls: that ends at the one solution of the differences, whatever the width.
  constexpr float buckets_a_unit = 4;
  constexpr int bucket_count = 8;  // a neighbour is at most one unit later
  std::array<std::vector<Offset>, bucket_count> buckets;
  const auto bucket_of = [](float time) { return std::uint64_t(time * buckets_a_unit); };
  std::size_t waiting = 0;
  const auto put = [&](std::size_t voxel, float time) {
    times[voxel] = time;
    buckets[bucket_of(time) % bucket_count].push_back(Offset(voxel));
    ++waiting;
  };
  lattice.for_each_on(face, [&](std::size_t voxel) {
    if (times[voxel] == unreached) put(voxel, 0);
  });

  const auto neighbours = lattice.neighbours();
  const std::size_t stride_y = lattice.stride(1), stride_z = lattice.stride(2);
  std::vector<Offset> taken;
  for (std::uint64_t bucket = 0; waiting > 0; ++bucket) {
    while (!buckets[bucket % bucket_count].empty()) {
      taken.clear();
      taken.swap(buckets[bucket % bucket_count]);
      waiting -= taken.size();
      for (const Offset voxel : taken) {
        const float time = times[voxel];
        if (bucket_of(time) != bucket) continue;  // it came earlier on another way
        for (const std::ptrdiff_t neighbour : neighbours) {
          const auto next = std::size_t(voxel + neighbour);
          if (times[next] <= time || times[next] == wall) continue;
          const float later = upwind_time(times, next, stride_y, stride_z);
          if (later < times[next]) put(next, later);
        }
      }
    }
  }
  lattice.strip_border(times, wall, unreached, HUGE_VALF);
  return times;
}

std::optional<Tortuosity> tortuosity_by_steps(const PhaseImage& image, Phase phase, int axis) {
  require_length(image, axis);
  return mean_over_outlet(burning_times(image, phase, {axis, false}), never_burned, image, axis);
}

std::optional<Tortuosity> tortuosity_by_fast_marching(const PhaseImage& image, Phase phase, int axis) {
  require_length(image, axis);
  return mean_over_outlet(arrival_times(image, phase, {axis, false}), HUGE_VALF, image, axis);
}

}  // namespace anticrack
