#pragma once

#include <memory>
#include <string>
#include <vector>

#include "progress.h"

namespace CLI {
class App;
class Validator;
}  // namespace CLI
namespace tbb::detail::d1 {
class global_control;
}

namespace anticrack {

/// Options that several subcommands share; each adds those that it heeds.
struct CommonOptions {
  std::vector<std::string> set;  ///< "section.key=value" each
  int threads = 0;               ///< 0: not given
  bool quiet = false;
  bool log_json = false;

  ProgressOptions progress() const { return {.quiet = quiet, .json = log_json}; }
};

void add_set_option(CLI::App& command, CommonOptions& options);        ///< --set
void add_threads_option(CLI::App& command, CommonOptions& options);    ///< --threads
CLI::Validator positive_number();                                      ///< for ->check: finite and above 0
void add_progress_options(CLI::App& command, CommonOptions& options);  ///< --quiet, --log-json

/// Threads to use: --threads, else SLURM_CPUS_PER_TASK, else the CPUs that the affinity mask allows.
/// @throws InputError  SLURM_CPUS_PER_TASK is no positive number
int thread_count(const CommonOptions& options);

/// While it lives, oneTBB uses at most so many threads.
class ThreadLimit {
 public:
  explicit ThreadLimit(int threads);
  ~ThreadLimit();

 private:
  std::unique_ptr<tbb::detail::d1::global_control> control_;
};

}  // namespace anticrack
