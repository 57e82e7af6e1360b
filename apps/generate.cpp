#include "generate.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <filesystem>
#include <memory>
#include <string>

#include "common_options.h"
#include "generate_many.h"
#include "microstructure_io.h"
#include "output_folder.h"
#include "sample.h"

namespace anticrack {

namespace {

struct GenerateOptions : CommonOptions {
  std::string scene, output;
  int count = 0;  // 0: one file
  bool force = false, resume = false, density = false;

  DensityGrid density_grid() const { return density ? DensityGrid::add : DensityGrid::none; }
};

double asked_of(const SampleScene& scene) {
  const auto* field = std::get_if<GaussianRandomFieldSource>(&scene.microstructure);
  return field ? field->solid_fraction : 1.0;
}

void generate(const GenerateOptions& options) {
  // Refuse what cannot work before the work.
  const SampleScene scene = read_sample_scene(options.scene, options.set);
  if (std::holds_alternative<VdbSource>(scene.microstructure)) {
    throw InputError(
        fmt::format("{}: microstructure.source = \"vdb\" is a file already; expected "
                    "\"gaussian_random_field\" or \"full\".",
                    options.scene));
  }
  if (options.count > 0) {
    generate_many(
        {scene, options.count, options.output, options.density_grid(), options.resume, thread_count(options)},
        options.progress());
    return;
  }
  check_output_file(options.output, options.force);
  const ThreadLimit limit(thread_count(options));
  const auto start = std::chrono::steady_clock::now();

  const Microstructure structure = load_microstructure(scene);
  const std::filesystem::path folder = std::filesystem::path(options.output).parent_path();
  if (!folder.empty()) std::filesystem::create_directories(folder);
  write_microstructure(structure, options.output, options.density_grid());

  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  const Index3& points = structure.lattice.points;
  Progress(options.progress())
      .message(
          fmt::format("{}: solid fraction {:.6f} (asked {}), {} of {} x {} x {} lattice points, {:.2f} s",
                      options.output, structure.solid_fraction(), asked_of(scene), structure.solid_points,
                      points[0], points[1], points[2], seconds));
}

}  // namespace

CLI::App* add_generate_command(CLI::App& app) {
  CLI::App* command = app.add_subcommand("generate", "Microstructure from a scene, as an OpenVDB level set");
  auto options = std::make_shared<GenerateOptions>();
  command->add_option("scene", options->scene, "Scene file (TOML)")->required()->type_name("SCENE");
  command->add_option("-o,--output", options->output, "File to write; with --count a folder")
      ->required()
      ->type_name("S.vdb");
  CLI::Option* count =
      command
          ->add_option(
              "--count", options->count,
              "Make so many realizations, of the scene's seed and those after it, side by side: -o is a "
              "folder then, with seed_<seed>.vdb and index.csv")
          ->check(CLI::Range(1, 1000000))
          ->type_name("N");
  command->add_flag("--resume", options->resume, "With --count: make only the files that are missing")
      ->needs(count);
  command->add_flag("--density", options->density, "Add the fog volume `density` for volume renderers");
  command->add_flag("--force", options->force, "Replace an existing file")->excludes(count);
  add_set_option(*command, *options);
  add_threads_option(*command, *options);
  add_progress_options(*command, *options);
  command->footer(
      "Examples:\n"
      "  anticrack generate assets/scenes/quickstart.toml -o sample.vdb\n"
      "  anticrack generate scene.toml -o sample.vdb --set microstructure.seed=7 --set "
      "microstructure.solid_fraction=0.24\n"
      "  anticrack generate scene.toml -o samples --count 100");
  command->callback([options] { generate(*options); });
  return command;
}

}  // namespace anticrack
