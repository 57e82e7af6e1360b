#pragma once

#include <cstddef>
#include <cstdlib>
#include <memory>
#include <new>

namespace anticrack {

struct FreeMemory {
  void operator()(void* memory) const { std::free(memory); }
};
template <class T>
using PageArray = std::unique_ptr<T[], FreeMemory>;

/// Memory on a cache line, from 2 MiB on in pages of that size where the system has them: a step touches a
/// hundred megabytes in many places at once, more small pages than a processor keeps the addresses of.
/// @throws std::bad_alloc
void* allocate_pages(std::size_t bytes);

/// `count` of an implicit-lifetime type, uninitialized.
template <class T>
PageArray<T> allocate_array(std::size_t count) {
  return PageArray<T>(static_cast<T*>(allocate_pages(count * sizeof(T))));
}

}  // namespace anticrack
