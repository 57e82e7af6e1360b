#include "files/vdb_seal.h"

#include <libdeflate.h>

#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <cstdio>
#include <fstream>
#include <string>
#include <string_view>
#include <vector>

#include "files/atomic_file.h"

namespace anticrack {
namespace {

namespace fs = std::filesystem;

// The head of an OpenVDB file: magic (8 bytes), format, library version (3 x 4), flag (1), then the UUID as
// text.
constexpr std::size_t uuid_begin = 21;
constexpr std::size_t uuid_size = 36;
// "anticr" in ASCII, then version 8: a UUID whose bits are the program's own (RFC 9562).
constexpr std::string_view seal_mark = "616e7469-6372-8000-8000-0000";

struct Content {
  std::string uuid;
  std::uint32_t checksum;  // of all bytes but the UUID's
};

Content read_content(const fs::path& file) {
  errno = 0;
  std::ifstream stream(file, std::ios::binary);
  if (!stream) throw system_file_error(file, "cannot be opened", errno);
  std::error_code unknown;
  std::vector<char> buffer(
      std::clamp<std::uintmax_t>(fs::file_size(file, unknown), uuid_begin + uuid_size, 1 << 20));
  Content content{{}, 0};
  for (bool first = true; stream.read(buffer.data(), std::streamsize(buffer.size())) || stream.gcount() > 0;
       first = false) {
    std::string_view piece(buffer.data(), std::size_t(stream.gcount()));
    if (first && piece.size() >= uuid_begin + uuid_size) {
      content.uuid = piece.substr(uuid_begin, uuid_size);
      content.checksum = libdeflate_crc32(content.checksum, piece.data(), uuid_begin);
      piece.remove_prefix(uuid_begin + uuid_size);
    }
    content.checksum = libdeflate_crc32(content.checksum, piece.data(), piece.size());
  }
  if (stream.bad()) throw system_file_error(file, "cannot be read", errno);
  return content;
}

std::string seal_of(std::uint32_t checksum) {
  char digits[9];
  std::snprintf(digits, sizeof digits, "%08x", checksum);
  return std::string(seal_mark) + digits;
}

}  // namespace

void seal_vdb(const fs::path& file) {
  const Content content = read_content(file);
  if (content.uuid.size() != uuid_size || content.uuid[8] != '-' || content.uuid[23] != '-')
    throw FileError(file.string() + ": no UUID where OpenVDB files have it");
  std::fstream stream;
  stream.exceptions(std::ios::badbit | std::ios::failbit);
  stream.open(file, std::ios::binary | std::ios::in | std::ios::out);
  stream.seekp(uuid_begin);
  stream << seal_of(content.checksum);
  stream.close();
}

bool check_vdb_seal(const fs::path& file) {
  const Content content = read_content(file);
  if (!content.uuid.starts_with(seal_mark)) return false;
  if (content.uuid != seal_of(content.checksum))
    throw FileError(file.string() + ": damaged or truncated (its content does not match its checksum)");
  return true;
}

}  // namespace anticrack
