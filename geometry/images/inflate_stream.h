#pragma once

#include <zlib.h>

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <vector>

namespace anticrack {

/// The content of a gzip or zlib stream within a file.
class InflateStream {
 public:
  /// @param offset  of the stream in the file [bytes]
  InflateStream(const std::filesystem::path& file, std::uint64_t offset);
  ~InflateStream();
  InflateStream(const InflateStream&) = delete;

  /// @throws FileError  the stream ends early or is damaged
  void read(std::uint8_t* to, std::size_t size);
  void skip(std::uint64_t size);  ///< @throws FileError

 private:
  std::filesystem::path file_;
  std::ifstream stream_;
  std::vector<std::uint8_t> packed_;
  z_stream state_{};
};

}  // namespace anticrack
