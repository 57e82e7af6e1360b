#include "precision.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <memory>
#include <nlohmann/json.hpp>
#include <sstream>

#include "common_options.h"
#include "errors.h"
#include "exit_codes.h"
#include "files/atomic_file.h"
#include "io/provenance.h"
#include "kernels.h"
#include "loading_study.h"
#include "output_folder.h"
#include "precision_report.h"
#include "stop_signal.h"
#if ANTICRACK_RENDER
#include "render_precision.h"
#endif

namespace anticrack {

namespace {

namespace fs = std::filesystem;

struct PrecisionOptions : CommonOptions {
  std::string output;
  std::vector<std::string> problems;
  int runs = 5;
  double case_seconds = 20;
  bool quick = false, resume = false, loading = false;
};

constexpr const char* results_file = "precision.json";

std::string read_text(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  std::ostringstream text;
  text << stream.rdbuf();
  if (!stream) throw FileError(fmt::format("{}: cannot read it.", file.string()));
  return text.str();
}

/// Solves a case up to `runs` times, as long as that takes less than `most_seconds` in all; the least time
/// counts.
PrecisionResult measure(const PrecisionCase& c, int runs, double most_seconds, const StopOnSignal& signals) {
  const auto start = std::chrono::steady_clock::now();
  const auto elapsed = [&] {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  };
  PrecisionResult result{c, {}, 0, {}};
  try {
    do {
      Solution solution = solve(c);
      if (result.runs == 0 || solution.seconds < result.solution.seconds)
        result.solution = std::move(solution);
      ++result.runs;
    } while (result.runs < runs && elapsed() * (result.runs + 1) < most_seconds * result.runs &&
             !signals.requested());
  } catch (const NumericalError& error) {
    result.failure = error.what();
    result.solution.seconds = elapsed();
  }
  return result;
}

std::vector<PrecisionCase> chosen_cases(const PrecisionOptions& options) {
  std::vector<PrecisionCase> cases = precision_cases(options.quick);
  if (options.problems.empty()) return cases;
  std::vector<std::string> known;
  for (const PrecisionCase& c : cases)
    if (known.empty() || known.back() != c.problem) known.push_back(c.problem);
  for (const std::string& name : options.problems)
    if (std::find(known.begin(), known.end(), name) == known.end())
      throw InputError(fmt::format("--problem {}; expected one of {}.", name, fmt::join(known, ", ")));
  std::erase_if(cases, [&](const PrecisionCase& c) {
    return std::find(options.problems.begin(), options.problems.end(), c.problem) == options.problems.end();
  });
  return cases;
}

/// Times of two machines or two versions do not belong in one diagram.
void check_provenance(const fs::path& folder) {
  const auto before = nlohmann::json::parse(read_text(folder / "provenance.json"), nullptr, false);
  const auto here = nlohmann::json::parse(provenance_text(kernels().simd, 1));
  for (const char* key : {"commit", "cpu", "simd", "flags"})
    if (before.is_discarded() || before.value(key, "") != here.value(key, ""))
      throw InputError(fmt::format(
          "{}: measured with {} \"{}\", this is \"{}\"; expected the same. Use another -o.", folder.string(),
          key, before.is_discarded() ? "?" : before.value(key, "?"), here.value(key, "?")));
}

void write_results(const fs::path& folder, std::vector<PrecisionResult> results, bool quick) {
  extrapolate_references(results);
  write_text_atomically(folder / "precision.csv", to_csv(results));
  write_text_atomically(folder / results_file, to_json(results, quick));
}

void precision(const PrecisionOptions& options) {
  const std::vector<PrecisionCase> cases = chosen_cases(options);
  const fs::path folder = options.output;
  const ExistingFolder existing = options.resume ? ExistingFolder::resume : ExistingFolder::refuse;
  const FolderLock lock = prepare_output_folder(folder, existing, results_file);
  std::vector<PrecisionResult> results;
  if (options.resume) {
    check_provenance(folder);
    bool quick = false;
    results = from_json(read_text(folder / results_file), (folder / results_file).string(), quick);
    if (quick != options.quick)
      throw InputError(fmt::format("{}: a study {} --quick; expected to go on with the same.",
                                   folder.string(), quick ? "with" : "without"));
  } else {
    write_provenance(folder / "provenance.json", kernels().simd, 1);
  }

  const ThreadLimit limit(1);
  const StopOnSignal signals;
  Progress progress(options.progress());
  const auto is_done = [&](const PrecisionCase& c) {
    return std::find(results.begin(), results.end(), c.name()) != results.end();
  };
  double all = 0, done = 0, rate = 0;
  const auto cost_of = [&](const PrecisionCase& c) {
    const double once = expected_seconds(c);
    return std::max(once, std::min(options.runs * once, options.case_seconds));
  };
  for (const PrecisionCase& c : cases) all += cost_of(c);
  for (const PrecisionCase& c : cases) {
    progress.update({done / all, 0, 0, rate, c.name()});
    if (!is_done(c)) {
      results.push_back(measure(c, options.runs, options.case_seconds, signals));
      write_results(folder, results, options.quick);
      const Solution& solution = results.back().solution;
      if (solution.seconds > 0) rate = double(solution.particles) * double(solution.steps) / solution.seconds;
    }
    done += cost_of(c);
    if (signals.requested())
      throw Stopped(fmt::format("stopped after {}. Go on with the same command and --resume.", c.name()));
  }
  extrapolate_references(results);
#if ANTICRACK_RENDER
  draw_precision_diagrams(results, folder);
#endif
  progress.finish({1, 0, 0, rate, "all cases"}, fmt::format("{}: {} cases", options.output, results.size()));
  fmt::print("{}", summary(results));
}

}  // namespace

CLI::App* add_precision_command(CLI::App& app) {
  CLI::App* command =
      app.add_subcommand("precision", "Measure error against run time on problems with known answers");
  auto options = std::make_shared<PrecisionOptions>();
  command->add_option("-o,--output", options->output, "Folder for precision.csv, precision.json and diagrams")
      ->required()
      ->type_name("DIR");
  command
      ->add_option("--problem", options->problems,
                   "Only these problems: wave, large_wave, vortex, block, void_0.3, porous, softening, ...")
      ->type_name("NAME");
  command->add_option("--runs", options->runs, "Times are the least of so many runs")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  command
      ->add_option("--case-seconds", options->case_seconds,
                   "A case is not run again where its runs would take longer in all")
      ->check(positive_number())
      ->capture_default_str();
  command->add_flag("--quick", options->quick, "Coarse grids only");
  command->add_flag("--resume", options->resume, "Go on where the study in the folder was stopped");
  command
      ->add_flag("--loading", options->loading,
                 "Instead: how fast may one load? A quarter of an hour; cases done before are not run again")
      ->excludes("--problem", "--quick", "--resume");
  add_progress_options(*command, *options);
  command->footer(
      "Examples:\n"
      "  anticrack precision -o out/precision --quick --runs 1\n"
      "  anticrack precision -o out/precision\n"
      "  anticrack precision -o out/void --problem void_0.3\n"
      "  anticrack precision -o out/loading --loading");
  command->callback([options] {
    if (options->loading) return study_loading(options->output, options->progress());
    precision(*options);
  });
  return command;
}

}  // namespace anticrack
