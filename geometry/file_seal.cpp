#include "file_seal.h"

#include <fmt/format.h>

#include <array>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <vector>

#include "errors.h"

namespace anticrack {
namespace {

namespace fs = std::filesystem;

constexpr std::array<char, 8> letters = {'a', 'c', 'k', '-', 's', 'e', 'a', 'l'};
constexpr std::size_t seal_size = 16;

// FNV-1a on 64-bit words, the last one filled with zeros: every change of one word changes the sum.
std::uint64_t checksum(std::ifstream& stream, std::uintmax_t size) {
  std::uint64_t sum = 0xcbf29ce484222325u ^ size;
  std::vector<char> block(1 << 20);
  for (std::uintmax_t done = 0; done < size; done += block.size()) {
    const auto bytes = std::size_t(std::min<std::uintmax_t>(block.size(), size - done));
    std::fill(block.begin() + std::ptrdiff_t(bytes), block.end(), '\0');
    stream.read(block.data(), std::streamsize(bytes));
    for (std::size_t at = 0; at < bytes; at += 8) {
      std::uint64_t word;
      std::memcpy(&word, &block[at], 8);
      sum = (sum ^ word) * 0x100000001b3u;
    }
  }
  return sum;
}

}  // namespace

void seal_file(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  const std::uint64_t sum = checksum(in, fs::file_size(file));
  std::ofstream out(file, std::ios::binary | std::ios::app);
  out.write(letters.data(), letters.size());
  out.write(reinterpret_cast<const char*>(&sum), sizeof sum);
  out.close();
  if (!in || !out) throw FileError(fmt::format("{}: cannot be sealed with its checksum", file.string()));
}

Seal check_seal(const fs::path& file) {
  const std::uintmax_t size = fs::file_size(file);
  if (size < seal_size) return Seal::absent;
  std::ifstream stream(file, std::ios::binary);
  std::array<char, letters.size()> found;
  std::uint64_t expected;
  stream.seekg(std::streamoff(size - seal_size));
  stream.read(found.data(), found.size());
  stream.read(reinterpret_cast<char*>(&expected), sizeof expected);
  if (stream && found != letters) return Seal::absent;
  stream.seekg(0);
  const std::uint64_t sum = checksum(stream, size - seal_size);
  if (!stream) throw FileError(fmt::format("{}: cannot be read", file.string()));
  return sum == expected ? Seal::intact : Seal::broken;
}

}  // namespace anticrack
