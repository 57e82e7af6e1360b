#include <fmt/format.h>

#include "errors.h"
#include "files/vdb_file.h"
#include "info.h"

namespace anticrack {

namespace {

/// Metadata of no interest to a user: OpenVDB writes it for itself.
bool is_internal(const std::string& name) {
  return name.starts_with("file_") || name == "class" || name == "name" || name == "is_saved_as_half_float" ||
         name == "is_local_space" || name == "vector_type" || name == "creator";
}

/// Leaves out what `known` says already.
std::string list_metadata(const openvdb::MetaMap& metadata, const openvdb::MetaMap& known,
                          std::string_view indent) {
  std::string text;
  for (auto it = metadata.beginMeta(); it != metadata.endMeta(); ++it) {
    const openvdb::Metadata::ConstPtr same = known[it->first];
    if (is_internal(it->first) || (same && *same == *it->second)) continue;
    text += fmt::format("{}{} = {}\n", indent, it->first, it->second->str());
  }
  return text;
}

std::string describe_grid(const openvdb::GridBase& grid, const openvdb::MetaMap& of_file) {
  std::string text = fmt::format("grid \"{}\": {}, {}\n", grid.getName(), grid.type(),
                                 openvdb::GridBase::gridClassToString(grid.getGridClass()));
  const openvdb::Vec3d voxel = grid.voxelSize();
  text += fmt::format("  voxel size {:.9g} x {:.9g} x {:.9g}\n", voxel[0], voxel[1], voxel[2]);
  if (const auto count = grid.getMetadata<openvdb::Int64Metadata>("file_voxel_count")) {
    text += fmt::format("  active voxels {}\n", count->value());
  }
  const auto lower = grid.getMetadata<openvdb::Vec3IMetadata>("file_bbox_min");
  const auto upper = grid.getMetadata<openvdb::Vec3IMetadata>("file_bbox_max");
  if (lower && upper) {
    const openvdb::Vec3i a = lower->value(), b = upper->value();
    text += fmt::format("  index box [{}, {}, {}] to [{}, {}, {}]\n", a[0], a[1], a[2], b[0], b[1], b[2]);
  }
  return text + list_metadata(grid, of_file, "  ");
}

}  // namespace

std::string describe_vdb(const std::filesystem::path& file) {
  const VdbFile vdb(file);
  std::string text = fmt::format("{}: OpenVDB file, format version {}\n", file.string(), vdb.version());
  text += list_metadata(vdb.metadata(), {}, "");
  for (const VdbFile::Entry& entry : vdb.entries()) text += describe_grid(*entry.grid, vdb.metadata());
  return text;
}

}  // namespace anticrack
