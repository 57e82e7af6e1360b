#include "files/vdb_file.h"

#include <fmt/format.h>

#include <cerrno>
#include <fstream>
#include <utility>

#include "errors.h"
#include "files/atomic_file.h"
#include "files/vdb_seal.h"
#include "files/vdb_structure.h"

namespace anticrack {
namespace {

namespace fs = std::filesystem;

class Writer : public openvdb::io::Archive {
 public:
  void write_to(const fs::path& file, const openvdb::GridCPtrVec& grids, const openvdb::MetaMap& metadata) {
    std::ofstream stream;
    stream.exceptions(std::ios::badbit | std::ios::failbit);
    stream.open(file, std::ios::binary);
    Archive::write(stream, grids, /*seekable=*/true, metadata);
    stream.close();
  }
};

// A file in which some bytes read as 'x'.
class MaskedFile : public std::filebuf {
 public:
  explicit MaskedFile(std::vector<std::uint64_t> places) : places_(std::move(places)) {}

 protected:
  std::streamsize xsgetn(char* bytes, std::streamsize count) override {
    const std::streamoff begin = seekoff(0, std::ios::cur, std::ios::in);
    const std::streamsize taken = std::filebuf::xsgetn(bytes, count);
    for (const std::uint64_t place : places_)
      if (std::streamoff(place) >= begin && std::streamoff(place) < begin + taken)
        bytes[std::streamoff(place) - begin] = 'x';
    return taken;
  }

 private:
  std::vector<std::uint64_t> places_;
};

// Gives whatever OpenVDB or a stream throws the file's name.
template <class Body>
auto with_file_name(const fs::path& file, const Body& body) {
  try {
    return body();
  } catch (const std::ios_base::failure&) {
    throw FileError(fmt::format("{}: cannot be read: the file is damaged or cut short", file.string()));
  } catch (const std::exception& error) {
    throw FileError(fmt::format("{}: cannot be read: {}", file.string(), error.what()));
  }
}

}  // namespace

void write_vdb(const fs::path& file, const openvdb::GridCPtrVec& grids, const openvdb::MetaMap& metadata) {
  openvdb::initialize();
  write_atomically(file, [&](const fs::path& temporary) {
    Writer().write_to(temporary, grids, metadata);
    seal_vdb(temporary);
  });
}

// With another type name, metadata for delayed loading are bytes that nobody interprets.
VdbFile::VdbFile(const fs::path& file) : file_(file), sealed_(check_vdb_seal(file)), stream_(nullptr) {
  auto buffer = std::make_unique<MaskedFile>(check_vdb_structure(file));
  errno = 0;
  if (!buffer->open(file, std::ios::in | std::ios::binary))
    throw system_file_error(file, "cannot be opened", errno);
  buffer_ = std::move(buffer);
  stream_.rdbuf(buffer_.get());
  stream_.exceptions(std::ios::failbit | std::ios::badbit | std::ios::eofbit);
  with_file_name(file, [&] { read_entries(); });
}

// Where the file has no offsets to skip them by, the values too.
void VdbFile::read_entries() {
  readHeader(stream_);
  setFormatVersion(stream_);
  setLibraryVersion(stream_);
  setDataCompression(stream_);
  metadata_.readMeta(stream_);
  for (std::int32_t count = readGridCount(stream_); count > 0; --count) {
    Entry& entry = entries_.emplace_back();
    entry.grid = entry.descriptor.read(stream_);
    if (inputHasGridOffsets()) {
      entry.descriptor.seekToGrid(stream_);
      readGridCompression(stream_);
      entry.grid->readMeta(stream_);
      entry.grid->readTransform(stream_);
      entry.descriptor.seekToEnd(stream_);
    } else {
      readGrid(entry.grid, entry.descriptor, stream_);
    }
    entry.grid->removeMeta(openvdb::GridBase::META_FILE_DELAYED_LOAD);
  }
}

openvdb::GridBase::Ptr VdbFile::read(const Entry& entry) {
  if (inputHasGridOffsets()) with_file_name(file_, [&] { read_values(entry); });
  entry.grid->removeMeta(openvdb::GridBase::META_FILE_DELAYED_LOAD);
  return entry.grid;
}

// A grid whose tree is another grid's is written without it.
void VdbFile::read_values(const Entry& entry) {
  NamedGridMap grids;
  for (const Entry& other : entries_) {
    const openvdb::Name& name = other.descriptor.uniqueName();
    if (name != entry.descriptor.uniqueName() && name != entry.descriptor.instanceParentName()) continue;
    other.descriptor.seekToGrid(stream_);
    readGrid(other.grid, other.descriptor, stream_);
    grids[name] = other.grid;
  }
  connectInstance(entry.descriptor, grids);
}

}  // namespace anticrack
