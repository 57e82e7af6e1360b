#include "clean.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <filesystem>
#include <map>
#include <memory>
#include <string>

#include "common_options.h"
#include "errors.h"
#include "measures/clean_microstructure.h"
#include "microstructure_io.h"
#include "output_folder.h"

namespace anticrack {

namespace {

struct CleanOptions : CommonOptions {
  std::string input, output, spanning;
  int connectivity = int(Connectivity::faces);
  bool force = false;
};

const std::map<std::string, SpanningRule> spanning_rules = {{"x", SpanningRule::x},
                                                            {"y", SpanningRule::y},
                                                            {"z", SpanningRule::z},
                                                            {"six_faces", SpanningRule::six_faces}};

void clean(const CleanOptions& options) {
  check_output_file(options.output, options.force);
  const ThreadLimit limit(thread_count(options));
  const Microstructure structure = read_microstructure(options.input);
  const CleanedMicrostructure cleaned = [&] {
    try {
      return remove_unconnected(structure, spanning_rules.at(options.spanning),
                                Connectivity(options.connectivity));
    } catch (const InputError& error) {
      throw InputError(fmt::format("{}: {}", options.input, error.what()));
    }
  }();
  const std::filesystem::path folder = std::filesystem::path(options.output).parent_path();
  if (!folder.empty()) std::filesystem::create_directories(folder);
  write_microstructure(cleaned.structure, options.output);
  const auto all = double(structure.lattice.count());
  Progress(options.progress())
      .message(fmt::format(
          "{}: phi {:.6f}, phi_p {:.6f} ({}, {}-connected); removed {} clusters, {} of {} solid "
          "lattice points",
          options.output, double(cleaned.solid_points) / all, double(cleaned.connected_points) / all,
          options.spanning, options.connectivity, cleaned.removed_clusters,
          cleaned.solid_points - cleaned.connected_points, cleaned.solid_points));
}

}  // namespace

CLI::App* add_clean_command(CLI::App& app) {
  CLI::App* command = app.add_subcommand(
      "clean", "Remove the solid that is not connected to a cluster which spans the sample");
  auto options = std::make_shared<CleanOptions>();
  command->add_option("file", options->input, "Level set to clean")->required()->type_name("S.vdb");
  command->add_option("-o,--output", options->output, "File to write")->required()->type_name("T.vdb");
  command
      ->add_option("--spanning", options->spanning,
                   "What a cluster must touch to stay: both faces of an axis (x, y, z) or six_faces")
      ->required()
      ->check(CLI::IsMember(spanning_rules));
  command->add_option("--connectivity", options->connectivity, "Neighbours share a face (6) or a corner (26)")
      ->capture_default_str()
      ->check(CLI::IsMember({6, 26}));
  command->add_flag("--force", options->force, "Replace an existing file");
  add_threads_option(*command, *options);
  add_progress_options(*command, *options);
  command->footer(
      "Examples:\n"
      "  anticrack clean sample.vdb -o connected.vdb --spanning six_faces\n"
      "A sample in which no cluster spans is an error (exit code 2); nothing is written.");
  command->callback([options] { clean(*options); });
  return command;
}

}  // namespace anticrack
