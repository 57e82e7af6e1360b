#include "particles.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <new>

namespace anticrack {

hwy::AlignedFreeUniquePtr<double[]> AlignedArray::allocate(std::size_t size) {
  constexpr std::size_t tail = 8, grain = std::size_t(1) << 17;
  auto data = hwy::AllocateAligned<double>(size + tail);
  if (!data) throw std::bad_alloc();
  // By all threads: a page lies where it is first touched.
  tbb::parallel_for(
      tbb::blocked_range<std::size_t>(0, size + tail, grain),
      [&](const auto& range) { std::fill(&data[range.begin()], &data[range.begin()] + range.size(), 0.0); },
      tbb::static_partitioner());
  return data;
}

}  // namespace anticrack
