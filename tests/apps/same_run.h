#pragma once

#include <gtest/gtest.h>

#include <cstring>
#include <filesystem>

#include "example_scene.h"
#include "io/frame.h"
#include "io/history.h"

namespace anticrack {

/// A run of about half a second that checkpoints as often as it can.
inline std::string short_scene() {
  return example_with("until_strain = 0.4", "until_strain = 0.02") +
         "frames = 8\ncheckpoint_minutes = 1e-6\n";
}

/// Two runs of one scene left the same bits, in every row but for its wall time and in every frame.
inline void expect_same_run(const std::filesystem::path& one, const std::filesystem::path& other) {
  std::vector<HistoryRow> a = read_history(one / "history.csv"), b = read_history(other / "history.csv");
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    a[i].wall_seconds = b[i].wall_seconds = 0;
    EXPECT_EQ(std::memcmp(&a[i], &b[i], sizeof(HistoryRow)), 0) << "row of step " << a[i].step;
  }
  const auto frames = list_frames(one / "frames"), again = list_frames(other / "frames");
  ASSERT_EQ(frames.size(), again.size());
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const Frame left = read_frame(frames[i]), right = read_frame(again[i]);
    EXPECT_EQ(left.header.step, right.header.step);
    EXPECT_EQ(left.id, right.id);
    EXPECT_EQ(left.position, right.position);
    EXPECT_EQ(left.velocity, right.velocity);
    EXPECT_EQ(left.kappa, right.kappa);
    EXPECT_EQ(left.dkappa, right.dkappa);
  }
}

}  // namespace anticrack
