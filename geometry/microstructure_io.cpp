#include "microstructure_io.h"

#include <fmt/format.h>
#include <openvdb/openvdb.h>
#include <openvdb/tools/ChangeBackground.h>
#include <openvdb/tools/Prune.h>

#include <algorithm>
#include <cmath>

#include "errors.h"
#include "files/vdb_file.h"
#include "level_sets/level_set.h"

namespace anticrack {
namespace {

namespace fs = std::filesystem;

// Keys of the lattice beside those of Microstructure::metadata.
constexpr const char* version_key = "anticrack_version";
constexpr const char* points_key = "lattice_points";
constexpr const char* spacing_key = "lattice_spacing";
constexpr const char* origin_key = "origin";
constexpr const char* solid_points_key = "solid_points";
constexpr const char* unit_key = "length_unit";

// Larger lattices are no samples but wrong numbers; a particle's number has 32 bits.
constexpr int most_along_an_axis = 1 << 20;
constexpr double most_in_all = 4294967295.0;

bool is_level_set_of_reals(const openvdb::GridBase& grid) {
  return grid.getGridClass() == openvdb::GRID_LEVEL_SET &&
         (grid.valueType() == "float" || grid.valueType() == "double");
}

// The level set named `surface`, else the first.
openvdb::GridBase::Ptr read_level_set(VdbFile& vdb, const fs::path& file) {
  const VdbFile::Entry* chosen = nullptr;
  std::string found;
  for (const VdbFile::Entry& entry : vdb.entries()) {
    found += fmt::format("{}'{}' ({}, {})", found.empty() ? "" : ", ", entry.descriptor.gridName(),
                         entry.grid->valueType(),
                         openvdb::GridBase::gridClassToString(entry.grid->getGridClass()));
    if (!is_level_set_of_reals(*entry.grid)) continue;
    if (!chosen || (entry.descriptor.gridName() == "surface" && chosen->descriptor.gridName() != "surface"))
      chosen = &entry;
  }
  if (!chosen)
    throw FileError(fmt::format("{}: no level set of float or double values; grids found: {}", file.string(),
                                found.empty() ? "none" : found));
  return vdb.read(*chosen);
}

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
  map.insertMeta(unit_key, openvdb::StringMetadata(std::string(structure.surface->unit.name)));
  map.insertMeta(solid_points_key, openvdb::Int64Metadata(std::int64_t(structure.solid_points)));
  return map;
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

// Of a file that does not say: metres.
LengthUnit read_length_unit(const openvdb::FloatGrid& grid, const fs::path& file) {
  const auto name = grid.getMetadata<openvdb::StringMetadata>(unit_key);
  if (!name) return length_units.front();
  if (const auto unit = find_length_unit(name->value())) return *unit;
  throw FileError(fmt::format("{}: grid '{}': length_unit = \"{}\"; expected m, mm, um, nm or pm",
                              file.string(), grid.getName(), name->value()));
}

openvdb::FloatGrid::Ptr fog_volume(const openvdb::FloatGrid& surface) {
  const auto fog = surface.deepCopy();
  const double voxel = surface.voxelSize()[0];
  for (auto value = fog->beginValueAll(); value; ++value) {
    const auto share = float(std::clamp(0.5 - *value / voxel, 0.0, 1.0));
    value.setValue(share);
    value.setActiveState(share > 0);
  }
  openvdb::tools::changeBackground(fog->tree(), 0.0f);
  openvdb::tools::pruneInactive(fog->tree());
  fog->setName("density");
  fog->setGridClass(openvdb::GRID_FOG_VOLUME);
  return fog;
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
    if (key == points_key || key == spacing_key || key == origin_key || key == solid_points_key ||
        key == unit_key)
      continue;
    if (const auto* integer = dynamic_cast<const openvdb::Int64Metadata*>(value.get()))
      result[key] = integer->value();
    if (const auto* number = dynamic_cast<const openvdb::DoubleMetadata*>(value.get()))
      result[key] = number->value();
    if (const auto* text = dynamic_cast<const openvdb::StringMetadata*>(value.get()))
      result[key] = text->value();
  }
  return result;
}

void count_solid_points(Microstructure& structure, const fs::path& file) {
  const auto [nx, ny, nz] = structure.lattice.points;
  if (std::max({nx, ny, nz}) > most_along_an_axis || double(nx) * ny * nz > most_in_all)
    throw FileError(
        fmt::format("{}: lattice of {} x {} x {} points; expected at most {} along an axis, {:.0f} "
                    "in all",
                    file.string(), nx, ny, nz, most_along_an_axis, most_in_all));
  try {
    structure.solid_points = seed_particles(structure, structure.lattice).size();
  } catch (const InputError& error) {
    throw FileError(fmt::format("{}: {}", file.string(), error.what()));
  }
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
  const double metres = structure.surface->unit.metres;
  structure.origin = metres * Vec3(box.min()[0], box.min()[1], box.min()[2]);
  structure.lattice.spacing = metres * spacing;
  for (int axis = 0; axis < 3; ++axis) {
    const double points = std::max(1.0, std::round(box.extents()[axis] / spacing));
    if (!(points <= most_along_an_axis))
      throw FileError(fmt::format("{}: grid '{}' spans {:g} voxels along an axis; expected at most {}",
                                  file.string(), grid.getName(), points, most_along_an_axis));
    structure.lattice.points[axis] = int(points);
  }
  structure.metadata["source"] = "vdb";
  count_solid_points(structure, file);
}

}  // namespace

void write_microstructure(const Microstructure& structure, const fs::path& file, DensityGrid density) {
  const openvdb::MetaMap metadata = to_openvdb(structure);
  const auto grid = structure.surface->grid->deepCopyGrid();
  for (auto entry = metadata.beginMeta(); entry != metadata.endMeta(); ++entry)
    grid->insertMeta(entry->first, *entry->second);
  openvdb::GridCPtrVec grids = {grid};
  if (density == DensityGrid::add) grids.push_back(fog_volume(*structure.surface->grid));
  write_vdb(file, grids, metadata);
}

Microstructure read_microstructure(const fs::path& file) {
  if (!fs::exists(file)) throw FileError(fmt::format("{}: no such file", file.string()));
  VdbFile vdb(file);
  const auto grid = to_float(read_level_set(vdb, file));
  Microstructure structure;
  structure.surface = std::make_shared<LevelSet>(LevelSet{grid, read_length_unit(*grid, file)});
  structure.metadata = read_metadata(*grid);
  if (!read_own_metadata(*grid, structure))
    infer_sample_box(*grid, file, structure);
  else if (!vdb.sealed())  // another program has rewritten, and perhaps changed, a file of ours
    count_solid_points(structure, file);
  return structure;
}

}  // namespace anticrack
