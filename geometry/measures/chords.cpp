#include "measures/chords.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <functional>
#include <limits>

namespace anticrack {
namespace {

constexpr int tasks = 64;  // of a fixed number, summed in their order

void count_line(const PhaseImage& image, Phase phase, std::size_t voxel, std::size_t stride, int length,
                Chords& chords) {
  for (int begin = 0; begin < length;) {
    if (!image.is(phase, voxel + begin * stride)) {
      ++begin;
      continue;
    }
    int end = begin + 1;
    while (end < length && image.is(phase, voxel + end * stride)) ++end;
    const int ends = (begin > 0) + (end < length);
    ++(ends == 2 ? chords.whole : chords.cut)[std::size_t(end - begin)];
    chords.ends += std::uint64_t(ends);
    chords.voxels += std::uint64_t(end - begin);
    begin = end;
  }
}

}  // namespace

Chords measure_chords(const PhaseImage& image, Phase phase, int axis) {
  const auto [nx, ny, nz] = image.size;
  const int length = image.size[axis];
  const std::size_t strides[] = {1, std::size_t(nx), std::size_t(nx) * std::size_t(ny)};
  const int inner = axis == 0 ? 1 : 0, outer = axis == 2 ? 1 : 2;  // the other two axes
  Chords result;
  result.whole.resize(std::size_t(length) + 1);
  result.cut.resize(std::size_t(length) + 1);
  result.voxel_size = image.voxel_size;
  std::vector<Chords> parts(tasks, result);
  tbb::parallel_for(0, tasks, [&](int task) {
    const auto lines = std::int64_t(image.size[outer]);
    for (auto b = int(lines * task / tasks); b < int(lines * (task + 1) / tasks); ++b)
      for (int a = 0; a < image.size[inner]; ++a)
        count_line(image, phase, a * strides[inner] + b * strides[outer], strides[axis], length, parts[task]);
  });
  for (const Chords& part : parts) {
    std::ranges::transform(result.whole, part.whole, result.whole.begin(), std::plus<>());
    std::ranges::transform(result.cut, part.cut, result.cut.begin(), std::plus<>());
    result.ends += part.ends;
    result.voxels += part.voxels;
  }
  return result;
}

double Chords::mean_of_whole() const {
  std::uint64_t number = 0, length = 0;
  for (std::size_t l = 0; l < whole.size(); ++l) {
    number += whole[l];
    length += l * whole[l];
  }
  return number == 0 ? std::numeric_limits<double>::quiet_NaN()
                     : voxel_size * double(length) / double(number);
}

double Chords::mean() const {
  return ends == 0 ? std::numeric_limits<double>::quiet_NaN()
                   : voxel_size * double(voxels) / (0.5 * double(ends));
}

}  // namespace anticrack
