#include "fault/peak_memory.h"

#include <malloc.h>

#include <atomic>
#include <cstdlib>
#include <new>

namespace {

std::atomic<std::size_t> in_use = 0, peak = 0;

void* allocate(std::size_t size) {
  void* const place = std::malloc(size);
  if (!place) return nullptr;
  const std::size_t now = in_use += malloc_usable_size(place);
  std::size_t most = peak;
  while (now > most && !peak.compare_exchange_weak(most, now)) {
  }
  return place;
}

}  // namespace

void* operator new(std::size_t size) {
  if (void* const place = allocate(size)) return place;
  throw std::bad_alloc();
}

void operator delete(void* place) noexcept {
  if (place) in_use -= malloc_usable_size(place);
  std::free(place);
}

void* operator new(std::size_t size, const std::nothrow_t&) noexcept {
  return allocate(size);
}
void operator delete(void* place, std::size_t) noexcept {
  operator delete(place);
}
void operator delete(void* place, const std::nothrow_t&) noexcept {
  operator delete(place);
}
void* operator new[](std::size_t size) {
  return operator new(size);
}
void* operator new[](std::size_t size, const std::nothrow_t& tag) noexcept {
  return operator new(size, tag);
}
void operator delete[](void* place) noexcept {
  operator delete(place);
}
void operator delete[](void* place, std::size_t) noexcept {
  operator delete(place);
}
void operator delete[](void* place, const std::nothrow_t&) noexcept {
  operator delete(place);
}

namespace anticrack {

PeakMemory::PeakMemory() : before_(in_use) {
  peak = before_;
}

std::size_t PeakMemory::bytes() const {
  return peak - before_;
}

}  // namespace anticrack
