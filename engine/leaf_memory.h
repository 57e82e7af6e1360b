#pragma once

#include <cstddef>
#include <mutex>
#include <vector>

#include "huge_pages.h"

namespace anticrack {

/// Buffers of leaves, side by side in huge pages: OpenVDB asks for them one by one. What is given back is
/// used again; all goes to the system when no leaf is left.
class LeafMemory {
 public:
  explicit LeafMemory(std::size_t buffer_bytes) : buffer_bytes_(buffer_bytes) {}

  void* take();  ///< @throws std::bad_alloc
  void give_back(void* buffer);

 private:
  static constexpr std::size_t slab_bytes = std::size_t(1) << 21;

  std::size_t buffer_bytes_;
  std::mutex mutex_;
  std::vector<PageArray<std::byte>> slabs_;
  std::vector<void*> free_;
  std::size_t taken_ = 0;
};

}  // namespace anticrack
