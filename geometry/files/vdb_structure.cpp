#include "files/vdb_structure.h"

#include <fmt/format.h>
#include <openvdb/io/DelayedLoadMetadata.h>
#include <openvdb/openvdb.h>

#include <cerrno>
#include <cstdint>
#include <fstream>
#include <string>

#include "errors.h"
#include "files/atomic_file.h"

namespace anticrack {
namespace {

namespace fs = std::filesystem;

constexpr std::int64_t vdb_magic = 0x56444220;
constexpr std::size_t uuid_size = 36;

// Takes values off a file in order, never past its end.
class Cursor {
 public:
  explicit Cursor(const fs::path& file) : file_(file) {
    errno = 0;
    std::error_code error;
    size_ = fs::file_size(file, error);
    if (error) throw system_file_error(file, "cannot be opened", error.value());
    stream_.open(file, std::ios::binary);
    if (!stream_) throw system_file_error(file, "cannot be opened", errno);
  }

  [[noreturn]] void fail(const std::string& reason) const {
    throw FileError(fmt::format("{}: damaged or no OpenVDB file: {}", file_.string(), reason));
  }

  std::uint64_t size() const { return size_; }
  std::uint64_t at() const { return at_; }

  void go_to(std::uint64_t place, const std::string& what) {
    if (place > size_) fail(fmt::format("{} lies at byte {} of {}", what, place, size_));
    at_ = place;
    stream_.seekg(std::streamoff(place));
  }

  void skip(std::uint64_t bytes, const std::string& what) {
    need(bytes, what);
    go_to(at_ + bytes, what);
  }

  template <class T>
  T take(const std::string& what) {
    T value;
    read(reinterpret_cast<char*>(&value), sizeof value, what);
    return value;
  }

  // A size and as many letters.
  std::string take_text(const std::string& what) {
    const auto size = take<std::uint32_t>(what);
    need(size, what);
    std::string text(size, ' ');
    read(text.data(), size, what);
    return text;
  }

 private:
  void need(std::uint64_t bytes, const std::string& what) const {
    if (bytes > size_ - at_)
      fail(fmt::format("{} of {} bytes at byte {}; the file has {}", what, bytes, at_, size_));
  }

  void read(char* bytes, std::size_t count, const std::string& what) {
    need(count, what);
    if (!stream_.read(bytes, std::streamsize(count))) throw system_file_error(file_, "cannot be read", errno);
    at_ += count;
  }

  const fs::path& file_;
  std::ifstream stream_;
  std::uint64_t size_, at_ = 0;
};

// What each entry of a map says of its size, against what OpenVDB takes for its type.
void check_metadata(Cursor& file, const std::string& whose, std::vector<std::uint64_t>& delayed_loads) {
  const auto count = file.take<std::uint32_t>("number of metadata of " + whose);
  for (std::uint32_t i = 0; i < count; ++i) {
    file.take_text("name of metadata of " + whose);
    const std::string type = file.take_text("type of metadata of " + whose);
    if (type == openvdb::io::DelayedLoadMetadata::staticTypeName())
      delayed_loads.push_back(file.at() - type.size());
    const auto bytes = file.take<std::uint32_t>("size of metadata of " + whose);
    const std::string what = fmt::format("metadata of {}", whose);
    // A text, or what OpenVDB does not know, is as long as it says; the others have the length of their type.
    if (openvdb::Metadata::isRegisteredType(type)) {
      const auto expected = openvdb::Metadata::createMetadata(type)->size();
      if (expected > 0 && expected != bytes)
        file.fail(fmt::format("{} of {} bytes; its type has {}", what, bytes, expected));
    }
    file.skip(bytes, what);
  }
}

}  // namespace

std::vector<std::uint64_t> check_vdb_structure(const fs::path& path) {
  openvdb::initialize();
  std::vector<std::uint64_t> delayed_loads;
  Cursor file(path);
  if (file.take<std::int64_t>("magic number") != vdb_magic) file.fail("it does not begin as one");
  const auto version = file.take<std::uint32_t>("format version");
  if (version < openvdb::OPENVDB_FILE_VERSION_NEW_TRANSFORM || version > openvdb::OPENVDB_FILE_VERSION)
    file.fail(fmt::format("format version {}; expected {} to {}", version,
                          int(openvdb::OPENVDB_FILE_VERSION_NEW_TRANSFORM), openvdb::OPENVDB_FILE_VERSION));
  file.skip(8, "library version");
  const bool has_offsets = file.take<char>("offset flag") != 0;
  const bool compression_in_head = version >= openvdb::OPENVDB_FILE_VERSION_SELECTIVE_COMPRESSION &&
                                   version < openvdb::OPENVDB_FILE_VERSION_NODE_MASK_COMPRESSION;
  if (compression_in_head) file.skip(1, "compression flag");
  file.skip(uuid_size, "UUID");
  check_metadata(file, "the file", delayed_loads);

  const auto grids = file.take<std::int32_t>("number of grids");
  for (std::int32_t g = 0; g < grids; ++g) {
    const std::string grid = fmt::format("grid {}", g);
    for (const char* part : {"name", "type", "parent"}) file.take_text(part + (" of " + grid));
    const auto begin = file.take<std::int64_t>("place of " + grid);
    file.skip(sizeof(std::int64_t), "place of blocks of " + grid);
    const auto end = file.take<std::int64_t>("end of " + grid);
    if (!has_offsets) break;  // the next grid begins where this one's values end, and only OpenVDB knows
    if (begin < 0 || end < begin || std::uint64_t(begin) < file.at())
      file.fail(fmt::format("{} goes from byte {} to {}", grid, begin, end));
    file.go_to(std::uint64_t(begin), grid);
    if (version >= openvdb::OPENVDB_FILE_VERSION_NODE_MASK_COMPRESSION)
      file.skip(sizeof(std::uint32_t), "compression flags of " + grid);
    check_metadata(file, grid, delayed_loads);
    file.take_text("transform of " + grid);
    file.go_to(std::uint64_t(end), "end of " + grid);
  }
  return delayed_loads;
}

}  // namespace anticrack
