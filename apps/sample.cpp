#include "sample.h"

#include <fmt/format.h>
#include <unistd.h>

#include "images/scan.h"
#include "images/segmentation.h"
#include "microstructure_io.h"

namespace anticrack {

namespace {

/// Refuses lattices that would not fit.
void check_memory(const SampleScene& scene) {
  const double needed = memory_to_generate(scene), memory = machine_memory();
  if (needed > memory) {
    throw SceneError(fmt::format(
        "{}: [sample] {} x {} x {} lattice points need about {:.1f} GB; this machine has {:.1f} GB. "
        "Use a smaller sample.resolution.",
        scene.file.string(), scene.lattice->points[0], scene.lattice->points[1], scene.lattice->points[2],
        needed / 1e9, memory / 1e9));
  }
}

std::optional<double> asked_solid_fraction(const Microstructure& structure) {
  const auto found = structure.metadata.find("solid_fraction");
  if (found == structure.metadata.end()) return {};
  const auto* number = std::get_if<double>(&found->second);
  return number ? std::optional<double>(*number) : std::nullopt;
}

Sample from_positions(const SampleLattice& lattice, std::vector<Vec3> positions,
                      std::optional<double> asked) {
  Sample sample{lattice, std::move(positions), lattice.spacing * lattice.spacing * lattice.spacing, asked, 0};
  sample.solid_fraction = double(sample.positions.size()) / double(lattice.count());
  return sample;
}

}  // namespace

// Peaks measured from 131^3 to 512^2 x 1024 points (geometry/README.md): 50 MB for the program, 11 (57 points
// a wavelength) to 14 (14 points) bytes a point for the field and its level set, 9 for a second field and the
// closest points that its solid keeps. A gradient: the sum and one of its fields in double precision.
double memory_to_generate(const SampleScene& scene) {
  constexpr double program = 50e6;
  double bytes_per_point = 13.5;
  if (const auto* source = std::get_if<GaussianRandomFieldSource>(&scene.microstructure)) {
    bytes_per_point += 9 * (field_count(source->morphology) - 1);
    if (source->field.wavelength_gradient != 1.0) bytes_per_point += 8;
  }
  return program + bytes_per_point * double(scene.lattice->count());
}

double machine_memory() {
  return double(sysconf(_SC_PHYS_PAGES)) * double(sysconf(_SC_PAGE_SIZE));
}

Microstructure load_microstructure(const SampleScene& scene) {
  if (scene.lattice) check_memory(scene);
  if (const auto* field = std::get_if<GaussianRandomFieldSource>(&scene.microstructure)) {
    return generate_microstructure(*scene.lattice, field->field, field->solid_fraction, field->threshold_rule,
                                   field->morphology);
  }
  if (const auto* vdb = std::get_if<VdbSource>(&scene.microstructure)) return read_microstructure(vdb->file);
  if (std::holds_alternative<FullSource>(scene.microstructure)) return full_block(*scene.lattice);
  throw InputError(fmt::format(
      "{}: microstructure.source = \"scan\" has no level set; expected a scene with another source",
      scene.file.string()));
}

Sample load_sample(const SampleScene& scene) {
  if (const auto* scan = std::get_if<ScanSource>(&scene.microstructure)) {
    PhaseSlices slices(open_image(scan->file, {.shape = scan->shape}), scan->file.string(),
                       {.solid = SolidLabels{scan->solid}});
    const PhaseImage image = read_phase_image(slices, scan->voxel_size);
    return from_positions({image.size, image.voxel_size}, scan_points(image), {});
  }
  const Microstructure structure = load_microstructure(scene);
  const SampleLattice lattice = scene.lattice.value_or(structure.lattice);
  return from_positions(lattice, seed_particles(structure, lattice), asked_solid_fraction(structure));
}

Sample load_sample(const Scene& scene) {
  Sample sample = load_sample(static_cast<const SampleScene&>(scene));
  const std::string problem = wall_speed_problem(scene.loading, scene.material, sample.lattice.size());
  if (!problem.empty()) throw SceneError(fmt::format("{}: [loading] {}.", scene.file.string(), problem));
  return sample;
}

SimulationSetup setup_of(const Scene& scene, const SampleLattice& lattice) {
  const double h = lattice.spacing;
  return {lattice.size(), h * h * h, 2 * h, scene.material, scene.loading, scene.numerics};
}

}  // namespace anticrack
