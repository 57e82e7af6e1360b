#include <gtest/gtest.h>
#include <libdeflate.h>

#include <chrono>
#include <cstring>
#include <fstream>
#include <thread>

#include "io/checkpoint.h"
#include "io/provenance.h"
#include "running_command.h"
#include "same_run.h"
#include "temporary_folder.h"

namespace anticrack {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;

std::vector<fs::path> checkpoints_of(const fs::path& run) {
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(run / "checkpoint")) files.push_back(entry.path());
  std::ranges::sort(files);
  return files;
}

class ResumedRun : public testing::Test {
 protected:
  /// The scene's run up to `steps` into a folder of that name.
  fs::path run_up_to(int steps, const std::string& text = short_scene()) {
    folder.write("scene.toml", text);
    const fs::path output = folder.path() / std::to_string(steps);
    EXPECT_EQ(run("run " + scene + " -o " + output.string() + " --quiet --max-steps " + std::to_string(steps))
                  .status,
              0);
    return output;
  }

  Outcome resume(const fs::path& output, const std::string& more = "") const {
    return run("run " + scene + " -o " + output.string() + " --quiet --resume " + more);
  }

  const TemporaryFolder folder;
  const std::string scene = (folder.path() / "scene.toml").string();
};

TEST_F(ResumedRun, GoesOnAfterEitherSignalOnAnotherThreadCountWithTheSameBits) {
  // Checkpoints come from the signals alone.
  folder.write("scene.toml", example_with("until_strain = 0.4", "until_strain = 0.05") + "frames = 8\n");
  const fs::path whole = folder.path() / "whole", stopped = folder.path() / "stopped";
  ASSERT_EQ(run("run " + scene + " -o " + whole.string() + " --quiet --threads 1").status, 0);
  EXPECT_FALSE(fs::exists(whole / "checkpoint"));

  pid_t child = start({"run", scene, "-o", stopped.string(), "--threads", "1"});
  for (const int signal : {SIGINT, SIGTERM}) {
    const auto rows = [&] {
      return fs::exists(stopped / "history.csv") ? read_history(stopped / "history.csv").size() : 0;
    };
    const std::size_t before = rows();
    while (rows() < before + 2 && kill(child, 0) == 0) std::this_thread::sleep_for(1ms);
    kill(child, signal);
    ASSERT_EQ(exit_status(child), 75);
    EXPECT_FALSE(fs::exists(stopped / "result.json"));
    child =
        start({"run", scene, "-o", stopped.string(), "--resume", "--threads", signal == SIGINT ? "2" : "3"});
  }
  ASSERT_EQ(exit_status(child), 0);
  EXPECT_EQ(checkpoints_of(stopped).size(), 2u);
  expect_same_run(whole, stopped);
}

TEST_F(ResumedRun, IsTheSameCommandAndResumeAsTheStopSays) {
  folder.write("scene.toml", short_scene());
  const fs::path output = folder.path() / "stopped";
  const std::string command = "run " + scene + " -o " + output.string() + " --quiet --set loading.speed=3";
  const Outcome stopped = run(command + " --max-walltime 1e-9");
  EXPECT_EQ(stopped.status, 75);
  EXPECT_TRUE(stopped.text.starts_with("anticrack: stopped by max_walltime after step 0, t = 0 s; "))
      << stopped.text;
  EXPECT_TRUE(stopped.text.ends_with("; a checkpoint is written in " + output.string() +
                                     ". Go on with the same command and --resume.\n"))
      << stopped.text;
  EXPECT_EQ(run(command + " --resume --max-steps 20").status, 0);
}

TEST_F(ResumedRun, CheckpointsComeInTheIntervalThatTheSceneAsksForAndTwoAreKept) {
  const std::vector<fs::path> often = checkpoints_of(run_up_to(50));
  ASSERT_EQ(often.size(), 2u);  // one a step, and the last
  EXPECT_EQ(often[0].filename(), checkpoint_file("", 49).filename());
  EXPECT_EQ(often[1].filename(), checkpoint_file("", 50).filename());
  const std::vector<fs::path> seldom = checkpoints_of(run_up_to(51, example_scene));
  ASSERT_EQ(seldom.size(), 1u);  // ten minutes have not passed
}

TEST_F(ResumedRun, GoesOnFromTheCheckpointBeforeADamagedOneAndSaysSo) {
  const fs::path whole = run_up_to(60), damaged = run_up_to(40);
  const auto files = checkpoints_of(damaged);
  std::fstream(files[1], std::ios::in | std::ios::out | std::ios::binary).seekp(-5, std::ios::end).put('!');
  const Outcome outcome = resume(damaged, "--max-steps 60");
  EXPECT_EQ(outcome.status, 0);
  EXPECT_TRUE(outcome.text.starts_with("anticrack: " + files[1].string() + ": array \"")) << outcome.text;
  EXPECT_TRUE(
      outcome.text.ends_with("damaged: its checksum differs; going on from the checkpoint before it, " +
                             files[0].filename().string() + "\n"))
      << outcome.text;
  expect_same_run(whole, damaged);
}

TEST_F(ResumedRun, WithoutAWholeCheckpointIsAnErrorThatNamesEach) {
  const fs::path output = run_up_to(30);
  for (const fs::path& file : checkpoints_of(output)) fs::resize_file(file, 100);
  const Outcome outcome = resume(output);
  EXPECT_EQ(outcome.status, 4);
  EXPECT_EQ(outcome.text,
            "anticrack: " + (output / "checkpoint").string() + ": every checkpoint in it is damaged\n");
}

TEST_F(ResumedRun, ThatHasEndedIsLeftAsItIs) {
  folder.write("scene.toml", short_scene());
  const fs::path output = folder.path() / "ended";
  const std::string command = "run " + scene + " -o " + output.string();
  ASSERT_EQ(run(command + " --quiet").status, 0);
  const auto written = fs::last_write_time(output / "history.csv");
  const Outcome again = run(command + " --resume");
  EXPECT_EQ(again.status, 0);
  EXPECT_EQ(again.text, output.string() + ": the run has ended (until_strain); nothing is left to do\n");
  EXPECT_EQ(fs::last_write_time(output / "history.csv"), written);
  const Outcome longer = run(command + " --resume --set loading.until_strain=0.03");
  EXPECT_EQ(longer.status, 2);
  EXPECT_EQ(longer.text, "anticrack: " + output.string() +
                             ": the run in it has ended (until_strain), and is of another scene than the one "
                             "given: loading.until_strain was 0.02, is 0.03. Use --force to replace it, or "
                             "another -o.\n");
}

TEST_F(ResumedRun, OfAnotherSceneIsRefusedByKeyAndBothValues) {
  const fs::path output = run_up_to(30);
  const std::string file = checkpoint_file(output / "checkpoint", 30).string();
  const auto refusal = [&](const std::string& what) {
    return "anticrack: " + file + " is of another scene than the one given: " + what +
           ". Resume with the scene and the --set of its first start.\n";
  };
  const Outcome one = resume(output, "--set loading.speed=3");
  EXPECT_EQ(one.status, 2);
  EXPECT_EQ(one.text, refusal("loading.speed was 2, is 3"));
  const Outcome two = resume(output, "--set microstructure.seed=2 --set loading.until=failure");
  EXPECT_EQ(two.text,
            refusal("loading.until was not given, is \"failure\"; loading.until_strain was 0.02, is "
                    "not given; microstructure.seed was 1, is 2"));
  EXPECT_EQ(checkpoints_of(output).size(), 2u);
}

// The version is the first text of the file: put another in its place and make the checksums right again.
void change_version(const fs::path& file, const std::string& version) {
  std::fstream stream(file, std::ios::in | std::ios::out | std::ios::binary);
  std::string content{std::istreambuf_iterator<char>(stream), {}};
  const auto checksum = [&](std::size_t at, std::size_t size, std::size_t to) {
    const std::uint32_t sum = libdeflate_crc32(0, &content[at], size);
    std::memcpy(&content[to], &sum, sizeof sum);
  };
  constexpr std::size_t head = 40, first_entry_size = 4 + 7 + 1 + 4 + 8 + 8 + 4;
  std::uint64_t table_size = 0;
  std::memcpy(&table_size, &content[24], sizeof table_size);
  ASSERT_EQ(content.substr(head + 4, 7), "program");
  content.replace(head + table_size, version.size(), version);
  checksum(head + table_size, version.size(), head + first_entry_size - 4);
  checksum(head, table_size, 32);
  checksum(0, 36, 36);
  stream.seekp(0).write(content.data(), std::streamsize(content.size()));
}

TEST_F(ResumedRun, OfAnotherVersionIsRefusedByBothVersions) {
  const fs::path output = run_up_to(30);
  const fs::path file = checkpoint_file(output / "checkpoint", 30);
  std::string other(program_version());
  other.front() = '7';
  change_version(file, other);
  const Outcome outcome = resume(output);
  EXPECT_EQ(outcome.status, 2);
  EXPECT_EQ(outcome.text, "anticrack: " + file.string() + ": written by anticrack " + other +
                              ", but this is anticrack " + std::string(program_version()) +
                              ", whose results may differ. Go on with " + other + ".\n");
}

}  // namespace
}  // namespace anticrack
