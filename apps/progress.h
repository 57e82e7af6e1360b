#pragma once

#include <chrono>
#include <cstdint>
#include <cstdio>
#include <optional>
#include <string>
#include <string_view>

namespace anticrack {

struct ProgressOptions {
  bool quiet = false;
  bool json = false;
};

/// How far a run is.
struct ProgressState {
  double fraction = 0;  ///< done, in [0, 1]; of the whole run, also after a resume
  std::int64_t step = 0;
  double strain = 0;
  double particle_steps_per_second = 0;
  std::string_view of_study = {};  ///< the case in hand, where many are run; stands for step and strain then
  std::optional<double> voxels_per_second = {};  ///< of work on an image; stands for particle-steps then
};

/// "step 1200  strain 3.41 %  42.1 M particle-steps/s  3 min 20 s left"; without the last part if nobody can
/// tell yet.
std::string progress_text(const ProgressState& state, std::optional<double> seconds_left);

/// The same as a JSON object on one line; `seconds_left` is null if nobody can tell yet.
std::string progress_json(const ProgressState& state, std::optional<double> seconds_left);

/// "45 s", "3 min 20 s", "2 h 5 min".
std::string duration_text(double seconds);

/// Progress on a stream, stderr by default: a bar on a terminal (in colour unless NO_COLOR is set), else a
/// line a minute.
class Progress {
 public:
  explicit Progress(const ProgressOptions& options, std::FILE* stream = stderr);
  ~Progress();

  /// Cheap enough for every step: shows something at most ten times a second on a terminal, else once a
  /// minute.
  void update(const ProgressState& state);
  /// A line of its own at once.
  void message(std::string_view text);
  /// The last state and a closing line, at once.
  void finish(const ProgressState& state, std::string_view text);

 private:
  using Clock = std::chrono::steady_clock;

  void show(const ProgressState& state);
  void clear_bar();
  std::optional<double> seconds_left(const ProgressState& state) const;

  enum class Mode { quiet, json, bar, lines } mode_;
  bool color_;
  std::FILE* stream_;
  bool bar_is_shown_ = false;
  std::optional<double> first_fraction_;
  Clock::time_point start_, last_shown_;
};

}  // namespace anticrack
