#include "precision.h"

#include <CLI/CLI.hpp>
#include <memory>
#include <string>

#include "common_options.h"
#include "errors.h"
#include "loading_study.h"

namespace anticrack {

namespace {

struct PrecisionOptions : CommonOptions {
  std::string output;
  bool loading = false;
};

}  // namespace

CLI::App* add_precision_command(CLI::App& app) {
  CLI::App* command = app.add_subcommand("precision", "Measure error against run time");
  auto options = std::make_shared<PrecisionOptions>();
  command->add_option("-o,--output", options->output, "Folder to write; cases done before are not run again")
      ->required()
      ->type_name("DIR");
  command->add_flag("--loading", options->loading, "How fast may one load? A quarter of an hour, one thread");
  add_progress_options(*command, *options);
  command->footer(
      "Examples:\n"
      "  anticrack precision -o out/precision --loading");
  command->callback([options] {
    if (!options->loading) throw InputError("precision: nothing to measure; expected --loading.");
    study_loading(options->output, options->progress());
  });
  return command;
}

}  // namespace anticrack
