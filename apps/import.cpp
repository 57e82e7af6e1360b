#include "import.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <filesystem>
#include <memory>
#include <string>

#include "errors.h"
#include "image_options.h"
#include "images/image_level_set.h"
#include "microstructure_io.h"
#include "output_folder.h"

namespace anticrack {

namespace {

namespace fs = std::filesystem;

void import_image(const ConversionOptions& options) {
  // Refuse what cannot work before the work.
  const double voxel_size = parse_voxel_size(options);
  if (fs::path(options.output).extension() != ".vdb")
    throw InputError(fmt::format("-o {}; expected a name that ends in .vdb. Other formats: anticrack export.",
                                 options.output));
  check_output_file(options.output, options.force);
  const ThreadLimit limit(thread_count(options));
  ImageProgress progress(options.progress());
  const auto start = std::chrono::steady_clock::now();

  PhaseSlices slices = open_phase_slices(options.input, options, progress, image_level_set_memory);
  const Index3 size = slices.size();
  Microstructure structure = build_image_level_set(
      slices, voxel_size, progress.watch("level set", double(size[0]) * size[1] * size[2], 0.1, 1));
  structure.metadata["file"] = fs::absolute(options.input).lexically_normal().filename().string();
  const fs::path folder = fs::path(options.output).parent_path();
  if (!folder.empty()) fs::create_directories(folder);
  write_microstructure(structure, options.output);

  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  progress.message(
      fmt::format("{}: {} x {} x {} voxels of {:g} m, {}, solid fraction {:.6f}, {} solid voxels, "
                  "{:.2f} s",
                  options.output, size[0], size[1], size[2], structure.lattice.spacing, slices.rule(),
                  structure.solid_fraction(), structure.solid_points, seconds));
}

}  // namespace

CLI::App* add_import_command(CLI::App& app) {
  CLI::App* command = app.add_subcommand("import", "Scan (image stack) to an OpenVDB level set");
  auto options = std::make_shared<ConversionOptions>();
  add_conversion_options(
      *command, *options,
      {.input_name = "image",
       .input = "TIFF stack, folder of TIFF or PNG slices, NRRD, MetaImage, NumPy array [z, y, x], raw bytes",
       .input_type = "FILE_OR_FOLDER",
       .output = "File to write",
       .output_type = "S.vdb"});
  command->footer(
      "Examples:\n"
      "  anticrack import assets/scans/berea.tif -o berea.vdb --voxel-size '5.345 um'\n"
      "  anticrack import slices/ -o s.vdb --voxel-size '10 um' --threshold otsu --downsample 2\n"
      "  anticrack import scan.raw -o s.vdb --voxel-size 1e-6 --shape 512,512,800 --type uint16 --solid 1,2 "
      "--crop 0:200,0:200,0:200");
  command->callback([options] { import_image(*options); });
  return command;
}

}  // namespace anticrack
