#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <random>
#include <thread>

#include "example_scene.h"
#include "io/checkpoint.h"
#include "io/frame.h"
#include "io/history.h"
#include "temporary_folder.h"

namespace anticrack {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;

/// Starts the command in a process of its own, silent.
pid_t start(const std::vector<std::string>& arguments) {
  const pid_t child = fork();
  if (child != 0) return child;
  std::vector<char*> argv{const_cast<char*>(ANTICRACK_BINARY)};
  for (const std::string& a : arguments) argv.push_back(const_cast<char*>(a.c_str()));
  argv.push_back(nullptr);
  if (!std::freopen("/dev/null", "w", stdout) || !std::freopen("/dev/null", "w", stderr)) _exit(126);
  execv(ANTICRACK_BINARY, argv.data());
  _exit(127);
}

int exit_status(pid_t child) {
  int status = 0;
  waitpid(child, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

/// A run of about half a second that checkpoints as often as it can.
std::string short_scene() {
  return example_with("until_strain = 0.4", "until_strain = 0.02") +
         "frames = 8\ncheckpoint_minutes = 1e-6\n";
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
    const bool may_resume = fs::exists(killed / "checkpoint") && !fs::is_empty(killed / "checkpoint");
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
    if (fs::exists(killed / "checkpoint") && !fs::is_empty(killed / "checkpoint")) {
      newest_valid_checkpoint(killed / "checkpoint", damaged);
    }
    EXPECT_TRUE(damaged.empty()) << damaged.front();
    if (fs::exists(killed / "result.json")) fs::remove_all(killed);  // it got through: start anew
  }
  EXPECT_GT(killed_while_running, 50);

  const bool resumes = fs::exists(killed / "checkpoint") && !fs::is_empty(killed / "checkpoint");
  ASSERT_EQ(exit_status(start({"run", scene, "-o", killed.string(), resumes ? "--resume" : "--force"})), 0);
  std::vector<HistoryRow> a = read_history(whole / "history.csv"), b = read_history(killed / "history.csv");
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    EXPECT_EQ(a[i].step, b[i].step);
    EXPECT_EQ(a[i].p, b[i].p);
    EXPECT_EQ(a[i].wall_work, b[i].wall_work);
  }
  const auto frames = list_frames(whole / "frames");
  ASSERT_EQ(frames.size(), list_frames(killed / "frames").size());
  const Frame last = read_frame(frames.back()), again = read_frame(list_frames(killed / "frames").back());
  EXPECT_EQ(last.id, again.id);
  EXPECT_EQ(last.position, again.position);
  EXPECT_EQ(last.kappa, again.kappa);
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
