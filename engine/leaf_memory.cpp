#include "leaf_memory.h"

namespace anticrack {

void* LeafMemory::take() {
  const std::lock_guard lock(mutex_);
  if (free_.empty()) {
    const std::size_t buffers = slab_bytes / buffer_bytes_;
    free_.reserve((slabs_.size() + 1) * buffers);  // giving back must not fail
    slabs_.push_back(allocate_array<std::byte>(slab_bytes));
    for (std::size_t n = buffers; n-- > 0;) free_.push_back(slabs_.back().get() + n * buffer_bytes_);
  }
  void* const buffer = free_.back();
  free_.pop_back();
  ++taken_;
  return buffer;
}

void LeafMemory::give_back(void* buffer) {
  const std::lock_guard lock(mutex_);
  free_.push_back(buffer);
  if (--taken_ > 0) return;
  free_.clear();
  slabs_.clear();
}

}  // namespace anticrack
