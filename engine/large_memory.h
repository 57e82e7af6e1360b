#pragma once

#include <sys/mman.h>

#include <cstddef>
#include <cstdlib>
#include <new>

namespace anticrack {

constexpr std::size_t huge_page = std::size_t(2) << 20;  ///< bytes

/// Memory on a 64-byte boundary; of pages of 2 MiB, where the system grants them, if it is large: with pages
/// of 4 KiB address translation takes a fifth of a step. Freed by `std::free`. @throws std::bad_alloc
inline void* allocate_large(std::size_t bytes) {
  const std::size_t alignment = bytes < huge_page ? 64 : huge_page;
  bytes = (bytes + alignment - 1) / alignment * alignment;
  void* p = std::aligned_alloc(alignment, bytes);
  if (!p) throw std::bad_alloc();
  if (alignment == huge_page) madvise(p, bytes, MADV_HUGEPAGE);  // a wish: refusal does no harm
  return p;
}

struct FreeLarge {
  void operator()(void* p) const { std::free(p); }
};

}  // namespace anticrack
