#pragma once

#include <stdexcept>

namespace anticrack {

/// What the command's exit status tells scripts.
enum ExitCode {
  exit_done = 0,
  exit_wrong_input = 2,      ///< nothing was written
  exit_numerical_abort = 3,  ///< the message names the last checkpoint
  exit_file_error = 4,
  exit_stopped = 75,  ///< a signal or the wall-time limit; a checkpoint is written, run again with --resume
};

/// Thrown by a subcommand that was stopped from outside after it left everything in order.
struct Stopped : std::runtime_error {
  using std::runtime_error::runtime_error;
};

}  // namespace anticrack
