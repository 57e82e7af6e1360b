#include <gtest/gtest.h>

#include <fstream>

#include "geometry/image_files.h"
#include "images/scan.h"
#include "images/segmentation.h"
#include "microstructure_io.h"
#include "running_command.h"
#include "sample.h"
#include "scene.h"
#include "temporary_folder.h"

namespace anticrack {
namespace {

namespace fs = std::filesystem;

class ImportExport : public testing::Test {
 protected:
  /// In the folder; its name is left out of what the command says.
  Outcome command(const std::string& arguments) const {
    Outcome outcome = run_shell("cd " + folder.path().string() + "\n" + ANTICRACK_BINARY + " " + arguments);
    const std::string prefix = folder.path().string() + "/";
    for (std::size_t at; (at = outcome.text.find(prefix)) != std::string::npos;)
      outcome.text.erase(at, prefix.size());
    return outcome;
  }

  void expect(int status, const std::string& arguments, const std::string& message) const {
    const Outcome outcome = command(arguments);
    EXPECT_EQ(outcome.status, status) << arguments << ": " << outcome.text;
    EXPECT_PRED_FORMAT2(testing::IsSubstring, message, outcome.text) << arguments;
  }

  std::size_t files() const {
    const auto entries = fs::directory_iterator(folder.path());
    return std::size_t(std::distance(begin(entries), end(entries)));
  }

  const TemporaryFolder folder;
};

/// A ball of grey 200 with a rim of 120 in 20: three labels.
Labels grey_ball(int n) {
  Labels image{{n, n, n}, {}};
  for (int k = 0; k < n; ++k)
    for (int j = 0; j < n; ++j)
      for (int i = 0; i < n; ++i) {
        const double r = (Vec3(i, j, k) - Vec3::Constant(0.5 * n)).norm() / n;
        image.values.push_back(r < 0.3 ? 200 : r < 0.4 ? 120 : 20);
      }
  return image;
}

TEST_F(ImportExport, WritesALevelSetWithTheRecordOfItsMaking) {
  folder.write("ball.tif", tiff_bytes(grey_ball(24), 8, true));
  expect(0,
         "import ball.tif -o a.vdb --voxel-size '5.345 um' --threshold 100 --crop 2:22,:,4: --downsample 2",
         "a.vdb: 10 x 12 x 10 voxels of 1.069e-05 m, solid >= 100, solid fraction 0.");
  const Microstructure structure = read_microstructure(folder.path() / "a.vdb");
  EXPECT_EQ(structure.lattice.points, (Index3{10, 12, 10}));
  EXPECT_EQ(structure.lattice.spacing, 2 * 5.345e-6);
  const auto text = [&](const char* key) { return std::get<std::string>(structure.metadata.at(key)); };
  EXPECT_EQ(text("source"), "scan");
  EXPECT_EQ(text("file"), "ball.tif");
  EXPECT_EQ(text("solid"), "solid >= 100");
  EXPECT_EQ(text("crop"), "2:22,0:24,4:24");
  EXPECT_EQ(std::get<double>(structure.metadata.at("voxel_size")), 5.345e-6);
  EXPECT_EQ(std::get<double>(structure.metadata.at("solid_fraction_achieved")), structure.solid_fraction());
  EXPECT_EQ(command("info a.vdb").status, 0);
}

TEST_F(ImportExport, SaysWhichThresholdOtsuChose) {
  folder.write("ball.tif", tiff_bytes(grey_ball(24), 8, true));
  expect(0, "import ball.tif -o a.vdb --voxel-size 1 --threshold otsu", "solid >= 21 (Otsu)");
}

// scan -> level set -> image -> level set: the voxels stay.
TEST_F(ImportExport, ExportsWhatWasImportedToTheVoxel) {
  folder.write("ball.tif", tiff_bytes(grey_ball(20), 8, true));
  ASSERT_EQ(command("import ball.tif -o a.vdb --voxel-size 1e-3 --solid 120,200").status, 0);
  const PhaseImage expected = phase_image_of(read_microstructure(folder.path() / "a.vdb"));
  for (const std::string name : {"b.tif", "b.nrrd", "b.mha", "b.mhd", "b.npy", "slices/"}) {
    expect(0, "export a.vdb -o " + name, name + ": written");
    ASSERT_EQ(command("import " + name + " -o b.vdb --force --voxel-size 1e-3").status, 0) << name;
    EXPECT_EQ(phase_image_of(read_microstructure(folder.path() / "b.vdb")).solid, expected.solid) << name;
    // The same from the scan itself.
    const std::string direct = "direct_" + name;
    expect(0, "export ball.tif -o " + direct + " --voxel-size '1 mm' --threshold 100", direct + ": written");
    PhaseSlices slices(open_image(folder.path() / direct), direct, {});
    EXPECT_EQ(read_phase_image(slices, 1e-3).solid, expected.solid) << direct;
  }
  for (const std::string name : {"b.vti", "b.stl", "b.ply"}) {
    expect(0, "export a.vdb -o " + name, name + ": written");
    expect(0, "export ball.tif -o c" + name + " --voxel-size '1 mm' --threshold 100", name + ": written");
    std::ifstream one(folder.path() / name, std::ios::binary),
        two(folder.path() / ("c" + name), std::ios::binary);
    EXPECT_TRUE(std::equal(std::istreambuf_iterator<char>(one), {}, std::istreambuf_iterator<char>(two), {}))
        << name;
  }
}

// One particle a solid voxel, from whatever format.
TEST_F(ImportExport, AScenesScanMayHaveAnyFormat) {
  folder.write("ball.tif", tiff_bytes(grey_ball(12), 8, true));
  const auto positions_of = [&](const std::string& name, const std::string& solid) {
    const fs::path scene =
        folder.write("scan.toml", "[microstructure]\nsource = \"scan\"\nfile = \"" + name +
                                      "\"\nvoxel_size = \"5 um\"\nsolid = " + solid + "\n");
    return load_sample(read_sample_scene(scene, {})).positions;
  };
  const std::vector<Vec3> expected = positions_of("ball.tif", "[120, 200]");
  ASSERT_GT(expected.size(), 100u);
  for (const std::string name : {"b.tif", "b.nrrd", "b.mha", "c.mhd", "b.npy", "slices/"}) {
    ASSERT_EQ(command("export ball.tif -o " + name + " --voxel-size '5 um' --solid 120,200").status, 0)
        << name;
    EXPECT_EQ(positions_of(name, "[255]"), expected) << name;
  }
}

TEST_F(ImportExport, RefuseBadInputBeforeAnythingIsWritten) {
  folder.write("ball.tif", tiff_bytes(grey_ball(8), 8, true));
  const std::string whole = tiff_bytes(grey_ball(8), 8, true);
  folder.write("cut.tif", whole.substr(0, whole.size() - 10));
  folder.write("a.raw", "12345678");
  folder.write("a.xyz", "12345678");
  folder.write("mixed/1.tif", tiff_bytes(numbered({4, 4, 1}, 1), 8, false));
  folder.write("mixed/2.tif", tiff_bytes(numbered({4, 5, 1}, 1), 8, false));
  const std::size_t before = files();
  const std::string to = " -o a.vdb --voxel-size '5 um' ";
  expect(2, "import ball.tif -o a.vdb", "--voxel-size is missing; expected the edge of a voxel");
  expect(2, "import ball.tif -o a.vdb --voxel-size 0", "--voxel-size 0; expected a finite length > 0.");
  expect(2, "import ball.tif -o a.vdb --voxel-size '5 kg'",
         "--voxel-size \"5 kg\": \"kg\" is not a unit of length");
  expect(2, "import ball.tif -o a.stl --voxel-size 1", "-o a.stl; expected a name that ends in .vdb.");
  expect(2, "import ball.tif" + to,
         "ball.tif: more than two labels: 20, 120, 200; expected --solid LABEL[,LABEL...] or --threshold");
  expect(2, "import ball.tif --solid 255" + to,
         "ball.tif: no voxel has the solid label 255; labels present: 20, 120, 200");
  expect(2, "import ball.tif --threshold 201" + to, "ball.tif: no voxel is solid (solid >= 201)");
  expect(2, "import ball.tif --threshold high" + to,
         "--threshold high; expected a grey value from 0 to 65535, or otsu.");
  expect(2, "import ball.tif --solid 1,x" + to, "--solid 1,x; expected labels from 0 to 65535.");
  expect(2, "import ball.tif --solid 1 --threshold 3" + to, "--solid and --threshold exclude each other.");
  expect(2, "import ball.tif --threshold 100 --crop 0:3" + to, "--crop 0:3; expected x0:x1,y0:y1,z0:z1");
  expect(2, "import ball.tif --threshold 100 --crop 0:3,0:3,5:9" + to,
         "ball.tif: crop 5:9 along z; expected a part of 0:8");
  expect(2, "import ball.tif --threshold 100 --downsample 9" + to,
         "ball.tif: downsample = 9; expected 1 to the 8 voxels along x");
  expect(4, "import cut.tif --threshold 100" + to, "cut.tif: page 7: strip 0 of 64 bytes at byte ");
  expect(4, "import none.tif --threshold 100" + to, "none.tif: no such file");
  expect(4, "import mixed --threshold 1" + to, "mixed/2.tif: 4 x 5 pixels; expected 4 x 4 as in 1.tif");
  expect(2, "import a.raw" + to, "a.raw: raw bytes need a shape [nx, ny, nz]");
  expect(2, "import a.xyz" + to,
         "a.xyz: raw bytes need a shape [nx, ny, nz]; other formats are known by their ending");
  expect(2, "import a.raw --shape 2,2" + to, "--shape 2,2; expected three numbers of voxels NX,NY,NZ.");
  expect(4, "import a.raw --shape 2,2,3" + to, "a.raw: 8 bytes; shape [2, 2, 3] needs 12");
  expect(2, "import a.raw --shape 2,2,2 --type float" + to, "--type");
  expect(2, "export ball.tif -o a.nrrd", "--voxel-size is missing");
  expect(2, "export ball.tif -o a.xyz --voxel-size 1",
         "-o a.xyz: unknown format; expected a name that ends in .tif, .tiff, .raw");
  expect(4, "export none.vdb -o a.tif", "none.vdb: no such file");
  expect(2, "export ball.tif -o mixed/ --voxel-size 1 --threshold 1",
         "mixed: the output folder exists and is not empty.");
  expect(2, "export ball.tif -o a.mhd --voxel-size 1 --threshold 1", "a.raw");  // it would replace a.raw
  EXPECT_EQ(files(), before);
}

// 2^31 voxels and more of zeros, one corner of which is solid: what is not asked for is not read.
TEST_F(ImportExport, StreamsACropOfAHugeImage) {
  const fs::path huge = folder.write("huge.raw", "");
  const std::uintmax_t voxels = 1300ull * 1300 * 1300;
  fs::resize_file(huge, voxels);
  std::fstream(huge, std::ios::binary | std::ios::in | std::ios::out).seekp(std::streamoff(voxels - 3))
      << "\x01\x01\x01";
  expect(0, "import huge.raw -o a.vdb --shape 1300,1300,1300 --voxel-size 1 --crop 1290:,1290:,1290:",
         "a.vdb: 10 x 10 x 10 voxels of 1 m, solid = 1, solid fraction 0.003000, 3 solid voxels");
  expect(2, "import huge.raw -o b.vdb --shape 1300,1300,1300 --voxel-size 1 --crop 0:4,0:4,0:4",
         "huge.raw: all voxels have the value 0; expected two phases.");
}

TEST_F(ImportExport, RefusesMoreThanTheMemoryOfTheMachine) {
  const fs::path huge = folder.write("huge.raw", "");
  fs::resize_file(huge, 1ull << 40);
  expect(2, "import huge.raw -o a.vdb --shape 8192,8192,16384 --voxel-size 1",
         "huge.raw: 8192 x 8192 x 16384 voxels need about ");
}

TEST_F(ImportExport, LeavesNoFileWhenStopped) {
  const Outcome outcome =
      run_shell("cd " + folder.path().string() + "\n" + ANTICRACK_BINARY + " import " + ANTICRACK_ASSETS +
                "/scans/berea.tif -o a.vdb --voxel-size '5.345 um' --crop 0:160,0:160,0:160 --log-json 2> "
                "log & pid=$!\n"
                "until grep -q counting log || ! kill -0 $pid; do sleep 0.02; done\n"
                "kill -TERM $pid\nwait $pid\nstatus=$?\ncat log\nexit $status");
  EXPECT_EQ(outcome.status, 75);
  EXPECT_PRED_FORMAT2(testing::IsSubstring, "anticrack: stopped by a signal; nothing was written.",
                      outcome.text);
  EXPECT_EQ(files(), 1u);  // the log
}

}  // namespace
}  // namespace anticrack
