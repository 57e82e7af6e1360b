#include "figure.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <filesystem>
#include <memory>

#include "common_options.h"
#include "errors.h"
#include "exit_codes.h"
#include "figure_data.h"
#include "files/atomic_file.h"
#include "output_folder.h"
#include "stop_signal.h"
#if ANTICRACK_RENDER
#include "plot.h"
#endif

namespace anticrack {

namespace {

namespace fs = std::filesystem;

struct FigureOptions : CommonOptions {
  std::string figure, output;
  int realizations = 5, resolution = 131;
  bool force = false;
};

#if ANTICRACK_RENDER
std::string draw(const FigurePart& part) {
  Plot plot{part.x_label, part.y_label, {}};
  plot.title = part.title;
  plot.legend_beside = true;
  for (const FigureCurve& curve : part.curves) {
    plot.curves.push_back({curve.label, curve.x, curve.mean});
    if (curve.x.size() < 20) plot.curves.back().markers.assign(curve.x.size(), Marker::filled);
  }
  return draw_plot(plot, DocumentFormat::png);
}
#endif

void make_figure(const FigureOptions& options) {
  const auto make = options.figure == "b14" ? figure_b14 : options.figure == "b15" ? figure_b15 : figure_b16;
  const FolderLock lock =
      prepare_output_folder(options.output, options.force ? ExistingFolder::replace : ExistingFolder::refuse);
  const ThreadLimit limit(thread_count(options));
  const StopOnSignal signals;
  Progress progress(options.progress());
  const std::vector<FigurePart> parts = make({options.realizations, options.resolution}, [&](double done) {
    if (signals.requested()) throw Stopped("stopped by a signal; nothing was written.");
    progress.update({.fraction = done, .of_study = options.figure});
  });
  for (const FigurePart& part : parts) {
    const fs::path csv = fs::path(options.output) / (part.name + ".csv");
    write_text_atomically(csv, to_csv(part));
#if ANTICRACK_RENDER
    write_text_atomically(fs::path(csv).replace_extension(".png"), draw(part));
#endif
    progress.message(csv.string());
  }
}

}  // namespace

CLI::App* add_figure_command(CLI::App& app) {
  CLI::App* command = app.add_subcommand(
      "figure", "Figs. B.14 to B.16 of Blatny et al. (2021): structure of the samples, data and plots");
  auto options = std::make_shared<FigureOptions>();
  command
      ->add_option("figure", options->figure,
                   "b14 (wavelengths, correlation), b15 (specific surface), b16 (percolation, tortuosity)")
      ->required()
      ->check(CLI::IsMember({"b14", "b15", "b16"}));
  command->add_option("-o,--output", options->output, "Folder to write")->required()->type_name("DIR");
  command->add_option("--realizations", options->realizations, "Samples a point; seeds 1, 2, ... (default 5)")
      ->check(CLI::Range(1, 1000));
  command
      ->add_option("--resolution", options->resolution,
                   "Lattice points along a side (default 131, as the paper)")
      ->check(CLI::Range(32, 1024));
  command->add_flag("--force", options->force, "Replace the files of an earlier figure");
  add_threads_option(*command, *options);
  add_progress_options(*command, *options);
  command->footer(
      "Examples:\n  anticrack figure b15 -o out/b15\n  anticrack figure b16 -o out/b16 --realizations 3");
  command->callback([options] { make_figure(*options); });
  return command;
}

}  // namespace anticrack
