#include "characterize.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "common_options.h"
#include "files/atomic_file.h"
#include "measured_sample.h"
#include "nearest_name.h"
#include "output_folder.h"
#if ANTICRACK_RENDER
#include "render_characterization.h"
#endif

namespace anticrack {

namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

struct CharacterizeOptions : CommonOptions, ImageOptions {
  std::string input, output;
  std::vector<std::string> only;
  bool force = false;
};

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

std::vector<MeasureGroup> chosen_groups(const std::vector<std::string>& only) {
  const auto all = measure_groups();
  if (only.empty()) return {all.begin(), all.end()};
  std::vector<std::string> names;
  for (const MeasureGroup& group : all) names.push_back(group.name);
  for (const std::string& name : only)
    if (std::ranges::find(names, name) == names.end())
      throw InputError(
          fmt::format("--only {}: no such group of measures; expected {}.", name, fmt::join(names, ", ")));
  std::vector<MeasureGroup> chosen;
  std::ranges::copy_if(all, std::back_inserter(chosen), [&](const MeasureGroup& group) {
    return std::ranges::find(only, group.name) != only.end();
  });
  return chosen;
}

Characterization measure_all(const MeasuredSample& sample, const std::vector<MeasureGroup>& groups,
                             const std::string& input, ImageProgress& progress) {
  Characterization result;
  result.input = input;
  double total = 0, done = 0.2;
  for (const MeasureGroup& group : groups) total += group.cost;
  for (const MeasureGroup& group : groups) {
    const double next = done + 0.8 * group.cost / total;
    progress.watch(group.name, 0, done, next)(0);
    const auto start = Clock::now();
    group.measure(sample, result);
    result.seconds.emplace_back(group.name, seconds_since(start));
    done = next;
  }
  return result;
}

void characterize(const CharacterizeOptions& options) {
  const fs::path report = options.output;
  if (report.extension() != ".json")
    throw InputError(fmt::format("-o {}: expected a name that ends in .json; .csv and .png go beside it.",
                                 options.output));
  const fs::path table = fs::path(report).replace_extension(".csv"),
                 page = fs::path(report).replace_extension(".png");
  for (const fs::path& file : {report, table, page}) check_output_file(file, options.force);
  const std::vector<MeasureGroup> groups = chosen_groups(options.only);
  const ThreadLimit limit(thread_count(options));
  const auto start = Clock::now();
  ImageProgress progress(options.progress());

  const MeasuredSample sample = load_measured_sample(options.input, options, options.set, progress);
  Characterization result;
  const double loading = seconds_since(start);
  result = measure_all(sample, groups, options.input, progress);
  result.seconds.insert(result.seconds.begin(), {"reading", loading});

  if (report.has_parent_path()) fs::create_directories(report.parent_path());
  write_text_atomically(table, to_csv(result));
#if ANTICRACK_RENDER
  write_text_atomically(page, draw_characterization(result));
#endif
  write_text_atomically(report, to_json(result));
  progress.message(fmt::format("{}: {} measures of {} x {} x {} voxels, {:.1f} s", options.output,
                               result.measures.size(), sample.image.size[0], sample.image.size[1],
                               sample.image.size[2], seconds_since(start)));
}

}  // namespace

CLI::App* add_characterize_command(CLI::App& app) {
  CLI::App* command = app.add_subcommand(
      "characterize", "Solid fraction, surface, topology, paths, sizes, correlation of a sample");
  auto options = std::make_shared<CharacterizeOptions>();
  command
      ->add_option("input", options->input, "Scene (.toml), level set (.vdb), or a scan as `import` takes it")
      ->required()
      ->type_name("INPUT");
  command
      ->add_option("-o,--output", options->output,
                   "Report to write; curves (.csv) and a page of plots (.png) go beside it")
      ->required()
      ->type_name("report.json");
  std::vector<std::string> names;
  for (const MeasureGroup& group : measure_groups()) names.push_back(group.name);
  command->add_option("--only", options->only, fmt::format("Groups of measures: {}", fmt::join(names, ", ")))
      ->delimiter(',')
      ->type_name("GROUP[,GROUP]");
  add_image_options(*command, *options);
  add_set_option(*command, *options);
  command->add_flag("--force", options->force, "Replace existing files");
  add_threads_option(*command, *options);
  add_progress_options(*command, *options);
  command->footer(
      "Examples:\n"
      "  anticrack characterize sample.vdb -o sample.json\n"
      "  anticrack characterize assets/scenes/quickstart.toml -o field.json --only surfaces,correlation\n"
      "  anticrack characterize scan.tif -o scan.json --voxel-size '5.345 um'");
  command->callback([options] { characterize(*options); });
  return command;
}

}  // namespace anticrack
