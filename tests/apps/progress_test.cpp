#include "progress.h"

#include <gtest/gtest.h>

#include <cstdio>
#include <memory>

namespace anticrack {
namespace {

using File = std::unique_ptr<std::FILE, int (*)(std::FILE*)>;

std::string written(std::FILE* file) {
  std::string text(std::size_t(std::ftell(file)), '\0');
  std::rewind(file);
  text.resize(std::fread(text.data(), 1, text.size(), file));
  return text;
}

/// What a short run shows on a stream that is no terminal.
std::string shown(const ProgressOptions& options) {
  const File file(std::tmpfile(), std::fclose);
  Progress progress(options, file.get());
  progress.update({.fraction = 0, .step = 0, .strain = 0, .particle_steps_per_second = 0});
  for (int step = 1; step < 100; ++step) {
    progress.update(
        {.fraction = step / 100.0, .step = step, .strain = 0.001 * step, .particle_steps_per_second = 2e7});
  }
  progress.finish({.fraction = 1, .step = 100, .strain = 0.1, .particle_steps_per_second = 2e7}, "done");
  return written(file.get());
}

TEST(ProgressText, NamesStepStrainSpeedAndTimeLeft) {
  ProgressState state = {
      .fraction = 0.5, .step = 1200, .strain = 0.0341, .particle_steps_per_second = 42.13e6};
  EXPECT_EQ(progress_text(state, 200.0),
            "step 1200  strain 3.41 %  42.1 M particle-steps/s  3 min 20 s left");
  EXPECT_EQ(progress_text(state, {}), "step 1200  strain 3.41 %  42.1 M particle-steps/s");
  state.of_study = "wave, 24 cells";
  EXPECT_EQ(progress_text(state, 5.0), "wave, 24 cells  42.1 M particle-steps/s  5 s left");
}

TEST(ProgressText, TellsDurationsInTwoUnits) {
  EXPECT_EQ(duration_text(0.4), "0 s");
  EXPECT_EQ(duration_text(59.4), "59 s");
  EXPECT_EQ(duration_text(59.6), "1 min 0 s");
  EXPECT_EQ(duration_text(7500), "2 h 5 min");
}

TEST(ProgressText, IsOneJsonObjectOnRequest) {
  const ProgressState state = {.fraction = 0.25, .step = 7, .strain = -0.5, .particle_steps_per_second = 1e6};
  EXPECT_EQ(
      progress_json(state, {}),
      R"({"event":"progress","fraction":0.25,"step":7,"strain":-0.5,"particle_steps_per_second":1000000.0,"seconds_left":null})");
  EXPECT_NE(progress_json(state, 3.0).find(R"("seconds_left":3.0)"), std::string::npos);
}

TEST(Progress, ShowsFewPlainLinesWhereThereIsNoTerminal) {
  const std::string text = shown({});
  EXPECT_EQ(text,
            "  0 %  step 0  strain 0.00 %  0.0 M particle-steps/s\n"
            "100 %  step 100  strain 10.00 %  20.0 M particle-steps/s\ndone\n");
}

TEST(Progress, IsSilentIfQuiet) {
  EXPECT_EQ(shown({.quiet = true}), "");
}

TEST(Progress, WritesOneJsonObjectALine) {
  const std::string text = shown({.json = true});
  EXPECT_EQ(text.find("{\"event\":\"progress\""), 0u);
  EXPECT_NE(text.find("\n{\"event\":\"message\",\"text\":\"done\"}\n"), std::string::npos);
}

}  // namespace
}  // namespace anticrack
