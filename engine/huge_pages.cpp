#include "huge_pages.h"

#include <sys/mman.h>

namespace anticrack {

void* allocate_pages(std::size_t bytes) {
  constexpr std::size_t cache_line = 64, huge_page = std::size_t(1) << 21;
  const bool large = bytes >= huge_page;
  void* memory = nullptr;
  if (posix_memalign(&memory, large ? huge_page : cache_line, bytes) != 0) throw std::bad_alloc();
  if (large) madvise(memory, bytes, MADV_HUGEPAGE);  // a wish: without it all works as well
  return memory;
}

}  // namespace anticrack
