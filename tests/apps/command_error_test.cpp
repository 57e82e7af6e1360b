#include <gtest/gtest.h>

#include "example_scene.h"
#include "running_command.h"
#include "same_run.h"
#include "temporary_folder.h"

namespace anticrack {
namespace {

namespace fs = std::filesystem;

class CommandError : public testing::Test {
 protected:
  /// The command ends with this status and says this; the folder's name is left out of it.
  void expect(int status, const std::string& arguments, const std::string& message) const {
    Outcome outcome = run_shell("cd " + folder.path().string() + "\n" + ANTICRACK_BINARY + " " + arguments);
    const std::string prefix = folder.path().string() + "/";
    for (std::size_t at; (at = outcome.text.find(prefix)) != std::string::npos;)
      outcome.text.erase(at, prefix.size());
    EXPECT_EQ(outcome.status, status) << arguments;
    EXPECT_PRED_FORMAT2(testing::IsSubstring, message, outcome.text) << arguments;
  }

  /// scan.toml: a scan of 4^3 voxels of value 48, two cells a side.
  void write_scan_scene(int solid_label) const {
    folder.write("scan.raw", std::string(64, '0'));
    folder.write("scan.toml",
                 "[microstructure]\nsource = \"scan\"\nfile = \"scan.raw\"\nvoxel_size = 0.1\nsolid = [" +
                     std::to_string(solid_label) + "]\nshape = [4, 4, 4]\n" +
                     example_scene.substr(example_scene.find("[material]")));
  }

  const TemporaryFolder folder;
  const fs::path scene = folder.write("scene.toml", example_scene);
};

TEST_F(CommandError, OfInfoNamesThePathAndWhatItExpected) {
  folder.write("empty/readme", "");
  folder.write("a.stl", "");
  folder.write("bad.json", "{\"K\": ");
  expect(2, "info none", "none: there is no such file or folder.");
  expect(2, "info empty", "empty: the folder holds no run: there is no scene.toml in it.");
  expect(2, "info a.stl", "a.stl: expected a .vdb file, a scene (.toml), a report (.json) or a run folder.");
  expect(4, "info bad.json", "bad.json: cannot read it as JSON: ");
  folder.write("run/scene.toml", example_scene);
  folder.write("run/result.json", "");
  expect(4, "info run", "run/result.json: cannot read it as JSON: ");
}

TEST_F(CommandError, OfGenerateNamesSceneOrFile) {
  expect(2, "generate none.toml -o a.vdb", "none.toml: there is no such scene file.");
  expect(4, "generate . -o a.vdb",
         "anticrack: .: cannot read the scene: it is a folder; expected a TOML file.");
  expect(4, "generate scene.toml/x -o a.vdb", "scene.toml/x: cannot read the scene: Not a directory.");
  const std::string vdb = " --set microstructure.source=vdb --set microstructure.file=scene.toml";
  expect(2, "generate scene.toml -o a.vdb" + vdb,
         "microstructure.source = \"vdb\" is a file already; expected");
  folder.write("scan.toml",
               "[microstructure]\nsource = \"scan\"\nfile = \"scan.raw\"\nvoxel_size = 1\nsolid = [1]\n");
  folder.write("scan.raw", "123");
  expect(2, "generate scan.toml -o a.vdb",
         "source = \"scan\" has no level set; expected a scene with another source");
  expect(2, "generate scene.toml -o ''", "expected the name of a file.");
  expect(
      2, "generate scene.toml -o a.vdb --set microstructure.wavelengths_per_side=6",
      "--set microstructure.wavelengths_per_side=6: microstructure.wavelengths_per_side = 6; 6 wavelengths "
      "along a side of 10 lattice points; expected at most 5");
  expect(2, "generate scene.toml -o a.vdb --set sample.size=[1e-200,2e-200,1e-200]",
         "expected a lattice spacing (shortest side / resolution) from 1e-12 to 1e12 m, but it is 1e-201 m");
  EXPECT_FALSE(fs::exists(folder.path() / "a.vdb"));
}

#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)  // they take terabytes of addresses
TEST_F(CommandError, OfMemoryThatTheSystemRefusesSaysWhatToDo) {
  const Outcome outcome = run_shell("ulimit -v 1500000\n" ANTICRACK_BINARY " generate " + scene.string() +
                                    " -o " + (folder.path() / "a.vdb").string() +
                                    " --set sample.size=[1,1,1] --set sample.resolution=700");
  EXPECT_EQ(outcome.status, 2);
  EXPECT_EQ(
      outcome.text,
      "anticrack: out of memory. Use a smaller sample.resolution; anticrack run --dry-run tells what a scene "
      "needs.\n");
}
#endif

TEST_F(CommandError, OfRunComesBeforeAnythingIsWritten) {
  const std::string run = "run scene.toml -o out ";
  folder.write("bad.vdb", "no volume");
  expect(4, run + "--set microstructure.source=vdb --set microstructure.file=bad.vdb",
         "bad.vdb: damaged or no OpenVDB");
  expect(2,
         run + "--set sample.size=[0.2,0.2,0.2] --set sample.resolution=2 --set microstructure.source=full",
         "sample.resolution = 2; expected at least 8, four cells");
  expect(2, "run scene.toml", "-o");
  expect(2, run + "--resume", "out: no run to resume: there is no scene.toml in it.");
  expect(2, run + "--force --resume", "--force");
  expect(2, run + "--max-steps 0", "--max-steps: Value 0; expected a number above 0");
  expect(2, run + "--max-walltime inf", "--max-walltime: Value inf; expected a number above 0");
  expect(2, "run scene.toml -o ''", "-o: the output folder has no name.");
  write_scan_scene(1);
  expect(2, "run scan.toml -o out", "scan.raw: no voxel has the solid label 1; labels present: 48");
  expect(2, "run scan.toml -o out --set microstructure.solid=[48] --set loading.speed=5000",
         "scan.toml: [loading] expected walls slower than the elastic wave speed");
  EXPECT_FALSE(fs::exists(folder.path() / "out/history.csv"));
}

TEST_F(CommandError, UnderForceLeavesTheEarlierRun) {
  const fs::path history = folder.write("out/history.csv", "of another run");
  write_scan_scene(48);
  expect(2, "run scan.toml -o out --force", "cells of the sample box along an axis = 2; expected at least 4");
  EXPECT_TRUE(fs::exists(history));
  EXPECT_EQ(run_shell(ANTICRACK_BINARY " figure b14 --realizations 1 --resolution 32 --force -o " +
                      (folder.path() / "out").string())
                .status,
            0);
  EXPECT_TRUE(fs::exists(history));
}

// Platens of 200 m/s come within three cells of each other at about 70 % strain.
TEST_F(CommandError, OfANumericalAbortNamesTheLastCheckpoint) {
  const std::string run =
      "run scene.toml -o out --quiet --set loading.until_strain=0.95 --set loading.speed=200 ";
  const std::string what = "s: the walls along y have come within 2.9";
  expect(3, run, what);
  expect(3, run + "--force", "; no checkpoint yet.\n");
  expect(3, run + "--force --set output.checkpoint_minutes=1e-6", "; last checkpoint: step ");
  EXPECT_FALSE(fs::exists(folder.path() / "out/result.json"));
}

TEST_F(CommandError, OfMaterialNamesFileLineAndColumn) {
  const auto expect_path = [&](const std::string& path, const std::string& message) {
    folder.write("path.csv", path);
    expect(2, "material scene.toml --path path.csv -o out.csv", message);
  };
  expect(4, "material scene.toml --path none.csv -o out.csv", "none.csv: cannot be opened for reading.");
  expect_path("e1,e2\n0,0\n", "path.csv:1: columns e1,e2; expected e1,e2,e3 or F11,F12,...,F33.");
  expect_path("e1,e2,e3\n", "path.csv: no rows; expected at least one.");
  expect_path("e1,e2,e3\n0,0,0\n0,x,0\n", "path.csv:3: e2 = \"x\"; expected a number.");
  expect_path("e1,e2,e3\n0,0\n", "path.csv:2: e3 = \"\"; expected a number.");
  expect_path("e1,e2,e3\n0,0,101\n", "path.csv:2: e3 = 101; expected a Hencky strain from -100 to 100.");
  expect_path("e1,e2,e3\n0,0,nan\n", "path.csv:2: e3 = nan; expected a Hencky strain from -100 to 100.");
  folder.write("path.csv", "e1,e2,e3\n0,0,0\n");
  expect(2, "material scene.toml --path path.csv -o out.csv --kappa0 -1",
         "--kappa0 -1; expected a number >= 0.");
  EXPECT_FALSE(fs::exists(folder.path() / "out.csv"));
}

TEST_F(CommandError, OfBenchSaysWhatExcludesWhat) {
  expect(2, "bench --set sample.resolution=10", "--set overrides the keys of a scene file; expected SCENE.");
  expect(2, "bench --curves new --options", "--curves");
  expect(2, "bench --json --curves new", "expected neither SCENE, --set nor --json.");
}

}  // namespace
}  // namespace anticrack
