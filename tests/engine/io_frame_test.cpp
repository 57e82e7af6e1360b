#include "io/frame.h"

#include <oneapi/tbb/global_control.h>
#include <openvdb/openvdb.h>
#include <openvdb/points/PointAttribute.h>
#include <openvdb/points/PointDataGrid.h>
#include <openvdb/tools/LevelSetSphere.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "expect_error.h"
#include "io_frame_samples.h"
#include "io_test_folder.h"

namespace anticrack {
namespace {

class FrameFile : public IoTest {};

template <class T>
void permute(std::vector<T>& values, const std::vector<std::size_t>& order) {
  if (values.empty()) return;
  std::vector<T> permuted;
  for (const std::size_t i : order) permuted.push_back(values[i]);
  values = permuted;
}

void permute(Frame& frame, const std::vector<std::size_t>& order) {
  permute(frame.id, order);
  permute(frame.position, order);
  permute(frame.velocity, order);
  permute(frame.kappa, order);
  permute(frame.dkappa, order);
  permute(frame.pressure, order);
  permute(frame.von_mises, order);
}

void sort_by_id(Frame& frame) {
  std::vector<std::size_t> order(frame.id.size());
  std::iota(order.begin(), order.end(), 0);
  std::ranges::sort(order, {}, [&](std::size_t i) { return frame.id[i]; });
  permute(frame, order);
}

void expect_same(const FrameHeader& a, const FrameHeader& b) {
  EXPECT_EQ(a.index, b.index);
  EXPECT_EQ(a.step, b.step);
  EXPECT_EQ(a.time, b.time);
  EXPECT_EQ(a.strain, b.strain);
  EXPECT_EQ(a.seconds_since_last_frame, b.seconds_since_last_frame);
  EXPECT_EQ(a.box_lower, b.box_lower);
  EXPECT_EQ(a.box_upper, b.box_upper);
  EXPECT_EQ(a.particle_spacing, b.particle_spacing);
  EXPECT_EQ(a.cell_size, b.cell_size);
  EXPECT_EQ(a.run, b.run);
}

void expect_same_but_position(const Frame& a, const Frame& b) {
  expect_same(a.header, b.header);
  EXPECT_EQ(a.id, b.id);
  EXPECT_EQ(a.velocity, b.velocity);
  EXPECT_EQ(a.kappa, b.kappa);
  EXPECT_EQ(a.dkappa, b.dkappa);
  EXPECT_EQ(a.pressure, b.pressure);
  EXPECT_EQ(a.von_mises, b.von_mises);
}

TEST_F(FrameFile, ReadsBackWhatWasWritten) {
  const Frame written = sample_frame(13);
  const auto file = write_frame(written, folder);
  EXPECT_EQ(file, folder / "frame_0012.vdb");
  EXPECT_EQ(files_in_folder(), 1u);

  Frame read = read_frame(file);
  expect_same(read_frame_header(file), written.header);
  sort_by_id(read);
  expect_same_but_position(read, written);
  // Within its voxel a position is rounded to 2^-25 of the voxel; back in space, to a float again.
  for (std::size_t i = 0; i < read.id.size(); ++i)
    for (int axis = 0; axis < 3; ++axis) {
      const float x = written.position[i][axis];
      EXPECT_NEAR(read.position[i][axis], x, 6e-8 * std::abs(x) + 3e-8 * written.header.cell_size);
    }
}

// OpenVDB itself refuses voxels below 1.4e-5.
TEST_F(FrameFile, OfASampleOfAnySizeReadsBackInMetres) {
  for (const double spacing : {1e-4, 5.345e-6, 1e-9}) {
    Frame written = sample_frame(9, spacing);
    for (std::size_t i = 0; i < written.position.size(); ++i)
      for (int axis = 0; axis < 3; ++axis)
        written.position[i][axis] = float(spacing * (1.37 * double(i % 11) + 0.61 * axis));
    Frame read = read_frame(write_frame(written, folder));
    sort_by_id(read);
    expect_same_but_position(read, written);
    for (std::size_t i = 0; i < read.id.size(); ++i)
      for (int axis = 0; axis < 3; ++axis) {
        const float x = written.position[i][axis];
        EXPECT_NEAR(read.position[i][axis], x, 6e-8 * std::abs(x) + 3e-8 * written.header.cell_size);
      }
  }
}

TEST_F(FrameFile, ElasticRunHasNoKappa) {
  Frame written = sample_frame(5);
  written.kappa.clear();
  written.dkappa.clear();
  Frame read = read_frame(write_frame(written, folder));
  sort_by_id(read);
  expect_same_but_position(read, written);
}

TEST_F(FrameFile, LargeIdsSurvive) {
  Frame written = sample_frame(2);
  for (std::uint32_t& id : written.id) id += 4294967280u;
  Frame read = read_frame(write_frame(written, folder));
  sort_by_id(read);
  EXPECT_EQ(read.id, written.id);
}

TEST_F(FrameFile, EmptyFrameIsAFrame) {
  Frame written = sample_frame(0);
  const Frame read = read_frame(write_frame(written, folder));
  EXPECT_EQ(read.header.step, written.header.step);
  EXPECT_TRUE(read.id.empty());
}

TEST_F(FrameFile, BytesDependNeitherOnOrderNorOnThreads) {
  Frame frame = sample_frame(20);
  std::filesystem::create_directories(folder / "again");
  const std::string content = file_content(write_frame(frame, folder));
  EXPECT_EQ(content, file_content(write_frame(frame, folder / "again")));

  std::vector<std::size_t> order(frame.id.size());
  std::iota(order.begin(), order.end(), 0);
  std::ranges::shuffle(order, std::mt19937(1));
  permute(frame, order);
  EXPECT_EQ(content, file_content(write_frame(frame, folder / "again")));

  const tbb::global_control one_thread(tbb::global_control::max_allowed_parallelism, 1);
  EXPECT_EQ(content, file_content(write_frame(frame, folder / "again")));
}

TEST_F(FrameFile, IsAnOrdinaryVdbFileWithNamedAttributesAndVolumes) {
  const Frame frame = sample_frame(13);
  const auto path = write_frame(frame, folder);

  openvdb::io::File file(path.string());
  file.open();
  EXPECT_EQ(file.getMetadata()->metaValue<std::string>("run"), "phi = 0.34");
  const auto particles = openvdb::gridPtrCast<openvdb::points::PointDataGrid>(file.readGrid("particles"));
  ASSERT_TRUE(particles);
  const auto& attributes = particles->tree().cbeginLeaf()->attributeSet();
  for (const char* name : {"P", "id", "v", "kappa", "dkappa", "pressure", "von_mises"})
    EXPECT_NE(attributes.find(name), openvdb::points::AttributeSet::INVALID_POS) << name;

  const auto solid = openvdb::gridPtrCast<openvdb::FloatGrid>(file.readGrid("solid"));
  const auto kappa = openvdb::gridPtrCast<openvdb::FloatGrid>(file.readGrid("kappa"));
  ASSERT_TRUE(solid && kappa);
  EXPECT_EQ(solid->getGridClass(), openvdb::GRID_FOG_VOLUME);
  EXPECT_EQ(kappa->activeVoxelCount(), solid->activeVoxelCount());
  // The raster conserves the volume: one voxel a particle. 2197 sums of floats, rounded at 6e-8 each.
  double volume = 0;
  for (auto voxel = solid->cbeginValueOn(); voxel; ++voxel) volume += *voxel;
  EXPECT_NEAR(volume, double(frame.id.size()), 1e-5 * double(frame.id.size()));
  // The centre of the cube is solid there, not elsewhere.
  const auto at = [&](double x) {
    return solid->tree().getValue(openvdb::Coord::round(solid->worldToIndex({x, x, x})));
  };
  EXPECT_GT(at(0.015), 0.3);
  EXPECT_EQ(at(0.2), 0);
}

TEST_F(FrameFile, PositionsThatCannotBeStoredAreRefused) {
  for (const float bad : {NAN, INFINITY, 1e30f, -1e30f}) {
    Frame frame = sample_frame(3);
    frame.position[5][1] = bad;
    try {
      write_frame(frame, folder);
      ADD_FAILURE() << bad;
    } catch (const InputError& error) {
      EXPECT_PRED_FORMAT2(testing::IsSubstring, "particle 5", error.what());
    }
  }
  EXPECT_EQ(files_in_folder(), 0u);
}

TEST_F(FrameFile, FramesThatDoNotFitTogetherAreRefused) {
  Frame frame = sample_frame(3);
  frame.pressure.pop_back();
  EXPECT_ERROR(write_frame(frame, folder), InputError, "frame 12: 26 entries of pressure for 27 particles");
  frame = sample_frame(3);
  frame.header.cell_size = 0;
  EXPECT_ERROR(write_frame(frame, folder), InputError, "frame 12: cell_size = 0.000000");
  frame = sample_frame(3);
  frame.header.index = -1;
  EXPECT_ERROR(write_frame(frame, folder), InputError, "frame index -1; expected >= 0");
}

TEST_F(FrameFile, FullDiskIsAnErrorAndKeepsTheOldFrame) {
  const auto file = write_frame(sample_frame(3), folder);
  const std::string good = file_content(file);
  std::string message;
  {
    const FullDisk full(good.size() + 1000);
    message = file_error_of([&] { write_frame(sample_frame(20), folder); });
  }
  EXPECT_PRED_FORMAT2(testing::IsSubstring, "frame_0012.vdb", message);
  EXPECT_PRED_FORMAT2(testing::IsSubstring, "File too large", message);
  EXPECT_EQ(file_content(file), good);
  EXPECT_EQ(files_in_folder(), 1u);
}

TEST_F(FrameFile, UnwritableFolderIsAnErrorWithTheFile) {
  std::string message;
  {
    const UnwritableFolder unwritable(folder);
    message = file_error_of([&] { write_frame(sample_frame(3), folder); });
  }
  EXPECT_PRED_FORMAT2(testing::IsSubstring, "frame_0012.vdb", message);
  EXPECT_PRED_FORMAT2(testing::IsSubstring, "Permission denied", message);
}

// ---- files that are not frames

std::string error_of_reading(const std::filesystem::path& file) {
  return file_error_of([&] { read_frame(file); });
}

TEST_F(FrameFile, MissingAndForeignFilesAreErrorsThatSayWhy) {
  EXPECT_PRED_FORMAT2(testing::IsSubstring, "No such file", error_of_reading(folder / "frame_0000.vdb"));

  put_file(folder / "text.vdb",
           "not a vdb file at all, but long enough to have a head of sixty bytes or more");
  EXPECT_PRED_FORMAT2(testing::IsSubstring, "text.vdb: ", error_of_reading(folder / "text.vdb"));
  put_file(folder / "empty.vdb", "");
  EXPECT_PRED_FORMAT2(testing::IsSubstring, "empty.vdb: ", error_of_reading(folder / "empty.vdb"));

  openvdb::initialize();
  const auto sphere = openvdb::tools::createLevelSetSphere<openvdb::FloatGrid>(1, {0, 0, 0}, 0.2f);
  openvdb::io::File((folder / "sphere.vdb").string()).write(openvdb::GridPtrVec{sphere});
  EXPECT_PRED_FORMAT2(testing::IsSubstring, "no grid \"particles\"", error_of_reading(folder / "sphere.vdb"));

  sphere->setName("particles");
  openvdb::io::File((folder / "named.vdb").string()).write(openvdb::GridPtrVec{sphere});
  EXPECT_PRED_FORMAT2(testing::IsSubstring, "holds no points", error_of_reading(folder / "named.vdb"));
}

TEST_F(FrameFile, PointsWithoutHeaderOrAttributesAreErrorsThatNameThem) {
  const auto path = write_frame(sample_frame(3), folder);
  openvdb::io::File file(path.string());
  file.open(false);
  const auto particles = openvdb::gridPtrCast<openvdb::points::PointDataGrid>(file.readGrid("particles"));
  const openvdb::MetaMap whole = *file.getMetadata();
  openvdb::MetaMap metadata = whole;
  file.close();
  const auto copy = [&] {
    const auto other = folder / "other.vdb";
    openvdb::io::File(other.string()).write(openvdb::GridPtrVec{particles}, metadata);
    return error_of_reading(other);
  };
  EXPECT_EQ(copy(), "");  // without a seal, but whole

  metadata.removeMeta("box_upper");
  EXPECT_PRED_FORMAT2(testing::IsSubstring, "metadata \"box_upper\" is missing", copy());
  metadata = whole;
  metadata.insertMeta("frame_format", openvdb::Int32Metadata(7));
  EXPECT_PRED_FORMAT2(testing::IsSubstring, "other.vdb: frame format 7; this program reads format 1", copy());
  metadata = whole;
  metadata.insertMeta("length_unit", openvdb::StringMetadata("furlong"));
  EXPECT_PRED_FORMAT2(testing::IsSubstring,
                      "other.vdb: metadata \"length_unit\" is \"furlong\"; expected m, mm, um, nm or pm",
                      copy());
  metadata = whole;
  for (auto leaf = particles->tree().beginLeaf(); leaf; ++leaf) {
    const auto& descriptor = leaf->attributeSet().descriptor();
    const auto id = descriptor.find("id");
    auto without_id = descriptor.duplicateDrop({id});
    leaf->dropAttributes({id}, descriptor, without_id);
  }
  EXPECT_PRED_FORMAT2(testing::IsSubstring, "other.vdb: attribute \"id\" of its particles is missing",
                      copy());
  openvdb::points::renameAttribute(particles->tree(), "kappa", "id");
  EXPECT_PRED_FORMAT2(testing::IsSubstring,
                      "other.vdb: attribute \"id\" of its particles is of type float; expected int32",
                      copy());
}

TEST_F(FrameFile, DamageIsAnErrorOrHarmless) {
  const auto path = write_frame(sample_frame(7), folder);
  const std::string good = file_content(path);
  Frame original = read_frame(path);
  const auto damaged = folder / "damaged.vdb";

  for (std::size_t part = 0; part < 64; ++part) {
    put_file(damaged, good.substr(0, good.size() * part / 64));
    EXPECT_NE(error_of_reading(damaged), "") << part;
  }
  std::mt19937 random(3);
  for (int trial = 0; trial < 400; ++trial) {
    std::string bad = good;
    // Half of the flips in the first 200 bytes, where the structure is.
    const std::size_t place = trial % 2 ? random() % bad.size() : random() % 200;
    bad[place] = char(bad[place] ^ (1 << random() % 8));
    put_file(damaged, bad);
    try {
      const Frame read = read_frame(damaged);
      expect_same_but_position(read, original);
      EXPECT_EQ(read.position, original.position);
    } catch (const FileError& error) {
      EXPECT_PRED_FORMAT2(testing::IsSubstring, "damaged.vdb", error.what());
    }
  }
}

TEST_F(FrameFile, ListIsInOrderOfIndex) {
  for (const char* name : {"frame_10000.vdb", "frame_9999.vdb", "frame_0002.vdb", "frame_0002.vtp",
                           "frame_x.vdb", "frame_12.vdb", ".frame_0003.vdb.1-0.tmp", "structure.vdb"})
    put_file(folder / name, "");
  const std::vector<std::filesystem::path> expected = {folder / "frame_0002.vdb", folder / "frame_9999.vdb",
                                                       folder / "frame_10000.vdb"};
  EXPECT_EQ(list_frames(folder), expected);
}

TEST_F(FrameFile, FolderWithoutFramesIsAnError) {
  EXPECT_PRED_FORMAT2(testing::IsSubstring, "no frames", file_error_of([&] { list_frames(folder); }));
  EXPECT_PRED_FORMAT2(testing::IsSubstring, "cannot be listed",
                      file_error_of([&] { list_frames(folder / "none"); }));
}

}  // namespace
}  // namespace anticrack
