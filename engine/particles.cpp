#include "particles.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <new>

namespace anticrack {

AlignedArray AlignedArray::uninitialized(std::size_t size) {
  AlignedArray array;
  array.size_ = size;
  array.data_ = hwy::AllocateAligned<double>(size + tail);
  if (!array.data_) throw std::bad_alloc();
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
