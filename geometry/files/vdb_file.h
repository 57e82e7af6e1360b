#pragma once

#include <openvdb/openvdb.h>

#include <filesystem>
#include <istream>
#include <memory>
#include <string>
#include <vector>

namespace anticrack {

/// Writes a sealed file, atomically; openvdb::io::File does not notice a full disk. @throws FileError
void write_vdb(const std::filesystem::path& file, const openvdb::GridCPtrVec& grids,
               const openvdb::MetaMap& metadata = {});

/// Reads a file by streams that throw: openvdb::io::File does not look at the state of its own, and takes a
/// file cut short for anything, at any size.
class VdbFile : private openvdb::io::Archive {
 public:
  struct Entry {
    openvdb::io::GridDescriptor descriptor;
    openvdb::GridBase::Ptr grid;  ///< with its metadata and transform, but no values yet
  };

  /// Checks the seal and the structure, and reads all but the values of the grids. @throws FileError
  explicit VdbFile(const std::filesystem::path& file);

  bool sealed() const { return sealed_; }
  std::string version() const { return Archive::version(); }
  const openvdb::MetaMap& metadata() const { return metadata_; }
  const std::vector<Entry>& entries() const { return entries_; }
  /// The grid of one of the entries, with its values. @throws FileError
  openvdb::GridBase::Ptr read(const Entry& entry);

 private:
  void read_entries();
  void read_values(const Entry& entry);

  std::filesystem::path file_;
  bool sealed_;
  std::unique_ptr<std::streambuf> buffer_;
  std::istream stream_;
  openvdb::MetaMap metadata_;
  std::vector<Entry> entries_;
};

}  // namespace anticrack
