#include "measured_sample.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "images/image_level_set.h"
#include "images/scan.h"
#include "microstructure_io.h"
#include "sample.h"

namespace anticrack {

namespace {

template <class T>
const T* metadata_of(const Microstructure& structure, const char* key) {
  const auto found = structure.metadata.find(key);
  return found == structure.metadata.end() ? nullptr : std::get_if<T>(&found->second);
}

MeasuredSample of_structure(const Microstructure& structure) {
  return {phase_image_of(structure), mesh_surface(structure), theory_of(structure)};
}

MeasuredSample of_scan(const std::string& input, const ImageOptions& options, ImageProgress& progress) {
  const double voxel_size = parse_voxel_size(options);
  // The level set while it grows, then the measures, labels above all.
  const auto memory = [](const Index3& size) {
    return image_level_set_memory(size) + 16 * double(size[0]) * size[1] * size[2];
  };
  PhaseSlices slices = open_phase_slices(input, options, progress, memory);
  const Index3 size = slices.size();
  const double voxels = double(size[0]) * size[1] * size[2];
  PhaseImage image = read_phase_image(slices, voxel_size, progress.watch("reading", voxels, 0.1, 0.11));
  const Microstructure structure =
      build_image_level_set(slices, voxel_size, progress.watch("level set", voxels, 0.11, 0.2));
  return {std::move(image), mesh_surface(structure), {}};
}

}  // namespace

std::optional<FieldTheory> theory_of(const Microstructure& structure) {
  const auto* source = metadata_of<std::string>(structure, "source");
  const auto* phi = metadata_of<double>(structure, "solid_fraction");
  const auto* wavelengths = metadata_of<double>(structure, "wavelengths_per_side");
  const auto* heterogeneity = metadata_of<double>(structure, "heterogeneity");
  const auto* morphology = metadata_of<std::string>(structure, "morphology");
  for (const char* key : {"anisotropy", "wavelength_gradient", "periodic"})
    if (structure.metadata.contains(key)) return {};
  if (!source || *source != "gaussian_random_field" || !phi || *phi >= 1 || !wavelengths || !heterogeneity)
    return {};
  const double side = *std::ranges::min_element(structure.lattice.points) * structure.lattice.spacing;
  const auto name = std::ranges::find(morphology_names, morphology ? *morphology : std::string("single_cut"));
  if (name == morphology_names.end()) return {};
  return FieldTheory{Morphology(name - morphology_names.begin()), *phi,
                     GammaSpectrum::of({1, *wavelengths, *heterogeneity, 0}, side)};
}

MeasuredSample load_measured_sample(const std::string& input, const ImageOptions& options,
                                    std::span<const std::string> overrides, ImageProgress& progress) {
  const std::filesystem::path file = input;
  if (file.extension() == ".vdb") return of_structure(read_microstructure(file));
  if (file.extension() != ".toml") return of_scan(input, options, progress);
  const SampleScene scene = read_sample_scene(file, overrides);
  if (std::holds_alternative<ScanSource>(scene.microstructure))
    throw InputError(fmt::format(
        "{}: microstructure.source = \"scan\"; characterize its file itself: anticrack characterize FILE "
        "--voxel-size ...",
        input));
  return of_structure(load_microstructure(scene));
}

}  // namespace anticrack
