#pragma once

#include <sys/mman.h>
#include <unistd.h>

#include <cstdint>
#include <filesystem>
#include <span>
#include <stdexcept>
#include <string>

namespace anticrack {

/// A file that lies in memory, under a name with the extension that a reader looks at.
class MemoryFile {
 public:
  MemoryFile(std::span<const std::uint8_t> bytes, const std::string& extension)
      : descriptor_(::memfd_create("fuzz", 0)),
        path_(std::filesystem::temp_directory_path() /
              ("anticrack_fuzz_" + std::to_string(::getpid()) + extension)) {
    if (descriptor_ < 0 || ::write(descriptor_, bytes.data(), bytes.size()) != ssize_t(bytes.size()))
      throw std::runtime_error("no file in memory");
    std::filesystem::remove(path_);
    std::filesystem::create_symlink("/proc/self/fd/" + std::to_string(descriptor_), path_);
  }
  ~MemoryFile() {
    std::error_code ignored;
    std::filesystem::remove(path_, ignored);
    ::close(descriptor_);
  }
  MemoryFile(const MemoryFile&) = delete;

  const std::filesystem::path& path() const { return path_; }

 private:
  int descriptor_;
  std::filesystem::path path_;
};

}  // namespace anticrack
