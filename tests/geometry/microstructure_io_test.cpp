#include "microstructure_io.h"

#include <gtest/gtest.h>
#include <openvdb/tools/LevelSetSphere.h>
#include <sys/resource.h>
#include <unistd.h>

#include <csignal>
#include <fstream>
#include <iterator>

#include "errors.h"
#include "expect_error.h"
#include "files/vdb_seal.h"
#include "level_sets/level_set.h"

namespace anticrack {
namespace {

namespace fs = std::filesystem;

class MicrostructureFile : public testing::Test {
 protected:
  MicrostructureFile()
      : folder_(fs::path(testing::TempDir()) / ("anticrack_vdb_" + std::to_string(::getpid()))) {
    openvdb::initialize();
    fs::create_directories(folder_);
  }
  ~MicrostructureFile() override { fs::remove_all(folder_); }

  fs::path path(const std::string& name) const { return folder_ / name; }

  fs::path write(const std::string& name, const openvdb::GridCPtrVec& grids) const {
    openvdb::io::File(path(name).string()).write(grids);
    return path(name);
  }

  static std::string content_of(const fs::path& file) {
    std::ifstream stream(file, std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), {}};
  }

  static std::string error_of(const fs::path& file) {
    try {
      read_microstructure(file);
    } catch (const FileError& error) {
      return error.what();
    }
    return {};
  }

 private:
  fs::path folder_;
};

template <class Grid>
typename Grid::Ptr sphere(const std::string& name) {
  auto grid = openvdb::tools::createLevelSetSphere<Grid>(0.3f, openvdb::Vec3f(2.003f, 1.007f, 0.511f), 0.02f);
  grid->setName(name);
  return grid;
}

Microstructure small_structure() {
  return generate_microstructure({{20, 24, 18}, 0.05}, {200, 2, 50, 18446744073709551615ull}, 0.4,
                                 ThresholdRule::exact);
}

TEST_F(MicrostructureFile, RoundTripKeepsEverything) {
  const Microstructure written = small_structure();
  write_microstructure(written, path("s.vdb"));
  const Microstructure read = read_microstructure(path("s.vdb"));
  EXPECT_EQ(read.lattice.points, written.lattice.points);
  EXPECT_EQ(read.lattice.spacing, written.lattice.spacing);
  EXPECT_EQ(read.origin, written.origin);
  EXPECT_EQ(read.solid_points, written.solid_points);
  for (const auto& [key, value] : written.metadata) {
    ASSERT_TRUE(read.metadata.contains(key)) << key;
    EXPECT_EQ(read.metadata.at(key), value) << key;
  }
  EXPECT_EQ(std::get<std::string>(read.metadata.at("seed")), "18446744073709551615");
  EXPECT_TRUE(read.metadata.contains("anticrack_version"));

  auto a = written.surface->grid->cbeginValueAll();
  auto b = read.surface->grid->cbeginValueAll();
  for (; a && b; ++a, ++b) ASSERT_EQ(*a, *b);
  EXPECT_FALSE(a || b);
  EXPECT_EQ(seed_particles(read, read.lattice), seed_particles(written, written.lattice));

  std::size_t files = std::distance(fs::directory_iterator(path("")), fs::directory_iterator());
  EXPECT_EQ(files, 1u);  // no temporary is left
}

// OpenVDB itself refuses voxels below 1.4e-5; the lattice must come back to the last bit nevertheless.
TEST_F(MicrostructureFile, OfAnySizeIsStoredInAUnitThatFitsAndReadInMetres) {
  const auto points_of = [&](double spacing) {
    const Microstructure written =
        generate_microstructure({{20, 24, 18}, spacing}, {200, 2, 50, 7}, 0.4, ThresholdRule::exact);
    write_microstructure(written, path("s.vdb"));
    const Microstructure read = read_microstructure(path("s.vdb"));
    EXPECT_EQ(read.lattice.spacing, spacing);
    EXPECT_EQ(read.surface->unit.name, length_unit_for(spacing).name);
    const double voxel = read.surface->grid->voxelSize()[0] * read.surface->unit.metres;
    EXPECT_NEAR(voxel, spacing, 4e-16 * spacing);  // two roundings
    return seed_particles(read, read.lattice);
  };
  const auto in_metres = points_of(1);
  for (const double spacing : {0x1p-13, 0x1p-20, 0x1p-30, 0x1p-36}) {
    const auto points = points_of(spacing);
    ASSERT_EQ(points.size(), in_metres.size()) << spacing;
    for (std::size_t n = 0; n < points.size(); ++n) ASSERT_EQ(points[n], spacing * in_metres[n]);
  }
}

TEST_F(MicrostructureFile, OfAnUnknownUnitIsRefused) {
  const auto grid = sphere<openvdb::FloatGrid>("surface");
  grid->insertMeta("length_unit", openvdb::StringMetadata("furlong"));
  EXPECT_EQ(error_of(write("furlong.vdb", {grid})),
            path("furlong.vdb").string() +
                ": grid 'surface': length_unit = \"furlong\"; expected m, mm, um, nm or pm");
}

TEST_F(MicrostructureFile, DensityIsTheSolidShareOfEachVoxel) {
  for (const double spacing : {0.05, 1e-6, 1e-9}) {
    const Microstructure written =
        generate_microstructure({{20, 24, 18}, spacing}, {200, 2, 50, 5}, 0.4, ThresholdRule::exact);
    write_microstructure(written, path("s.vdb"), DensityGrid::add);
    openvdb::io::File file(path("s.vdb").string());
    file.open();
    const auto density = openvdb::gridPtrCast<openvdb::FloatGrid>(file.readGrid("density"));
    EXPECT_EQ(density->getGridClass(), openvdb::GRID_FOG_VOLUME);
    EXPECT_FALSE(density->saveFloatAsHalf());
    EXPECT_EQ(density->background(), 0.0f);
    EXPECT_EQ(density->transform(), written.surface->grid->transform());
    const double voxel = written.surface->grid->voxelSize()[0];
    double sum = 0;
    for (int k = 0; k < 18; ++k)
      for (int j = 0; j < 24; ++j)
        for (int i = 0; i < 20; ++i) {
          const float share = density->tree().getValue({i, j, k});
          const float distance = written.surface->grid->tree().getValue({i, j, k});
          ASSERT_FLOAT_EQ(share, float(std::clamp(0.5 - distance / voxel, 0.0, 1.0)));
          ASSERT_EQ(density->tree().isValueOn({i, j, k}), share > 0);
          sum += share;
        }
    // The share averages what the signs count: one voxel in the surface is off by at most a half.
    EXPECT_NEAR(sum, double(written.solid_points), 0.02 * sum);
    const Microstructure read = read_microstructure(path("s.vdb"));
    EXPECT_EQ(read.lattice.spacing, spacing);
    EXPECT_EQ(read.solid_points, written.solid_points);
  }
}

TEST_F(MicrostructureFile, MetadataIsInTheHeaderOfTheFileToo) {
  write_microstructure(small_structure(), path("s.vdb"));
  openvdb::io::File file(path("s.vdb").string());
  file.open();
  const auto metadata = file.getMetadata();
  EXPECT_EQ(metadata->metaValue<double>("solid_fraction"), 0.4);
  EXPECT_EQ(metadata->metaValue<openvdb::Vec3i>("lattice_points"), openvdb::Vec3i(20, 24, 18));
}

TEST_F(MicrostructureFile, ReadsLevelSetsFromElsewhere) {
  for (bool doubles : {false, true}) {
    openvdb::GridBase::Ptr grid;
    if (doubles)
      grid = sphere<openvdb::DoubleGrid>("rock");
    else
      grid = sphere<openvdb::FloatGrid>("rock");
    grid->setSaveFloatAsHalf(!doubles);
    const Microstructure structure = read_microstructure(write("foreign.vdb", {grid}));
    EXPECT_FLOAT_EQ(structure.lattice.spacing, 0.02f);
    for (int axis = 0; axis < 3; ++axis) EXPECT_NEAR(structure.lattice.points[axis], 30, 1);
    EXPECT_NEAR(structure.origin[0], 1.7, 0.021);
    EXPECT_NEAR(structure.origin[1], 0.7, 0.021);
    EXPECT_NEAR(structure.origin[2], 0.2, 0.021);
    // A ball of 15 voxels radius by counting voxels: 0.3 %, and the half precision of the sign at the
    // surface.
    EXPECT_NEAR(double(structure.solid_points), 4.0 / 3 * M_PI * 15 * 15 * 15, 0.01 * structure.solid_points);
    EXPECT_EQ(seed_particles(structure, structure.lattice).size(), structure.solid_points);
    EXPECT_EQ(std::get<std::string>(structure.metadata.at("source")), "vdb");
  }
}

TEST_F(MicrostructureFile, PrefersTheGridNamedSurface) {
  auto other = openvdb::tools::createLevelSetSphere<openvdb::FloatGrid>(0.1f, openvdb::Vec3f(0.0f), 0.02f);
  other->setName("a");
  EXPECT_GT(
      read_microstructure(write("two.vdb", {other, sphere<openvdb::FloatGrid>("surface")})).solid_points,
      10000u);
  EXPECT_LT(read_microstructure(write("two.vdb", {other, sphere<openvdb::FloatGrid>("z")})).solid_points,
            1000u);
}

TEST_F(MicrostructureFile, WithoutALevelSetNamesTheGridsFound) {
  auto fog = openvdb::FloatGrid::create();
  fog->setName("density");
  fog->setGridClass(openvdb::GRID_FOG_VOLUME);
  auto vectors = openvdb::Vec3SGrid::create();
  vectors->setName("wind");
  const std::string message = error_of(write("fog.vdb", {fog, vectors}));
  EXPECT_NE(message.find("fog.vdb"), std::string::npos) << message;
  EXPECT_NE(message.find("'density' (float, fog volume)"), std::string::npos) << message;
  EXPECT_NE(message.find("'wind'"), std::string::npos) << message;
}

TEST_F(MicrostructureFile, WithoutSolidIsRefused) {
  auto empty = openvdb::FloatGrid::create(1.0f);
  empty->setGridClass(openvdb::GRID_LEVEL_SET);
  EXPECT_NE(error_of(write("empty.vdb", {empty})).find("no solid"), std::string::npos);
  auto inverted = openvdb::FloatGrid::create(-1.0f);
  inverted->setGridClass(openvdb::GRID_LEVEL_SET);
  EXPECT_NE(error_of(write("inverted.vdb", {inverted})).find("background"), std::string::npos);
}

TEST_F(MicrostructureFile, LatticesThatNoSampleHasAreRefused) {
  auto wide = openvdb::FloatGrid::create(1.0f);
  wide->setGridClass(openvdb::GRID_LEVEL_SET);
  for (const int i : {0, 1 << 21}) wide->tree().setValue(openvdb::Coord(i, 0, 0), -1.0f);
  EXPECT_ERROR(read_microstructure(write("wide.vdb", {wide})), FileError,
               "wide.vdb: grid '' spans 2.09715e+06 voxels along an axis; expected at most 1048576");
  auto grid = sphere<openvdb::FloatGrid>("surface");
  grid->insertMeta("lattice_points", openvdb::Vec3IMetadata({100000, 100000, 2}));
  grid->insertMeta("lattice_spacing", openvdb::DoubleMetadata(0.02));
  grid->insertMeta("origin", openvdb::Vec3DMetadata({0, 0, 0}));
  grid->insertMeta("solid_points", openvdb::Int64Metadata(1));
  EXPECT_ERROR(read_microstructure(write("lattice.vdb", {grid})), FileError,
               "lattice.vdb: lattice of 100000 x 100000 x 2 points; expected at most 1048576 along an axis");
  grid->insertMeta("lattice_points", openvdb::Vec3IMetadata({3, 3, 3}));
  EXPECT_ERROR(read_microstructure(write("corner.vdb", {grid})), FileError,
               "corner.vdb: no point of the lattice 3 x 3 x 3, spacing 0.02 m, lies in the solid");
}

TEST_F(MicrostructureFile, ReadingOtherFilesIsRefusedByName) {
  EXPECT_NE(error_of(path("missing.vdb")).find("no such file"), std::string::npos);
  std::ofstream(path("text.vdb")) << "no volume at all";
  EXPECT_NE(error_of(path("text.vdb")).find("text.vdb"), std::string::npos);
  std::ofstream(path("nothing.vdb")).flush();
  EXPECT_NE(error_of(path("nothing.vdb")).find("nothing.vdb"), std::string::npos);
  EXPECT_NE(error_of(path("")).find("anticrack_vdb"), std::string::npos);  // a folder
}

TEST_F(MicrostructureFile, OfATypeThatOpenVdbDoesNotKnowIsRefusedInItsWords) {
  const fs::path file = write("s.vdb", {sphere<openvdb::FloatGrid>("surface")});
  std::string bytes = content_of(file);
  for (std::size_t at; (at = bytes.find("Tree_float")) != std::string::npos;)
    bytes.replace(at, 10, "Tree_other");
  std::ofstream(file, std::ios::binary) << bytes;
  EXPECT_PRED_FORMAT2(
      testing::IsSubstring,
      file.string() +
          ": cannot be read: LookupError: Cannot read grid. Grid type Tree_other_5_4_3 is not registered",
      error_of(file));
}

TEST_F(MicrostructureFile, SealIsRefusedToWhatHasNoUuid) {
  std::ofstream(path("s.vdb")) << std::string(100, 'x');
  EXPECT_ERROR(seal_vdb(path("s.vdb")), FileError,
               path("s.vdb").string() + ": no UUID where OpenVDB files have it");
}

TEST_F(MicrostructureFile, RewrittenByAnotherProgramKeepsItsLatticeAndIsCountedAnew) {
  const Microstructure written = small_structure();
  auto grid = written.surface->grid->deepCopy();
  grid->tree().setValue(openvdb::Coord(3, 3, 3),
                        written.surface->grid->tree().getValue({3, 3, 3}) < 0 ? 0.01f : -0.01f);
  Microstructure edited = written;
  edited.surface = std::make_shared<LevelSet>(LevelSet{grid});
  write_microstructure(edited, path("s.vdb"));
  openvdb::io::File file(path("s.vdb").string());
  file.open();
  const Microstructure read = read_microstructure(write("t.vdb", {file.readGrid("surface")}));
  EXPECT_EQ(read.lattice.points, written.lattice.points);
  EXPECT_EQ(
      std::max(read.solid_points, written.solid_points) - std::min(read.solid_points, written.solid_points),
      1u);
}

TEST_F(MicrostructureFile, FailedWriteLeavesTheOldFile) {
  write_microstructure(full_block({{6, 6, 6}, 1.0}), path("s.vdb"));
  const auto size = fs::file_size(path("s.vdb"));
  rlimit before;
  ::getrlimit(RLIMIT_FSIZE, &before);
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  const rlimit small{4096, before.rlim_max};  // the system refuses to write more, as it does on a full disk
  ::setrlimit(RLIMIT_FSIZE, &small);
  EXPECT_ERROR(write_microstructure(small_structure(), path("s.vdb")), FileError,
               "s.vdb: cannot be written: File too large");
  ::setrlimit(RLIMIT_FSIZE, &before);
  std::signal(SIGXFSZ, handler);
  EXPECT_EQ(fs::file_size(path("s.vdb")), size);
  EXPECT_EQ(std::distance(fs::directory_iterator(path("")), fs::directory_iterator()), 1);
  EXPECT_ERROR(write_microstructure(small_structure(), path("no/such/folder/s.vdb")), FileError,
               "no/such/folder/s.vdb: cannot be written: No such file or directory");
}

}  // namespace
}  // namespace anticrack
