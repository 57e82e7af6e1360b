#include "progress.h"

#include <fmt/format.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <nlohmann/json.hpp>

namespace anticrack {

std::string duration_text(double seconds) {
  const long long s = std::llround(std::max(0.0, seconds));
  if (s < 60) return fmt::format("{} s", s);
  if (s < 3600) return fmt::format("{} min {} s", s / 60, s % 60);
  return fmt::format("{} h {} min", s / 3600, s % 3600 / 60);
}

namespace {

/// In percent to two decimals; never "-0.00".
double percent(double fraction) {
  return std::round(1e4 * fraction) / 100 + 0.0;
}

}  // namespace

std::string progress_text(const ProgressState& state, std::optional<double> seconds_left) {
  std::string text = state.of_study.empty()
                         ? fmt::format("step {}  strain {:.2f} %", state.step, percent(state.strain))
                         : std::string(state.of_study);
  if (state.voxels_per_second.value_or(0) > 0)
    text += fmt::format("  {:.1f} M voxels/s", *state.voxels_per_second / 1e6);
  else if (state.of_study.empty() || state.particle_steps_per_second > 0)
    text += fmt::format("  {:.1f} M particle-steps/s", state.particle_steps_per_second / 1e6);
  if (seconds_left) text += fmt::format("  {} left", duration_text(*seconds_left));
  return text;
}

std::string progress_json(const ProgressState& state, std::optional<double> seconds_left) {
  nlohmann::ordered_json json = {{"event", "progress"},
                                 {"fraction", state.fraction},
                                 {"step", state.step},
                                 {"strain", state.strain},
                                 {"particle_steps_per_second", state.particle_steps_per_second},
                                 {"seconds_left", nullptr}};
  if (!state.of_study.empty()) json["case"] = state.of_study;
  if (state.voxels_per_second) json["voxels_per_second"] = *state.voxels_per_second;
  if (seconds_left) json["seconds_left"] = *seconds_left;
  return json.dump();
}

Progress::Progress(const ProgressOptions& options, std::FILE* stream)
    : stream_(stream), start_(Clock::now()) {
  mode_ = options.quiet                  ? Mode::quiet
          : options.json                 ? Mode::json
          : isatty(fileno(stream_)) == 1 ? Mode::bar
                                         : Mode::lines;
  const char* no_color = std::getenv("NO_COLOR");
  color_ = mode_ == Mode::bar && !(no_color && *no_color);
}

Progress::~Progress() {
  clear_bar();
}

void Progress::update(const ProgressState& state) {
  if (mode_ == Mode::quiet) return;
  const Clock::time_point now = Clock::now();
  if (!first_fraction_) {
    first_fraction_ = state.fraction;
    start_ = now;
  } else if (now - last_shown_ <
             (mode_ == Mode::bar ? std::chrono::milliseconds(100) : std::chrono::minutes(1))) {
    return;
  }
  last_shown_ = now;
  show(state);
}

void Progress::message(std::string_view text) {
  if (mode_ == Mode::quiet) return;
  clear_bar();
  if (mode_ == Mode::json) {
    fmt::print(stream_, "{}\n", nlohmann::ordered_json{{"event", "message"}, {"text", text}}.dump());
  } else {
    fmt::print(stream_, "{}\n", text);
  }
  std::fflush(stream_);
}

void Progress::finish(const ProgressState& state, std::string_view text) {
  if (mode_ == Mode::quiet) return;
  if (mode_ != Mode::bar) show(state);
  message(text);
}

void Progress::show(const ProgressState& state) {
  const std::optional<double> left = seconds_left(state);
  if (mode_ == Mode::json) {
    fmt::print(stream_, "{}\n", progress_json(state, left));
  } else if (mode_ == Mode::lines) {
    fmt::print(stream_, "{:3.0f} %  {}\n", percent(std::max(0.0, state.fraction)),
               progress_text(state, left));
  } else {
    winsize window{};
    const int columns =
        ioctl(fileno(stream_), TIOCGWINSZ, &window) == 0 && window.ws_col > 0 ? window.ws_col : 80;
    const std::string text = progress_text(state, left);
    // A line that wraps could not be overwritten: the text goes first, the bar takes what is left.
    const int width = std::clamp(columns - int(text.size()) - 10, 0, 30);
    const int full = int(std::clamp(state.fraction, 0.0, 1.0) * width);
    std::string bar = fmt::format("{:#>{}}{:->{}}", "", full, "", width - full);
    if (color_) bar = fmt::format("\033[36m{}\033[0m", bar);
    fmt::print(stream_, "\r\033[K{:3.0f} % {} {:.{}}", percent(std::max(0.0, state.fraction)), bar, text,
               std::max(0, columns - 9));
    bar_is_shown_ = true;
  }
  std::fflush(stream_);
}

void Progress::clear_bar() {
  if (!bar_is_shown_) return;
  fmt::print(stream_, "\r\033[K");
  bar_is_shown_ = false;
}

std::optional<double> Progress::seconds_left(const ProgressState& state) const {
  const double done = first_fraction_ ? state.fraction - *first_fraction_ : 0;
  const double seconds = std::chrono::duration<double>(Clock::now() - start_).count();
  if (done <= 0 || seconds < 1) return {};
  return (1 - state.fraction) / done * seconds;
}

}  // namespace anticrack
