#include <gtest/gtest.h>

#include <fstream>

#include "apps/running_command.h"
#include "apps/same_run.h"
#include "apps/temporary_folder.h"
#include "io/checkpoint.h"

namespace anticrack {
namespace {

namespace fs = std::filesystem;

/// Runs lines of shell in which `folder` is a disk of `kilobytes` of its own; root mounts it, other users do
/// in a user namespace. Skips the test where the system allows neither.
class FullDisk : public testing::Test {
 protected:
  void SetUp() override {
    for (const std::string with : {"unshare -m", "unshare -rm"}) {
      mount_ = with;
      if (run_on_disk(64, "true").status == 0) return;
    }
    GTEST_SKIP() << "this system lets nobody mount a small disk";
  }

  Outcome run_on_disk(int kilobytes, const std::string& lines) const {
    const std::string script = "mount -t tmpfs -o size=" + std::to_string(kilobytes) + "k tmpfs " +
                               disk.string() + " || exit 99\n" + lines;
    return run_shell(mount_ + " sh -c '" + script + "'");
  }

  const TemporaryFolder folder;
  const fs::path disk = (fs::create_directories(folder.path() / "disk"), folder.path() / "disk");
  const std::string scene = folder.write("scene.toml", short_scene()).string();

 private:
  std::string mount_;
};

// The disk fills while the run writes: at its first frame, at a checkpoint, or later.
TEST_F(FullDisk, ARunStopsWithAnErrorAndGoesOnFromItsCheckpointWithTheSameBits) {
  const fs::path whole = folder.path() / "whole";
  ASSERT_EQ(run("run " + scene + " -o " + whole.string() + " --quiet").status, 0);

  const std::string command =
      std::string(ANTICRACK_BINARY) + " run " + scene + " -o " + disk.string() + "/run --quiet ";
  int resumed = 0;
  for (int kilobytes = 64; kilobytes <= 1024; kilobytes += 128) {
    const fs::path copy = folder.path() / ("copy" + std::to_string(kilobytes));
    const Outcome outcome = run_on_disk(
        kilobytes, command + "; echo status $?\n" + "ls -A " + disk.string() + "/run/checkpoint " +
                       disk.string() + "/run/frames\ncp -r " + disk.string() + "/run " + copy.string());
    if (outcome.text.find("status 0") != std::string::npos) break;
    EXPECT_NE(outcome.text.find("status 4"), std::string::npos) << outcome.text;
    EXPECT_NE(outcome.text.find(": No space left on device"), std::string::npos) << outcome.text;
    EXPECT_EQ(outcome.text.find(".tmp"), std::string::npos) << "a temporary is left: " << outcome.text;
    if (!fs::exists(copy / "checkpoint") || fs::is_empty(copy / "checkpoint")) continue;

    std::vector<std::string> damaged;
    newest_valid_checkpoint(copy / "checkpoint", damaged);
    EXPECT_TRUE(damaged.empty());
    ASSERT_EQ(run("run " + scene + " -o " + copy.string() + " --quiet --resume").status, 0);
    expect_same_run(whole, copy);
    ++resumed;
  }
  EXPECT_GT(resumed, 1);
}

TEST_F(FullDisk, AMicrostructureThatDoesNotFitIsAnErrorAndTheOldOneStays) {
  const std::string file = disk.string() + "/s.vdb";
  const std::string generate =
      std::string(ANTICRACK_BINARY) + " generate " + scene + " -o " + file + " --quiet --force ";
  const Outcome outcome =
      run_on_disk(256, generate + "&& cp " + file + " " + folder.path().string() + "/old.vdb\n" + generate +
                           "--set sample.resolution=40; echo status $?\ncmp " + file + " " +
                           folder.path().string() + "/old.vdb && echo same\nls -A " + disk.string());
  EXPECT_EQ(outcome.text,
            "anticrack: " + file + ": cannot be written: No space left on device\nstatus 4\nsame\ns.vdb\n");
}

// A limit on the size of files acts like a full disk, not like a signal.
TEST_F(FullDisk, ALimitOnFileSizesIsAnErrorToo) {
  const Outcome outcome = run_shell("ulimit -f 20\n" + std::string(ANTICRACK_BINARY) + " run " + scene +
                                    " -o " + disk.string() + "/run --quiet");
  EXPECT_EQ(outcome.status, 4);
  EXPECT_NE(outcome.text.find(": File too large"), std::string::npos) << outcome.text;
}

/// The same with another file in the place of /proc/meminfo.
class FullMemory : public FullDisk {};

TEST_F(FullMemory, ARunWhoseParticlesDoNotFitIsRefusedBeforeItWrites) {
  const std::string meminfo =
      folder.write("meminfo", "MemTotal: 1000000000 kB\nMemAvailable: 52429 kB\n").string();
  const std::string run = std::string(ANTICRACK_BINARY) + " run " + scene + " -o " + disk.string() +
                          "/run --quiet --set microstructure.source=full --set sample.resolution=60";
  const Outcome outcome = run_on_disk(64, "mount --bind " + meminfo + " /proc/meminfo || exit 99\n" + run +
                                              "; echo status $?; ls -A " + disk.string());
  for (const std::string& part :
       {"anticrack: " + scene + ": 432000 particles need 0.",
        std::string(" GiB; expected at most the 0.05 GiB available. Use a smaller sample.resolution.\n")})
    EXPECT_PRED_FORMAT2(testing::IsSubstring, part, outcome.text);
  EXPECT_TRUE(outcome.text.ends_with("\nstatus 2\n")) << "something was written: " << outcome.text;
}

}  // namespace
}  // namespace anticrack
