#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <set>

#include "example_scene.h"
#include "microstructure_io.h"
#include "running_command.h"
#include "temporary_folder.h"

namespace anticrack {
namespace {

namespace fs = std::filesystem;

std::string read_text(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

class GenerateMany : public testing::Test {
 protected:
  std::string generate(const std::string& more) const {
    return "generate " + scene_ + " -o " + samples().string() + " --quiet " + more;
  }
  fs::path samples() const { return folder_.path() / "samples"; }

  TemporaryFolder folder_;
  std::string scene_ = folder_.write("scene.toml", example_scene).string();
};

TEST_F(GenerateMany, FilesAreThoseThatEachSeedGivesAlone) {
  ASSERT_EQ(run(generate("--count 3 --threads 2 --set microstructure.morphology=open_cell")).status, 0);
  for (const std::string seed : {"1", "2", "3"}) {
    const fs::path alone = folder_.path() / (seed + ".vdb");
    ASSERT_EQ(run("generate " + scene_ + " -o " + alone.string() +
                  " --set microstructure.morphology=open_cell --set microstructure.seed=" + seed)
                  .status,
              0);
    EXPECT_EQ(read_text(alone), read_text(samples() / ("seed_" + seed + ".vdb"))) << seed;
  }
}

TEST_F(GenerateMany, IndexNamesFileSeedAndSolidFraction) {
  ASSERT_EQ(run(generate("--count 2 --set microstructure.seed=7")).status, 0);
  std::ifstream index(samples() / "index.csv");
  std::string line;
  std::getline(index, line);
  EXPECT_EQ(line, "file,seed,solid_fraction,solid_points");
  for (const std::string seed : {"7", "8"}) {
    const Microstructure structure = read_microstructure(samples() / ("seed_" + seed + ".vdb"));
    std::getline(index, line);
    EXPECT_TRUE(line.starts_with("seed_" + seed + ".vdb," + seed + ",")) << line;
    EXPECT_TRUE(line.ends_with("," + std::to_string(structure.solid_points))) << line;
  }
  EXPECT_FALSE(std::getline(index, line));
}

TEST_F(GenerateMany, ResumeMakesOnlyWhatIsMissing) {
  ASSERT_EQ(run(generate("--count 2")).status, 0);
  EXPECT_EQ(run(generate("--count 4")).status, 2);  // the folder is not empty
  const auto time = fs::last_write_time(samples() / "seed_2.vdb");
  fs::remove(samples() / "seed_1.vdb");
  ASSERT_EQ(run(generate("--count 4 --resume")).status, 0);
  EXPECT_EQ(fs::last_write_time(samples() / "seed_2.vdb"), time);
  std::set<std::string> names;
  for (const auto& entry : fs::directory_iterator(samples())) names.insert(entry.path().filename());
  EXPECT_EQ(names,
            (std::set<std::string>{"index.csv", "seed_1.vdb", "seed_2.vdb", "seed_3.vdb", "seed_4.vdb"}));
}

TEST_F(GenerateMany, ResumeRefusesFilesOfAnotherScene) {
  ASSERT_EQ(run(generate("--count 1")).status, 0);
  const Outcome outcome = run(generate("--count 2 --resume --set microstructure.heterogeneity=40"));
  EXPECT_EQ(outcome.status, 2);
  EXPECT_NE(outcome.text.find("was made with heterogeneity = 50, but the scene has 40"), std::string::npos)
      << outcome.text;
  EXPECT_FALSE(fs::exists(samples() / "seed_2.vdb"));
  const Outcome finer = run(generate("--count 2 --resume --set sample.size=[1,2,2]"));
  EXPECT_EQ(finer.status, 2);
  EXPECT_NE(finer.text.find("seed_1.vdb: was made on another lattice than the scene's. Use another -o."),
            std::string::npos)
      << finer.text;
  folder_.write("samples/notes.txt", "mine");
  const Outcome foreign = run(generate("--count 2 --resume"));
  EXPECT_EQ(foreign.status, 2);
  EXPECT_NE(foreign.text.find("samples: holds notes.txt, which no series writes. Use another -o."),
            std::string::npos)
      << foreign.text;
}

TEST_F(GenerateMany, StoppedByASignalLeavesWholeFilesAndIsResumed) {
  const std::vector<std::string> arguments = {"generate",         scene_,    "-o",
                                              samples().string(), "--count", "100000",
                                              "--quiet",          "--set",   "sample.resolution=20"};
  const pid_t child = start(arguments);
  while (!fs::exists(samples() / "seed_3.vdb")) usleep(1000);
  kill(child, SIGTERM);
  EXPECT_EQ(exit_status(child), 75);
  int files = 0;
  for (const auto& entry : fs::directory_iterator(samples())) {
    if (entry.path().extension() != ".vdb") continue;
    ++files;
    EXPECT_NO_THROW(read_microstructure(entry.path()));
  }
  const std::string index = read_text(samples() / "index.csv");
  EXPECT_EQ(std::ranges::count(index, '\n'), files + 1);
  EXPECT_EQ(run(generate("--count 3 --resume --set sample.resolution=20")).status, 0);
}

TEST_F(GenerateMany, RefusesWhatHasNoRealizations) {
  const Outcome outcome =
      run("generate " + scene_ + " -o " + samples().string() + " --count 2 --set microstructure.source=full");
  EXPECT_EQ(outcome.status, 2);
  EXPECT_NE(outcome.text.find("--count wants microstructure.source"), std::string::npos) << outcome.text;
  const Outcome beyond = run(generate("--count 9 --set microstructure.seed=9223372036854775800"));
  EXPECT_EQ(beyond.status, 2);
  EXPECT_NE(
      beyond.text.find("scene.toml: microstructure.seed = 9223372036854775800 with --count 9; expected the "
                       "last seed below 2^63."),
      std::string::npos)
      << beyond.text;
  EXPECT_EQ(run(generate("--resume")).status, 2);
  EXPECT_EQ(run(generate("--count 0")).status, 2);
  EXPECT_FALSE(fs::exists(samples()));
}

TEST(Density, IsAFogVolumeThatInfoNames) {
  const TemporaryFolder folder;
  const std::string scene = folder.write("scene.toml", example_scene).string();
  const std::string file = (folder.path() / "s.vdb").string();
  ASSERT_EQ(run("generate " + scene + " -o " + file + " --density").status, 0);
  const Outcome info = run("info " + file);
  EXPECT_NE(info.text.find("grid \"density\": Tree_float_5_4_3, fog volume"), std::string::npos) << info.text;
  EXPECT_NE(info.text.find("grid \"surface\": Tree_float_5_4_3, level set"), std::string::npos) << info.text;
}

}  // namespace
}  // namespace anticrack
