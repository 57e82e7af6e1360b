#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <vector>

#include "fuzz/fuzz_targets.h"

namespace anticrack {
namespace {

namespace fs = std::filesystem;

// What the fuzzers found of interest, and every input that once broke a reader.
TEST(FuzzCorpus, IsReadOrRefused) {
  const std::pair<const char*, FuzzTarget*> targets[] = {
      {"scene", fuzz_scene},       {"tiff", fuzz_tiff}, {"raw", fuzz_raw},
      {"nrrd", fuzz_nrrd},         {"meta", fuzz_meta}, {"npy", fuzz_npy},
      {"spectrum", fuzz_spectrum}, {"vdb", fuzz_vdb},   {"checkpoint", fuzz_checkpoint}};
  for (const auto& [name, target] : targets) {
    int files = 0;
    for (const auto& entry : fs::directory_iterator(fs::path(ANTICRACK_CORPUS) / name)) {
      std::ifstream stream(entry.path(), std::ios::binary);
      const std::vector<char> bytes{std::istreambuf_iterator<char>(stream), {}};
      EXPECT_NO_THROW(target({reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()}))
          << entry.path();
      ++files;
    }
    EXPECT_GT(files, 2) << name;
  }
}

}  // namespace
}  // namespace anticrack
