#include "microstructure_io.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <openvdb/openvdb.h>
#include <unistd.h>

#include <cerrno>
#include <cmath>
#include <fstream>
#include <system_error>

#include "errors.h"
#include "file_seal.h"
#include "level_set.h"

namespace anticrack {
namespace {

namespace fs = std::filesystem;

// Keys of the lattice beside those of Microstructure::metadata.
constexpr const char* version_key = "anticrack_version";
constexpr const char* points_key = "lattice_points";
constexpr const char* spacing_key = "lattice_spacing";
constexpr const char* origin_key = "origin";
constexpr const char* solid_points_key = "solid_points";

// Runs `body`, giving whatever OpenVDB or the system throws the file's name.
template <class Body>
auto with_file_errors(const fs::path& file, const char* action, Body body) {
  try {
    openvdb::initialize();
    return body();
  } catch (const FileError&) {
    throw;
  } catch (const std::ios_base::failure&) {
    throw FileError(fmt::format("{}: cannot {}: the file is damaged or cut short", file.string(), action));
  } catch (const std::exception& error) {
    throw FileError(fmt::format("{}: cannot {}: {}", file.string(), action, error.what()));
  }
}

bool is_level_set_of_reals(const openvdb::GridBase& grid) {
  return grid.getGridClass() == openvdb::GRID_LEVEL_SET &&
         (grid.valueType() == "float" || grid.valueType() == "double");
}

// openvdb::io::File does not look at the state of its stream: a full disk passes unnoticed and a file cut
// short reads as anything, at any size. This archive works on streams that throw.
class StrictArchive : public openvdb::io::Archive {
 public:
  static void write_file(const fs::path& file, const openvdb::GridCPtrVec& grids,
                         const openvdb::MetaMap& metadata) {
    std::ofstream stream;
    stream.exceptions(std::ios::failbit | std::ios::badbit);
    try {
      stream.open(file, std::ios::binary);
      StrictArchive().write(stream, grids, /*seekable=*/true, metadata);
      stream.close();
    } catch (const std::ios_base::failure&) {
      throw std::system_error(errno, std::generic_category());
    }
  }

  // The level set named `surface`, else the first.
  static openvdb::GridBase::Ptr read_level_set(const fs::path& file) {
    std::ifstream stream;
    stream.exceptions(std::ios::failbit | std::ios::badbit | std::ios::eofbit);
    stream.open(file, std::ios::binary);
    StrictArchive archive;
    const std::vector<Entry> entries = archive.read_entries(stream);
    const Entry* chosen = nullptr;
    std::string found;
    for (const Entry& entry : entries) {
      found += fmt::format("{}'{}' ({}, {})", found.empty() ? "" : ", ", entry.descriptor.gridName(),
                           entry.grid->valueType(),
                           openvdb::GridBase::gridClassToString(entry.grid->getGridClass()));
      if (!is_level_set_of_reals(*entry.grid)) continue;
      if (!chosen || (entry.descriptor.gridName() == "surface" && chosen->descriptor.gridName() != "surface"))
        chosen = &entry;
    }
    if (!chosen)
      throw FileError(fmt::format("{}: no level set of float or double values; grids found: {}",
                                  file.string(), found.empty() ? "none" : found));
    if (archive.inputHasGridOffsets()) archive.read_values(stream, *chosen, entries);
    return chosen->grid;
  }

 private:
  struct Entry {
    openvdb::io::GridDescriptor descriptor;
    openvdb::GridBase::Ptr grid;
  };

  // All grids with their metadata; with their values too where the file has no offsets to skip them by.
  std::vector<Entry> read_entries(std::istream& stream) {
    readHeader(stream);
    setFormatVersion(stream);
    setLibraryVersion(stream);
    setDataCompression(stream);
    openvdb::MetaMap().readMeta(stream);
    std::vector<Entry> entries;
    for (std::int32_t count = readGridCount(stream); count > 0; --count) {
      Entry& entry = entries.emplace_back();
      entry.grid = entry.descriptor.read(stream);
      if (inputHasGridOffsets()) {
        entry.descriptor.seekToGrid(stream);
        readGridCompression(stream);
        entry.grid->readMeta(stream);
        entry.descriptor.seekToEnd(stream);
      } else {
        readGrid(entry.grid, entry.descriptor, stream);
      }
    }
    return entries;
  }

  // A grid whose tree is another grid's is written without it.
  void read_values(std::istream& stream, const Entry& entry, const std::vector<Entry>& entries) {
    NamedGridMap grids;
    for (const Entry& other : entries) {
      const openvdb::Name& name = other.descriptor.uniqueName();
      if (name != entry.descriptor.uniqueName() && name != entry.descriptor.instanceParentName()) continue;
      other.descriptor.seekToGrid(stream);
      readGrid(other.grid, other.descriptor, stream);
      grids[name] = other.grid;
    }
    connectInstance(entry.descriptor, grids);
  }
};

openvdb::MetaMap to_openvdb(const Microstructure& structure) {
  openvdb::MetaMap map;
  for (const auto& [key, value] : structure.metadata) {
    if (const auto* integer = std::get_if<std::int64_t>(&value))
      map.insertMeta(key, openvdb::Int64Metadata(*integer));
    if (const auto* number = std::get_if<double>(&value))
      map.insertMeta(key, openvdb::DoubleMetadata(*number));
    if (const auto* text = std::get_if<std::string>(&value))
      map.insertMeta(key, openvdb::StringMetadata(*text));
  }
  const auto& [points, spacing] = structure.lattice;
  const Vec3& origin = structure.origin;
  map.insertMeta(version_key, openvdb::StringMetadata(ANTICRACK_VERSION));
  map.insertMeta(points_key, openvdb::Vec3IMetadata(openvdb::Vec3i(points[0], points[1], points[2])));
  map.insertMeta(spacing_key, openvdb::DoubleMetadata(spacing));
  map.insertMeta(origin_key, openvdb::Vec3DMetadata(openvdb::Vec3d(origin[0], origin[1], origin[2])));
  map.insertMeta(solid_points_key, openvdb::Int64Metadata(std::int64_t(structure.solid_points)));
  return map;
}

void flush_to_disk(const fs::path& file) {
  const int descriptor = ::open(file.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor < 0) throw std::system_error(errno, std::generic_category(), "open");
  const int failed = ::fsync(descriptor), reason = errno;
  ::close(descriptor);
  if (failed) throw std::system_error(reason, std::generic_category(), "fsync");
}

openvdb::FloatGrid::Ptr to_float(const openvdb::GridBase::Ptr& grid) {
  if (auto floats = openvdb::gridPtrCast<openvdb::FloatGrid>(grid)) return floats;
  const auto doubles = openvdb::gridPtrCast<openvdb::DoubleGrid>(grid);
  auto converted =
      std::make_shared<openvdb::FloatGrid>(std::make_shared<openvdb::FloatTree>(doubles->constTree()));
  converted->insertMeta(*grid);
  converted->setTransform(grid->transformPtr());
  return converted;
}

// Lattice, counts and metadata of our own files; false if the grid does not carry them.
bool read_own_metadata(const openvdb::FloatGrid& grid, Microstructure& structure) {
  const auto points = grid.getMetadata<openvdb::Vec3IMetadata>(points_key);
  const auto spacing = grid.getMetadata<openvdb::DoubleMetadata>(spacing_key);
  const auto origin = grid.getMetadata<openvdb::Vec3DMetadata>(origin_key);
  const auto solid = grid.getMetadata<openvdb::Int64Metadata>(solid_points_key);
  if (!points || !spacing || !origin || !solid || points->value()[0] < 1 || points->value()[1] < 1 ||
      points->value()[2] < 1 || !(spacing->value() > 0) || !std::isfinite(spacing->value()) ||
      solid->value() < 1)
    return false;
  structure.lattice = {{points->value()[0], points->value()[1], points->value()[2]}, spacing->value()};
  structure.origin = {origin->value()[0], origin->value()[1], origin->value()[2]};
  structure.solid_points = std::size_t(solid->value());
  return true;
}

std::map<std::string, MetadataValue> read_metadata(const openvdb::FloatGrid& grid) {
  std::map<std::string, MetadataValue> result;
  for (auto entry = grid.beginMeta(); entry != grid.endMeta(); ++entry) {
    const auto& [key, value] = *entry;
    if (key == points_key || key == spacing_key || key == origin_key || key == solid_points_key) continue;
    if (const auto* integer = dynamic_cast<const openvdb::Int64Metadata*>(value.get()))
      result[key] = integer->value();
    if (const auto* number = dynamic_cast<const openvdb::DoubleMetadata*>(value.get()))
      result[key] = number->value();
    if (const auto* text = dynamic_cast<const openvdb::StringMetadata*>(value.get()))
      result[key] = text->value();
  }
  return result;
}

void count_solid_points(Microstructure& structure) {
  structure.solid_points = seed_particles(structure, structure.lattice).size();
  structure.metadata["solid_fraction_achieved"] = structure.solid_fraction();
}

// The sample box of a level set from elsewhere: its solid voxels' bounding box, each voxel a cube about its
// point.
void infer_sample_box(const openvdb::FloatGrid& grid, const fs::path& file, Microstructure& structure) {
  if (!grid.transform().isLinear() || !(grid.background() > 0))
    throw FileError(fmt::format(
        "{}: grid '{}': expected a linear transform and a positive background value, got {} and {:g}",
        file.string(), grid.getName(), grid.transform().mapType(), grid.background()));
  openvdb::CoordBBox solid;
  for (auto value = grid.cbeginValueAll(); value; ++value)
    if (*value < 0) solid.expand(value.getBoundingBox());
  if (solid.empty())
    throw FileError(
        fmt::format("{}: grid '{}' has no solid (no negative value)", file.string(), grid.getName()));

  const openvdb::BBoxd box = grid.transform().indexToWorld(openvdb::BBoxd(
      solid.min().asVec3d() - openvdb::Vec3d(0.5), solid.max().asVec3d() + openvdb::Vec3d(0.5)));
  const openvdb::Vec3d voxel = grid.voxelSize();
  const double spacing = grid.hasUniformVoxels() ? voxel[0] : std::cbrt(voxel[0] * voxel[1] * voxel[2]);
  structure.origin = {box.min()[0], box.min()[1], box.min()[2]};
  structure.lattice.spacing = spacing;
  for (int axis = 0; axis < 3; ++axis) {
    const double points = std::max(1.0, std::round(box.extents()[axis] / spacing));
    constexpr double most = 1 << 20;
    if (!(points <= most))
      throw FileError(fmt::format("{}: grid '{}' spans {:g} voxels along an axis; expected at most {:g}",
                                  file.string(), grid.getName(), points, most));
    structure.lattice.points[axis] = int(points);
  }
  structure.metadata["source"] = "vdb";
  count_solid_points(structure);
}

}  // namespace

void write_microstructure(const Microstructure& structure, const fs::path& file) {
  const fs::path temporary = file.string() + fmt::format(".{}.tmp", ::getpid());
  with_file_errors(file, "write", [&] {
    try {
      const openvdb::MetaMap metadata = to_openvdb(structure);
      const auto grid = structure.surface->grid->deepCopyGrid();
      for (auto entry = metadata.beginMeta(); entry != metadata.endMeta(); ++entry)
        grid->insertMeta(entry->first, *entry->second);
      StrictArchive::write_file(temporary, {grid}, metadata);
      seal_file(temporary);
      flush_to_disk(temporary);
      fs::rename(temporary, file);
    } catch (...) {
      std::error_code ignored;
      fs::remove(temporary, ignored);
      throw;
    }
  });
}

Microstructure read_microstructure(const fs::path& file) {
  if (!fs::exists(file)) throw FileError(fmt::format("{}: no such file", file.string()));
  return with_file_errors(file, "read", [&] {
    // OpenVDB does not survive every damaged file, so our own are checked before it sees them.
    const Seal seal = check_seal(file);
    if (seal == Seal::broken)
      throw FileError(fmt::format("{}: damaged: its checksum does not match", file.string()));
    Microstructure structure;
    const auto grid = to_float(StrictArchive::read_level_set(file));
    structure.surface = std::make_shared<LevelSet>(LevelSet{grid});
    structure.metadata = read_metadata(*grid);
    if (!read_own_metadata(*grid, structure))
      infer_sample_box(*grid, file, structure);
    else if (seal == Seal::absent)  // another program has rewritten, and perhaps changed, a file of ours
      count_solid_points(structure);
    return structure;
  });
}

}  // namespace anticrack
