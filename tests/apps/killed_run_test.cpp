#include <gtest/gtest.h>

#include <chrono>
#include <random>
#include <thread>

#include "example_scene.h"
#include "io/checkpoint.h"
#include "running_command.h"
#include "same_run.h"
#include "temporary_folder.h"

namespace anticrack {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;

/// A run killed while it writes its first checkpoint leaves a temporary file only.
bool has_checkpoint(const fs::path& run) {
  if (!fs::exists(run / "checkpoint")) return false;
  for (const auto& entry : fs::directory_iterator(run / "checkpoint"))
    if (entry.path().extension() == ".bin") return true;
  return false;
}

TEST(KilledRun, GoesOnFromItsLastCheckpointWhereverItIsKilled) {
  const TemporaryFolder folder;
  const std::string scene = folder.write("scene.toml", short_scene()).string();
  const fs::path whole = folder.path() / "whole", killed = folder.path() / "killed";
  const auto begin = std::chrono::steady_clock::now();
  ASSERT_EQ(exit_status(start({"run", scene, "-o", whole.string()})), 0);
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();

  std::mt19937 random(3);
  std::uniform_real_distribution<> share(0, 1);
  int killed_while_running = 0;
  for (int n = 0; n < 100; ++n) {
    const bool may_resume = has_checkpoint(killed);
    const pid_t child = start({"run", scene, "-o", killed.string(), may_resume ? "--resume" : "--force"});
    std::this_thread::sleep_for(std::chrono::duration<double>(share(random) * 0.3 * seconds));
    kill(child, SIGKILL);
    int status = 0;
    waitpid(child, &status, 0);
    if (WIFSIGNALED(status))
      ++killed_while_running;
    else
      ASSERT_EQ(WEXITSTATUS(status), 0) << "refused to go on after " << n << " kills";
    std::vector<std::string> damaged;
    if (has_checkpoint(killed)) {
      newest_valid_checkpoint(killed / "checkpoint", damaged);
    }
    EXPECT_TRUE(damaged.empty()) << damaged.front();
    if (fs::exists(killed / "result.json")) fs::remove_all(killed);  // it got through: start anew
  }
  EXPECT_GT(killed_while_running, 50);

  const bool resumes = has_checkpoint(killed);
  ASSERT_EQ(exit_status(start({"run", scene, "-o", killed.string(), resumes ? "--resume" : "--force"})), 0);
  expect_same_run(whole, killed);
}

TEST(KilledRun, ASecondRunInTheSameFolderIsRefused) {
  const TemporaryFolder folder;
  const std::string scene = folder.write("scene.toml", example_scene).string();
  const fs::path output = folder.path() / "run";
  const pid_t first = start({"run", scene, "-o", output.string()});
  while (!fs::exists(output / "history.csv")) std::this_thread::sleep_for(5ms);
  EXPECT_EQ(exit_status(start({"run", scene, "-o", output.string(), "--force"})), 2);
  EXPECT_TRUE(fs::exists(output / "history.csv")) << "the refused run removed the other's files";
  kill(first, SIGKILL);
  exit_status(first);
  EXPECT_EQ(exit_status(start({"run", scene, "-o", output.string(), "--force", "--max-steps", "2"})), 0);
}

}  // namespace
}  // namespace anticrack
