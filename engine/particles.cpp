#include "particles.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>

namespace anticrack {

AlignedArray AlignedArray::uninitialized(std::size_t size) {
  AlignedArray array;
  array.size_ = size;
  // A pass reads all arrays of the particles side by side: beginning at the same place in a page they would
  // compete for the same sets of the caches. 69 cache lines spread them over a small page and over 64 KiB.
  static std::atomic<unsigned> next{0};
  array.shift_ = next++ % 32 * 69 * 8;
  array.memory_ = allocate_array<double>(array.shift_ + size + tail);
  std::fill_n(array.data() + size, tail, 0.0);
  return array;
}

AlignedArray::AlignedArray(std::size_t size) : AlignedArray(uninitialized(size)) {
  constexpr std::size_t grain = std::size_t(1) << 17;
  // By all threads: a page lies where it is first touched.
  tbb::parallel_for(
      tbb::blocked_range<std::size_t>(0, size, grain),
      [&](const auto& range) { std::fill_n(data() + range.begin(), range.size(), 0.0); },
      tbb::static_partitioner());
}

}  // namespace anticrack
