#include "leaf_memory.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <set>
#include <vector>

namespace anticrack {
namespace {

constexpr std::size_t bytes = 4096;

TEST(LeafMemory, BuffersLieApartEachOnAPageOfItsOwn) {
  LeafMemory memory(bytes);
  std::vector<void*> buffers;
  for (int n = 0; n < 1200; ++n) buffers.push_back(memory.take());  // three slabs
  for (void* buffer : buffers) std::memset(buffer, 1, bytes);
  std::ranges::sort(buffers);
  for (std::size_t n = 0; n < buffers.size(); ++n) {
    const auto at = std::uintptr_t(buffers[n]);
    EXPECT_EQ(at % bytes, 0u);
    if (n == 0) continue;
    EXPECT_GE(at, std::uintptr_t(buffers[n - 1]) + bytes);
  }
  for (void* buffer : buffers) memory.give_back(buffer);
}

TEST(LeafMemory, UsesAgainWhatIsGivenBack) {
  LeafMemory memory(bytes);
  std::vector<void*> buffers;
  for (int n = 0; n < 512; ++n) buffers.push_back(memory.take());  // one slab
  const std::set<void*> slab(buffers.begin(), buffers.end());
  for (int n = 0; n < 100; ++n) memory.give_back(buffers[5 * n]);
  for (int n = 0; n < 100; ++n) EXPECT_TRUE(slab.contains(memory.take()));
  EXPECT_FALSE(slab.contains(memory.take()));
}

}  // namespace
}  // namespace anticrack
