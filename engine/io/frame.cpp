#include "io/frame.h"

#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/parallel_reduce.h>
#include <oneapi/tbb/parallel_sort.h>
#include <openvdb/openvdb.h>
#include <openvdb/points/PointDataGrid.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <numeric>
#include <span>

#include "errors.h"
#include "files/vdb_file.h"
#include "io/frame_file_name.h"
#include "io/solid_raster.h"
#include "length_unit.h"

namespace anticrack {
namespace {

namespace fs = std::filesystem;
namespace vdb = openvdb;
namespace points = openvdb::points;

using PointLeaf = points::PointDataTree::LeafNodeType;
template <class T>
using Attribute = points::TypedAttributeArray<T, points::NullCodec>;

constexpr int format_version = 1;

// ---- header <-> metadata of the file

LengthUnit unit_of(const FrameHeader& header) {
  return length_unit_for(std::min(header.cell_size, header.particle_spacing));
}

vdb::MetaMap metadata_of(const FrameHeader& header) {
  const auto vector = [](const auto& v) { return vdb::Vec3DMetadata(vdb::Vec3d(v[0], v[1], v[2])); };
  vdb::MetaMap map;
  map.insertMeta("creator", vdb::StringMetadata("anticrack"));
  map.insertMeta("frame_format", vdb::Int32Metadata(format_version));
  map.insertMeta("index", vdb::Int32Metadata(header.index));
  map.insertMeta("step", vdb::Int64Metadata(header.step));
  map.insertMeta("time", vdb::DoubleMetadata(header.time));
  map.insertMeta("strain", vector(header.strain));
  map.insertMeta("seconds_since_last_frame", vdb::DoubleMetadata(header.seconds_since_last_frame));
  map.insertMeta("box_lower", vector(header.box_lower));
  map.insertMeta("box_upper", vector(header.box_upper));
  map.insertMeta("particle_spacing", vdb::DoubleMetadata(header.particle_spacing));
  map.insertMeta("cell_size", vdb::DoubleMetadata(header.cell_size));
  map.insertMeta("run", vdb::StringMetadata(header.run));
  map.insertMeta("length_unit", vdb::StringMetadata(std::string(unit_of(header).name)));
  return map;
}

template <class T>
T metadata_value(const vdb::MetaMap& map, const char* name) {
  const auto found = map.getMetadata<vdb::TypedMetadata<T>>(name);
  if (!found) throw FileError(std::string("metadata \"") + name + "\" is missing or of another type");
  return found->value();
}

FrameHeader header_of(const vdb::MetaMap& map) {
  const int version = metadata_value<vdb::Int32>(map, "frame_format");
  if (version != format_version)
    throw FileError("frame format " + std::to_string(version) + "; this program reads format " +
                    std::to_string(format_version));
  const auto vector = [&](const char* name) {
    const auto v = metadata_value<vdb::Vec3d>(map, name);
    return Vec3(v[0], v[1], v[2]);
  };
  FrameHeader header;
  header.index = metadata_value<vdb::Int32>(map, "index");
  header.step = metadata_value<vdb::Int64>(map, "step");
  header.time = metadata_value<double>(map, "time");
  Vec3::Map(header.strain.data()) = vector("strain");
  header.seconds_since_last_frame = metadata_value<double>(map, "seconds_since_last_frame");
  header.box_lower = vector("box_lower");
  header.box_upper = vector("box_upper");
  header.particle_spacing = metadata_value<double>(map, "particle_spacing");
  header.cell_size = metadata_value<double>(map, "cell_size");
  header.run = metadata_value<std::string>(map, "run");
  return header;
}

// Older frames do not say their unit: metres.
double metres_of(const vdb::MetaMap& map) {
  if (!map.getMetadata<vdb::StringMetadata>("length_unit")) return 1;
  const auto name = metadata_value<std::string>(map, "length_unit");
  if (const auto unit = find_length_unit(name)) return unit->metres;
  throw FileError("metadata \"length_unit\" is \"" + name + "\"; expected m, mm, um, nm or pm");
}

// ---- what a frame must be

void check_sizes(const Frame& frame) {
  const auto check = [&](const char* name, std::size_t size, bool optional) {
    if (size == frame.id.size() || (optional && size == 0)) return;
    throw InputError("frame " + std::to_string(frame.header.index) + ": " + std::to_string(size) +
                     " entries of " + name + " for " + std::to_string(frame.id.size()) + " particles");
  };
  check("position", frame.position.size(), false);
  check("velocity", frame.velocity.size(), true);
  check("kappa", frame.kappa.size(), true);
  check("dkappa", frame.dkappa.size(), true);
  check("pressure", frame.pressure.size(), true);
  check("von_mises", frame.von_mises.size(), true);
}

// Keeps voxel and leaf coordinates within their share of the sorting key; also refuses what is not finite.
void check_positions(const Frame& frame) {
  const auto positive = [](double length) { return std::isfinite(length) && length > 0; };
  if (!positive(frame.header.cell_size) || !positive(frame.header.particle_spacing))
    throw InputError("frame " + std::to_string(frame.header.index) +
                     ": cell_size = " + std::to_string(frame.header.cell_size) + ", particle_spacing = " +
                     std::to_string(frame.header.particle_spacing) + "; expected both > 0");
  const double limit = 262144 * std::min(frame.header.cell_size, frame.header.particle_spacing);
  const auto within = [limit](float x) { return std::abs(x) < limit; };
  const std::size_t count = frame.position.size();
  const std::size_t bad = tbb::parallel_reduce(
      tbb::blocked_range<std::size_t>(0, count, 1 << 16), count,
      [&](const auto& range, std::size_t first) {
        for (std::size_t i = range.begin(); i != range.end(); ++i)
          if (!std::ranges::all_of(frame.position[i], within)) first = std::min(first, i);
        return first;
      },
      [](std::size_t a, std::size_t b) { return std::min(a, b); });
  if (bad < count)
    throw InputError("frame " + std::to_string(frame.header.index) + ": particle " +
                     std::to_string(frame.id[bad]) +
                     " is at a position that is not finite or farther than 262144 cells from the origin");
}

// ---- particles -> point grid

// Voxels are centred on whole numbers of the index space, and so is the position within its voxel.
vdb::Coord voxel_of(const std::array<float, 3>& position, double inverse_cell_size) {
  const auto coordinate = [&](int axis) { return int(std::floor(position[axis] * inverse_cell_size + 0.5)); };
  return {coordinate(0), coordinate(1), coordinate(2)};
}

struct SortedParticle {
  std::uint64_t key;  // leaf and voxel
  std::uint32_t id;
  std::uint32_t index;

  std::uint64_t leaf() const { return key >> 9; }
  auto operator<=>(const SortedParticle&) const = default;
};

std::uint64_t sorting_key(const vdb::Coord& voxel) {
  const auto leaf = [](int coordinate) { return std::uint64_t((coordinate >> 3) + 32768); };
  return (leaf(voxel.x()) << 32 | leaf(voxel.y()) << 16 | leaf(voxel.z())) << 9 |
         PointLeaf::coordToOffset(voxel);
}

// By leaf, voxel, id: the file depends on the particles, not on their order in memory.
std::vector<SortedParticle> sort_particles(const Frame& frame) {
  const double inverse_cell_size = 1 / frame.header.cell_size;
  std::vector<SortedParticle> sorted(frame.id.size());
  tbb::parallel_for(std::uint32_t(0), std::uint32_t(sorted.size()), [&](std::uint32_t i) {
    sorted[i] = {sorting_key(voxel_of(frame.position[i], inverse_cell_size)), frame.id[i], i};
  });
  tbb::parallel_sort(sorted);
  return sorted;
}

template <class T>
vdb::NamePair type_of() {
  return Attribute<T>::attributeType();
}

points::AttributeSet::Descriptor::Ptr descriptor_of(const Frame& frame) {
  auto descriptor = points::AttributeSet::Descriptor::create(type_of<vdb::Vec3f>());
  descriptor = descriptor->duplicateAppend("id", type_of<std::int32_t>());
  if (!frame.velocity.empty()) descriptor = descriptor->duplicateAppend("v", type_of<vdb::Vec3f>());
  const auto add_scalar = [&](const char* name, const std::vector<float>& values) {
    if (!values.empty()) descriptor = descriptor->duplicateAppend(name, type_of<float>());
  };
  add_scalar("kappa", frame.kappa);
  add_scalar("dkappa", frame.dkappa);
  add_scalar("pressure", frame.pressure);
  add_scalar("von_mises", frame.von_mises);
  return descriptor;
}

template <class T, class Value>
void fill_attribute(PointLeaf& leaf, const char* name, std::span<const SortedParticle> particles,
                    const Value& value) {
  points::AttributeWriteHandle<T, points::NullCodec> handle(leaf.attributeArray(name));
  for (std::size_t i = 0; i < particles.size(); ++i) handle.set(vdb::Index(i), value(particles[i].index));
  handle.compact();  // one number where all are equal, as dkappa of elastic regions
}

std::unique_ptr<PointLeaf> make_leaf(const Frame& frame, std::span<const SortedParticle> particles,
                                     const points::AttributeSet::Descriptor::Ptr& descriptor) {
  const double inverse_cell_size = 1 / frame.header.cell_size;
  const vdb::Coord first = voxel_of(frame.position[particles.front().index], inverse_cell_size);
  auto leaf = std::make_unique<PointLeaf>(first & ~(PointLeaf::DIM - 1));
  leaf->replaceAttributeSet(new points::AttributeSet(descriptor, vdb::Index(particles.size())), true);

  // The value of a voxel is the end of its particles.
  std::array<vdb::Index32, PointLeaf::SIZE> end{};
  for (const SortedParticle& particle : particles) ++end[particle.key & (PointLeaf::SIZE - 1)];
  std::partial_sum(end.begin(), end.end(), end.begin());
  leaf->setOffsets({end.begin(), end.end()});

  fill_attribute<vdb::Vec3f>(*leaf, "P", particles, [&](std::uint32_t i) {
    const vdb::Coord voxel = voxel_of(frame.position[i], inverse_cell_size);
    const auto within = [&](int axis) {
      return float(frame.position[i][axis] * inverse_cell_size - voxel[axis]);
    };
    return vdb::Vec3f(within(0), within(1), within(2));
  });
  fill_attribute<std::int32_t>(*leaf, "id", particles,
                               [&](std::uint32_t i) { return std::int32_t(frame.id[i]); });
  if (!frame.velocity.empty())
    fill_attribute<vdb::Vec3f>(*leaf, "v", particles,
                               [&](std::uint32_t i) { return vdb::Vec3f(frame.velocity[i].data()); });
  const auto fill_scalar = [&](const char* name, const std::vector<float>& values) {
    if (!values.empty())
      fill_attribute<float>(*leaf, name, particles, [&](std::uint32_t i) { return values[i]; });
  };
  fill_scalar("kappa", frame.kappa);
  fill_scalar("dkappa", frame.dkappa);
  fill_scalar("pressure", frame.pressure);
  fill_scalar("von_mises", frame.von_mises);
  return leaf;
}

points::PointDataGrid::Ptr make_point_grid(const Frame& frame, const std::vector<SortedParticle>& sorted) {
  std::vector<std::size_t> begin;  // of each leaf's particles
  for (std::size_t i = 0; i < sorted.size(); ++i)
    if (i == 0 || sorted[i].leaf() != sorted[i - 1].leaf()) begin.push_back(i);
  begin.push_back(sorted.size());

  const auto descriptor = descriptor_of(frame);
  std::vector<std::unique_ptr<PointLeaf>> leaves(begin.size() - 1);
  tbb::parallel_for(std::size_t(0), leaves.size(), [&](std::size_t l) {
    leaves[l] = make_leaf(frame, std::span(sorted).subspan(begin[l], begin[l + 1] - begin[l]), descriptor);
  });

  const auto grid = points::PointDataGrid::create();
  grid->setName("particles");
  grid->setTransform(
      vdb::math::Transform::createLinearTransform(frame.header.cell_size / unit_of(frame.header).metres));
  for (auto& leaf : leaves) grid->tree().addLeaf(leaf.release());
  return grid;
}

// ---- particles -> float grids

vdb::FloatGrid::Ptr make_float_grid(const char* name, const SolidRaster& raster,
                                    const std::vector<SolidRaster::Block>& values, double spacing) {
  using Leaf = vdb::FloatTree::LeafNodeType;
  std::vector<std::unique_ptr<Leaf>> leaves(values.size());
  tbb::parallel_for(std::size_t(0), leaves.size(), [&](std::size_t b) {
    const auto& [x, y, z] = raster.origin[b];
    leaves[b] = std::make_unique<Leaf>(vdb::Coord(x, y, z));
    std::ranges::copy(values[b], leaves[b]->buffer().data());
    Leaf::NodeMaskType has_solid;
    for (vdb::Index voxel = 0; voxel < Leaf::SIZE; ++voxel) has_solid.set(voxel, raster.solid[b][voxel] > 0);
    leaves[b]->setValueMask(has_solid);
  });

  const auto grid = vdb::FloatGrid::create(0.0f);
  grid->setName(name);
  grid->setGridClass(vdb::GRID_FOG_VOLUME);
  const auto transform = vdb::math::Transform::createLinearTransform(spacing);
  transform->postTranslate(vdb::Vec3d(0.5 * spacing));
  grid->setTransform(transform);
  for (auto& leaf : leaves) grid->tree().addLeaf(leaf.release());
  return grid;
}

void add_float_grids(vdb::GridCPtrVec& grids, const Frame& frame, const std::vector<SortedParticle>& sorted) {
  std::vector<std::array<float, 3>> position(sorted.size());
  std::vector<float> kappa(frame.kappa.empty() ? 0 : sorted.size());
  for (std::size_t i = 0; i < sorted.size(); ++i) {
    position[i] = frame.position[sorted[i].index];
    if (!kappa.empty()) kappa[i] = frame.kappa[sorted[i].index];
  }
  const double spacing = frame.header.particle_spacing;
  const SolidRaster raster = rasterize_solid(position, kappa, spacing);
  grids.push_back(make_float_grid("solid", raster, raster.solid, spacing / unit_of(frame.header).metres));
  if (!kappa.empty())
    grids.push_back(make_float_grid("kappa", raster, raster.kappa, spacing / unit_of(frame.header).metres));
}

// ---- point grid -> particles

template <class T>
const points::AttributeArray& attribute_of(const PointLeaf& leaf, const char* name) {
  const auto position = leaf.attributeSet().find(name);
  if (position == points::AttributeSet::INVALID_POS)
    throw FileError(std::string("attribute \"") + name + "\" of its particles is missing");
  const auto& array = leaf.constAttributeArray(position);
  if (!array.hasValueType<T>())
    throw FileError(std::string("attribute \"") + name + "\" of its particles is of type " +
                    array.valueType() + "; expected " + vdb::typeNameAsString<T>());
  return array;
}

template <class T, class Out, class Convert>
void read_attribute(const std::vector<const PointLeaf*>& leaves, const std::vector<std::size_t>& begin,
                    const char* name, std::vector<Out>& values, const Convert& convert) {
  for (const PointLeaf* leaf : leaves) attribute_of<T>(*leaf, name);
  values.resize(begin.back());
  tbb::parallel_for(std::size_t(0), leaves.size(), [&](std::size_t l) {
    const points::AttributeHandle<T> handle(attribute_of<T>(*leaves[l], name));
    for (vdb::Index i = 0; i < handle.size(); ++i) values[begin[l] + i] = convert(handle.get(i));
  });
}

void read_positions(const std::vector<const PointLeaf*>& leaves, const std::vector<std::size_t>& begin,
                    const vdb::math::Transform& transform, double metres, Frame& frame) {
  for (const PointLeaf* leaf : leaves) attribute_of<vdb::Vec3f>(*leaf, "P");
  frame.position.resize(begin.back());
  tbb::parallel_for(std::size_t(0), leaves.size(), [&](std::size_t l) {
    const points::AttributeHandle<vdb::Vec3f> handle(attribute_of<vdb::Vec3f>(*leaves[l], "P"));
    for (auto voxel = leaves[l]->cbeginValueOn(); voxel; ++voxel) {
      const auto particles = leaves[l]->beginIndexVoxel(voxel.getCoord());
      for (auto i = particles; i; ++i) {
        const vdb::Vec3d x =
            metres * transform.indexToWorld(voxel.getCoord().asVec3d() + vdb::Vec3d(handle.get(*i)));
        frame.position[begin[l] + *i] = {float(x[0]), float(x[1]), float(x[2])};
      }
    }
  });
}

Frame frame_of(const points::PointDataGrid& grid, const vdb::MetaMap& metadata) {
  Frame frame;
  frame.header = header_of(metadata);

  std::vector<const PointLeaf*> leaves;
  std::vector<std::size_t> begin = {0};
  for (auto leaf = grid.tree().cbeginLeaf(); leaf; ++leaf) {
    leaf->validateOffsets();
    leaves.push_back(&*leaf);
    begin.push_back(begin.back() + leaf->pointCount());
  }
  if (leaves.empty()) return frame;

  read_positions(leaves, begin, grid.transform(), metres_of(metadata), frame);
  read_attribute<std::int32_t>(leaves, begin, "id", frame.id,
                               [](std::int32_t id) { return std::uint32_t(id); });
  const auto has = [&](const char* name) { return leaves.front()->hasAttribute(name); };
  if (has("v"))
    read_attribute<vdb::Vec3f>(leaves, begin, "v", frame.velocity, [](const vdb::Vec3f& v) {
      return std::array<float, 3>{v[0], v[1], v[2]};
    });
  const auto read_scalar = [&](const char* name, std::vector<float>& values) {
    if (has(name)) read_attribute<float>(leaves, begin, name, values, std::identity{});
  };
  read_scalar("kappa", frame.kappa);
  read_scalar("dkappa", frame.dkappa);
  read_scalar("pressure", frame.pressure);
  read_scalar("von_mises", frame.von_mises);
  return frame;
}

}  // namespace

fs::path write_frame(const Frame& frame, const fs::path& folder) {
  check_sizes(frame);
  check_positions(frame);
  vdb::initialize();

  const auto sorted = sort_particles(frame);
  vdb::GridCPtrVec grids = {make_point_grid(frame, sorted)};
  add_float_grids(grids, frame, sorted);

  const fs::path file = folder / (frame_file_stem(frame.header.index) + ".vdb");
  write_vdb(file, grids, metadata_of(frame.header));
  return file;
}

/// `read` of the file's grid of particles and its metadata; what fails names the file.
template <class Read>
static auto read_entry(const fs::path& path, Read read) {
  try {
    VdbFile file(path);
    const auto entry = std::ranges::find(file.entries(), "particles",
                                         [](const VdbFile::Entry& e) { return e.descriptor.gridName(); });
    if (entry == file.entries().end()) throw FileError("not a frame: it has no grid \"particles\"");
    return read(file, *entry);
  } catch (const std::exception& error) {
    const std::string message = error.what(), name = path.string();
    throw FileError(message.starts_with(name) ? message : name + ": " + message);
  }
}

Frame read_frame(const fs::path& path) {
  return read_entry(path, [](VdbFile& file, const VdbFile::Entry& entry) {
    const auto grid = vdb::gridPtrCast<points::PointDataGrid>(file.read(entry));
    if (!grid) throw FileError("not a frame: its grid \"particles\" holds no points");
    return frame_of(*grid, file.metadata());
  });
}

FrameHeader read_frame_header(const fs::path& path) {
  return read_entry(path, [](VdbFile& file, const VdbFile::Entry&) { return header_of(file.metadata()); });
}

}  // namespace anticrack
