#include "fuzz/fuzz_targets.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  anticrack::FUZZ_TARGET({data, size});
  return 0;
}
