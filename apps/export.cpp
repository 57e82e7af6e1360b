#include "export.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <filesystem>
#include <memory>
#include <string>

#include "errors.h"
#include "image_options.h"
#include "images/image_level_set.h"
#include "images/scan.h"
#include "images/write_image.h"
#include "images/write_mesh.h"
#include "microstructure_io.h"
#include "output_folder.h"

namespace anticrack {

namespace {

namespace fs = std::filesystem;

void check_output(const ConversionOptions& options) {
  const fs::path output = options.output;
  if (!is_image_name(output) && !is_mesh_name(output))
    throw InputError(fmt::format("-o {}: unknown format; expected a name that ends in {}, .stl or .ply.",
                                 options.output, image_endings()));
  if (!output.has_filename()) {
    check_output_folder(output.parent_path(), ExistingFolder::refuse);
    return;
  }
  check_output_file(output, options.force);
  if (output.extension() == ".mhd")
    check_output_file(fs::path(output).replace_extension(".raw"), options.force);
}

void export_structure(const ConversionOptions& options) {
  const Microstructure structure = read_microstructure(options.input);
  if (is_mesh_name(options.output)) return write_mesh(mesh_surface(structure), options.output);
  const PhaseImage image = phase_image_of(structure);
  ImageProgress progress(options.progress());
  const Watch watch = progress.watch("writing", double(image.count()), 0, 1);
  SliceSource source = slices_of(image);
  source.read = [&, read = source.read](int k, std::vector<std::uint8_t>& solid) {
    watch(double(k) / image.size[2]);
    read(k, solid);
  };
  write_image(source, options.output);
}

void export_scan(const ConversionOptions& options) {
  const double voxel_size = parse_voxel_size(options);
  ImageProgress progress(options.progress());
  const bool is_mesh = is_mesh_name(options.output);
  PhaseSlices slices = open_phase_slices(options.input, options, progress, [&](const Index3& size) {
    return is_mesh ? image_level_set_memory(size) : double(size[0]) * size[1];
  });
  const Index3 size = slices.size();
  const Watch watch =
      progress.watch(is_mesh ? "level set" : "writing", double(size[0]) * size[1] * size[2], 0.1, 1);
  if (is_mesh)
    return write_mesh(mesh_surface(build_image_level_set(slices, voxel_size, watch)), options.output);
  write_image({size, voxel_size * slices.downsample(),
               [&](int k, std::vector<std::uint8_t>& solid) {
                 watch(double(k) / size[2]);
                 slices.read(k, solid);
               }},
              options.output);
}

void export_any(const ConversionOptions& options) {
  check_output(options);
  const ThreadLimit limit(thread_count(options));
  const fs::path folder = fs::path(options.output).has_filename()
                              ? fs::path(options.output).parent_path()
                              : fs::path(options.output).parent_path().parent_path();
  const bool is_structure = fs::path(options.input).extension() == ".vdb";
  if (is_structure && !fs::is_regular_file(options.input))
    throw FileError(fmt::format("{}: no such file", options.input));
  if (!folder.empty()) fs::create_directories(folder);
  is_structure ? export_structure(options) : export_scan(options);
  Progress(options.progress()).message(fmt::format("{}: written", options.output));
}

}  // namespace

CLI::App* add_export_command(CLI::App& app) {
  CLI::App* command = app.add_subcommand("export", "Microstructure or scan as an image or a surface mesh");
  auto options = std::make_shared<ConversionOptions>();
  add_conversion_options(
      *command, *options,
      {.input_name = "input",
       .input = "Level set (.vdb), or a scan as `import` takes it",
       .input_type = "S.vdb|FILE_OR_FOLDER",
       .output = "By its ending: .tif, .raw, .nrrd, .mhd, .mha, .npy, .vti (255 solid, 0 pore), NAME/ for a "
                 "folder of TIFF slices, .stl, .ply (surface)",
       .output_type = "FILE"});
  command->footer(
      "Examples:\n"
      "  anticrack export sample.vdb -o sample.tif\n"
      "  anticrack export sample.vdb -o sample.stl\n"
      "  anticrack export scan.tif -o scan.nrrd --voxel-size '5.345 um' --threshold otsu");
  command->callback([options] { export_any(*options); });
  return command;
}

}  // namespace anticrack
