#pragma once

#include <filesystem>
#include <future>
#include <optional>
#include <string>
#include <vector>

#include "io/frame.h"
#include "io/history.h"
#include "observables/observer.h"
#include "scene.h"
#include "simulation.h"

namespace anticrack {

/// What a run leaves in its folder: scene.toml, provenance.json, history.csv, frames/, checkpoint/,
/// result.json.
class RunFolder {
 public:
  /// A new run: writes scene and provenance and starts the history.
  RunFolder(const std::filesystem::path& folder, const Scene& scene, double spacing, int threads);

  /// Goes on after a checkpoint: later rows of the history are dropped. @throws FileError
  RunFolder(const std::filesystem::path& folder, const Scene& scene, double spacing, int threads,
            CheckpointReader& checkpoint);

  void append(const HistoryRow& row) { history_->append(row); }

  /// Takes a frame of the current state and writes it in the background, after the one before; kappa's
  /// increment counts from that. @throws FileError  if the one before could not be written
  void write_frame(const Simulation& simulation);
  int frames() const { return frames_; }  ///< taken so far
  /// Returns once all frames are on disk. @throws FileError
  void wait_for_frames();

  /// Writes the state of simulation and observer after all frames, and keeps the last two checkpoints.
  void write_checkpoint(const Simulation& simulation, const Observer& observer, double wall_seconds);
  std::int64_t last_checkpoint() const { return last_checkpoint_; }  ///< step, or -1

  const std::filesystem::path& path() const { return folder_; }

 private:
  Frame take_frame(const Simulation& simulation);

  std::filesystem::path folder_;
  Output output_;
  std::string scene_text_;
  std::string label_;
  double spacing_;
  std::optional<HistoryWriter> history_;
  int frames_ = 0;
  double last_frame_time_ = 0;
  std::vector<float> last_kappa_;  ///< by id
  std::int64_t last_checkpoint_ = -1;
  std::future<void> frame_being_written_;
};

/// What ended the run in `folder`, "until_strain" or "failure"; none if it can go on.
/// @throws InputError  if it has ended, but is of another scene, naming what differs
std::optional<std::string> end_of_run(const std::filesystem::path& folder, const std::string& scene_text);

/// The checkpoint of `folder` to resume from: the newest that is whole. Damaged ones are told on stderr.
/// @throws InputError  if it is of another scene or version, naming what differs. @throws FileError  if there
///   is none
CheckpointReader open_checkpoint(const std::filesystem::path& folder, const std::string& scene_text);

}  // namespace anticrack
