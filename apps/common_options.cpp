#include "common_options.h"

#include <fmt/format.h>
#include <sched.h>
#include <tbb/global_control.h>

#include <CLI/CLI.hpp>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <thread>

#include "errors.h"

namespace anticrack {

void add_set_option(CLI::App& command, CommonOptions& options) {
  command
      .add_option("--set", options.set,
                  "Override a scene key: --set section.key=value; repeatable. Units as in the scene: "
                  "--set 'material.young_modulus=5 GPa'")
      ->type_name("KEY=VALUE")
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
}

void add_threads_option(CLI::App& command, CommonOptions& options) {
  command
      .add_option("--threads", options.threads,
                  "Threads to use; by default SLURM_CPUS_PER_TASK, else the CPUs of the affinity mask")
      ->check(CLI::Range(1, 4096))
      ->type_name("N");
}

CLI::Validator positive_number() {
  const auto check = [](std::string& text) {
    double value = 0;
    const bool allowed = CLI::detail::lexical_cast(text, value) && value > 0 && std::isfinite(value);
    return allowed ? std::string() : "Value " + text + "; expected a number above 0";
  };
  return {check, "POSITIVE"};
}

void add_progress_options(CLI::App& command, CommonOptions& options) {
  command.add_flag("--quiet", options.quiet, "No progress on stderr");
  command.add_flag("--log-json", options.log_json, "Progress on stderr as one JSON object a line");
}

int thread_count(const CommonOptions& options) {
  if (options.threads > 0) return options.threads;
  if (const char* slurm = std::getenv("SLURM_CPUS_PER_TASK"); slurm && *slurm) {
    int threads = 0;
    const char* end = slurm + std::strlen(slurm);
    const auto read = std::from_chars(slurm, end, threads);
    if (read.ec != std::errc() || read.ptr != end || threads < 1) {
      throw InputError(fmt::format(
          "SLURM_CPUS_PER_TASK = {}; expected a positive whole number. Use --threads to overrule it.",
          slurm));
    }
    return threads;
  }
  cpu_set_t mask;
  if (sched_getaffinity(0, sizeof mask, &mask) == 0) return CPU_COUNT(&mask);
  return int(std::max(1u, std::thread::hardware_concurrency()));
}

ThreadLimit::ThreadLimit(int threads)
    : control_(std::make_unique<tbb::global_control>(tbb::global_control::max_allowed_parallelism, threads)) {
}

ThreadLimit::~ThreadLimit() = default;

}  // namespace anticrack
