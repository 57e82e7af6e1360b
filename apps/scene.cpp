#include "scene.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "scene_document.h"
#include "scene_names.h"

namespace anticrack {

namespace {

constexpr SceneKey scene_keys[] = {
    {"sample", "size", ""},
    {"sample", "resolution", ""},
    {"microstructure", "source", ""},
    {"microstructure", "solid_fraction", "gaussian_random_field"},
    {"microstructure", "waves", "gaussian_random_field"},
    {"microstructure", "wavelengths_per_side", "gaussian_random_field"},
    {"microstructure", "heterogeneity", "gaussian_random_field"},
    {"microstructure", "seed", "gaussian_random_field"},
    {"microstructure", "threshold_rule", "gaussian_random_field"},
    {"microstructure", "morphology", "gaussian_random_field"},
    {"microstructure", "anisotropy", "gaussian_random_field"},
    {"microstructure", "anisotropy_axis", "gaussian_random_field"},
    {"microstructure", "spectrum", "gaussian_random_field"},
    {"microstructure", "wavelength_gradient", "gaussian_random_field"},
    {"microstructure", "gradient_axis", "gaussian_random_field"},
    {"microstructure", "periodic", "gaussian_random_field"},
    {"microstructure", "file", "vdb scan"},
    {"microstructure", "voxel_size", "scan"},
    {"microstructure", "solid", "scan"},
    {"microstructure", "shape", "scan"},
    {"material", "model", ""},
    {"material", "density", ""},
    {"material", "young_modulus", ""},
    {"material", "poisson_ratio", ""},
    {"material", "friction", "drucker_prager_softening"},
    {"material", "cohesion", "drucker_prager_softening"},
    {"material", "softening", "drucker_prager_softening"},
    {"loading", "kind", ""},
    {"loading", "axis", "confined_compression"},
    {"loading", "platen", "confined_compression"},
    {"loading", "speed", "confined_compression"},
    {"loading", "beta1", "triaxial"},
    {"loading", "beta2", "triaxial"},
    {"loading", "strain_rate", "triaxial"},
    {"loading", "walls", "triaxial"},
    {"loading", "ramp_time", ""},
    {"loading", "until_strain", ""},
    {"loading", "until", ""},
    {"numerics", "time_step", ""},
    {"numerics", "time_step_factor", ""},
    {"numerics", "transfer", ""},
    {"numerics", "flip", "pic_flip"},
    {"numerics", "flip_time", "pic_flip"},
    {"numerics", "wall_rule", ""},
    {"numerics", "return_mapping", ""},
    {"numerics", "grid_offset", ""},
    {"output", "history_every", ""},
    {"output", "frames", ""},
    {"output", "checkpoint_minutes", ""},
    {"output", "paraview", ""},
};

constexpr std::pair<std::string_view, std::string_view> selectors[] = {
    {"microstructure", "source"}, {"material", "model"}, {"loading", "kind"}, {"numerics", "transfer"}};

constexpr std::array<std::string_view, 3> exclusive_keys[] = {
    {"loading", "until_strain", "until"},
    {"numerics", "flip", "flip_time"},
    {"microstructure", "spectrum", "wavelengths_per_side"},
    {"microstructure", "spectrum", "heterogeneity"}};

constexpr SceneSchema schema = {scene_keys, selectors, exclusive_keys};

constexpr std::int64_t most_particles = std::numeric_limits<std::uint32_t>::max();

Allowed positive(std::string_view symbol, Dimension dimension = Dimension::none) {
  return {.symbol = symbol, .dimension = dimension, .low = 0.0};
}

Allowed not_negative(std::string_view symbol, Dimension dimension = Dimension::none) {
  return {.symbol = symbol, .dimension = dimension, .low = 0.0, .low_included = true};
}

std::filesystem::path named_file(const SceneSection& section, const std::filesystem::path& scene_file,
                                 const std::string& key = "file") {
  const std::filesystem::path name = section.text(key, "expected the name of a file");
  const std::filesystem::path file =
      name.is_absolute() ? name : std::filesystem::absolute(scene_file).parent_path() / name;
  std::error_code error;
  if (!std::filesystem::exists(file, error)) {
    section.refuse(
        key, fmt::format("expected an existing file, but there is no {}", file.lexically_normal().string()));
  }
  return file.lexically_normal();
}

SampleLattice read_lattice(const SceneSection& sample) {
  const std::array<double, 3> size = sample.triple("size", positive("size", Dimension::length));
  const int resolution = int(sample.integer("resolution", 1, 10000));
  const double shortest = *std::min_element(size.begin(), size.end());

  SampleLattice lattice;
  lattice.spacing = shortest / resolution;
  if (!(lattice.spacing >= 1e-12 && lattice.spacing <= 1e12))
    sample.refuse("size", fmt::format("expected a lattice spacing (shortest side / resolution) from 1e-12 to "
                                      "1e12 m, but it is {:.9g} m",
                                      lattice.spacing));
  double points_in_all = 1;
  for (int a = 0; a < 3; ++a) {
    const double points = size[a] / lattice.spacing;
    const double nearest = std::nearbyint(points);
    if (std::abs(points - nearest) > 1e-9 * points) {
      sample.refuse(
          "size",
          fmt::format("expected whole multiples of the lattice spacing {:.9g} m (shortest side / "
                      "resolution), but {} is {:.6f} of them along {}; nearest size: {:.12g} m",
                      lattice.spacing, size[a], points, scene_names::axis[a], nearest * lattice.spacing));
    }
    points_in_all *= nearest;
    if (points_in_all > double(most_particles)) {
      sample.refuse("resolution", fmt::format("expected at most {} lattice points in all", most_particles));
    }
    lattice.points[a] = int(nearest);
  }
  return lattice;
}

ScanSource read_scan(const SceneSection& section, const std::filesystem::path& scene_file) {
  ScanSource scan{.file = named_file(section, scene_file),
                  .voxel_size = section.number("voxel_size", positive("voxel_size", Dimension::length)),
                  .solid = {}};
  for (const std::int64_t label : section.integers("solid", 0, 65535)) scan.solid.push_back(int(label));
  if (section.has("shape")) {
    const std::vector<std::int64_t> shape = section.integers("shape", 1, 100000);
    if (shape.size() != 3) section.refuse("shape", "expected [nx, ny, nz], three numbers of voxels");
    scan.shape = Index3{int(shape[0]), int(shape[1]), int(shape[2])};
  }
  return scan;
}

void read_wave_numbers(const SceneSection& section, const std::filesystem::path& scene_file,
                       GaussianRandomFieldSource& source) {
  if (!section.has("spectrum")) {
    source.field.wavelengths_per_side =
        section.number("wavelengths_per_side", positive("wavelengths_per_side"));
    source.field.heterogeneity = section.number("heterogeneity", positive("b"));
    return;
  }
  source.spectrum_file = named_file(section, scene_file, "spectrum");
  try {
    source.field.spectrum = read_wave_spectrum(source.spectrum_file);
  } catch (const std::runtime_error& error) {
    section.refuse("spectrum", error.what());
  }
}

// An axis whose ratio is not given says nothing.
int read_axis_of(const SceneSection& section, const std::string& axis, const std::string& ratio) {
  if (section.has(axis) && !section.has(ratio))
    section.refuse(axis, fmt::format("expected {} as well, whose axis it is", ratio));
  return int(section.choice(axis, scene_names::axis, 2));
}

GaussianRandomFieldSource read_gaussian_random_field(const SceneSection& section,
                                                     const std::filesystem::path& scene_file) {
  GaussianRandomFieldSource source{};
  source.solid_fraction =
      section.number("solid_fraction", {.symbol = "phi", .low = 0.0, .high = 1.0, .high_included = true});
  source.field.waves = int(section.integer("waves", 1, std::numeric_limits<int>::max()));
  read_wave_numbers(section, scene_file, source);
  source.field.seed = std::uint64_t(section.integer("seed", 0, std::numeric_limits<std::int64_t>::max()));
  source.threshold_rule = ThresholdRule(section.choice("threshold_rule", scene_names::threshold_rule, 0));
  source.morphology = Morphology(section.choice("morphology", scene_names::morphology, 0));

  const auto ratio = [&](const char* key) {
    return section.number(
        key, {.symbol = key, .low = 0.1, .high = 10.0, .low_included = true, .high_included = true}, 1.0);
  };
  source.field.anisotropy = ratio("anisotropy");
  source.field.anisotropy_axis = read_axis_of(section, "anisotropy_axis", "anisotropy");
  source.field.wavelength_gradient = ratio("wavelength_gradient");
  source.field.gradient_axis = read_axis_of(section, "gradient_axis", "wavelength_gradient");
  source.field.periodic = section.flag("periodic", false);
  if (source.field.periodic && source.field.wavelength_gradient != 1.0)
    section.refuse("periodic",
                   "expected no wavelength_gradient beside it: opposite faces would not have one wavelength");
  return source;
}

SampleScene read_sample(const SceneDocument& document, const std::filesystem::path& file) {
  SampleScene scene;
  scene.file = file;

  const SceneSection& section = document.section("microstructure", true);
  const std::size_t source = section.choice("source", scene_names::source);
  document.refuse_foreign_keys("microstructure", scene_names::source[source]);
  switch (source) {
    case 0:
      scene.microstructure = read_gaussian_random_field(section, file);
      break;
    case 1:
      scene.microstructure = VdbSource{named_file(section, file)};
      break;
    case 2:
      scene.microstructure = read_scan(section, file);
      break;
    default:
      scene.microstructure = FullSource{};
  }

  const bool from_scan = std::holds_alternative<ScanSource>(scene.microstructure);
  const bool from_vdb = std::holds_alternative<VdbSource>(scene.microstructure);
  if (from_scan && document.has("sample")) {
    document.section("sample", true)
        .refuse("must not be given with microstructure.source = \"scan\": the sample follows from the scan");
  }
  if (!from_scan && !(from_vdb && !document.has("sample")))
    scene.lattice = read_lattice(document.section("sample", true));
  if (const auto* field = std::get_if<GaussianRandomFieldSource>(&scene.microstructure)) {
    const std::string problem = resolution_problem(*scene.lattice, field->field);
    if (!problem.empty())
      section.refuse(field->field.spectrum ? "spectrum" : "wavelengths_per_side", problem);
  }
  return scene;
}

MaterialScene read_solid(const SceneDocument& document) {
  const SceneSection& section = document.section("material", true);
  const std::size_t model = section.choice("model", scene_names::model);
  document.refuse_foreign_keys("material", scene_names::model[model]);

  MaterialScene scene{};
  scene.material.density = section.number("density", positive("rho", Dimension::density));
  scene.material.elasticity.young_modulus = section.number("young_modulus", positive("E", Dimension::stress));
  scene.material.elasticity.poisson_ratio = section.number(
      "poisson_ratio",
      {.symbol = "nu", .low = -1.0, .high = 0.5, .advice = "Use 0.49 for a nearly incompressible solid."});

  const SceneSection& numerics = document.section("numerics", false);
  if (model == 0) {
    scene.material.plasticity = DruckerPragerSoftening{
        .friction = section.number("friction", not_negative("gamma")),
        .cohesion = section.number("cohesion", not_negative("c", Dimension::stress)),
        .softening = section.number("softening", not_negative("xi")),
    };
  } else if (numerics.has("return_mapping")) {
    numerics.refuse("return_mapping",
                    "that key belongs to material.model = \"drucker_prager_softening\", but the model is "
                    "\"hencky\" here");
  }
  scene.return_mapping = ReturnMapping(numerics.choice("return_mapping", scene_names::return_mapping, 0));
  return scene;
}

Loading read_loading(const SceneDocument& document) {
  const SceneSection& section = document.section("loading", true);
  const std::size_t kind = section.choice("kind", scene_names::loading);
  document.refuse_foreign_keys("loading", scene_names::loading[kind]);

  const double ramp_time = section.number("ramp_time", not_negative("ramp_time", Dimension::time), 0.0);
  if (kind == 0) {
    const Allowed strain_rate = positive("strain_rate", Dimension::rate);
    const TriaxialLoading loading{
        .beta1 = section.number("beta1", {.symbol = "beta1"}),
        .beta2 = section.number("beta2", {.symbol = "beta2"}),
        .strain_rate = section.number("strain_rate", strain_rate),
        .walls = WallKind(section.choice("walls", scene_names::walls)),
        .ramp_time = ramp_time,
    };
    if (loading.beta1 == 0 && loading.beta2 == 0) {
      section.refuse("beta2",
                     "beta1 is 0 as well, so that no wall moves; expected at least one that is not 0");
    }
    return loading;
  }
  return ConfinedCompression{
      .axis = int(section.choice("axis", scene_names::axis)),
      .both_platens = section.choice("platen", scene_names::platen) == 1,
      .speed = section.number("speed", positive("speed", Dimension::speed)),
      .ramp_time = ramp_time,
  };
}

Until read_until(const SceneSection& loading) {
  if (loading.has("until")) {
    constexpr std::string_view choices[] = {"failure"};
    loading.choice("until", choices);
    return UntilFailure{};
  }
  if (!loading.has("until_strain"))
    loading.refuse("has no end; expected until_strain = <number> or until = \"failure\"");
  return UntilStrain{loading.number(
      "until_strain", {.symbol = "until_strain", .low = 0.0, .high = 0.95, .high_included = true})};
}

Numerics read_numerics(const SceneDocument& document, ReturnMapping return_mapping) {
  const SceneSection& section = document.section("numerics", false);
  const std::size_t transfer = section.choice("transfer", scene_names::transfer, 0);
  document.refuse_foreign_keys("numerics", scene_names::transfer[transfer]);

  Numerics numerics;
  numerics.transfer = TransferScheme(transfer);
  numerics.time_step = TimeStepRule(section.choice("time_step", scene_names::time_step, 0));
  numerics.time_step_factor = section.number(
      "time_step_factor", {.symbol = "time_step_factor", .low = 0.0, .high = 1.0, .high_included = true},
      numerics.time_step_factor);
  numerics.flip = section.number(
      "flip", {.symbol = "flip", .low = 0.0, .high = 1.0, .low_included = true, .high_included = true},
      numerics.flip);
  if (section.has("flip_time"))
    numerics.flip_time = section.number("flip_time", positive("flip_time", Dimension::time));
  numerics.wall_rule = WallRule(section.choice("wall_rule", scene_names::wall_rule, 0));
  numerics.return_mapping = return_mapping;
  if (section.has("grid_offset")) {
    numerics.grid_offset = section.triple(
        "grid_offset",
        {.symbol = "grid_offset", .low = -1.0, .high = 1.0, .low_included = true, .high_included = true});
  }
  return numerics;
}

Output read_output(const SceneSection& section) {
  Output output;
  constexpr int many = std::numeric_limits<int>::max();
  output.history_every = int(section.integer("history_every", 1, many, output.history_every));
  output.frames = int(section.integer("frames", 0, 100000, output.frames));
  output.checkpoint_minutes =
      section.number("checkpoint_minutes", positive("checkpoint_minutes"), output.checkpoint_minutes);
  output.paraview = section.flag("paraview", output.paraview);
  return output;
}

/// The fastest wall's speed [m/s].
double wall_speed(const Loading& loading, const Vec3& size) {
  if (const auto* confined = std::get_if<ConfinedCompression>(&loading)) return confined->speed;
  const auto& triaxial = std::get<TriaxialLoading>(loading);
  const Vec3 rates = triaxial.strain_rate *
                     Vec3(triaxial.beta2 + triaxial.beta1, triaxial.beta2 - triaxial.beta1, triaxial.beta2);
  return rates.cwiseProduct(size).cwiseAbs().maxCoeff();
}

}  // namespace

std::string wall_speed_problem(const Loading& loading, const Material& material, const Vec3& size) {
  const double speed = wall_speed(loading, size);
  const HenckyElasticity& elasticity = material.elasticity;
  const double wave_speed = std::sqrt((elasticity.lambda() + 2 * elasticity.mu()) / material.density);
  if (speed < wave_speed) return {};
  return fmt::format(
      "expected walls slower than the elastic wave speed sqrt((lambda + 2 mu) / rho) = {:.6g} m/s, but the "
      "fastest moves at {:.6g} m/s",
      wave_speed, speed);
}

Scene read_scene(const std::filesystem::path& file, std::span<const std::string> overrides) {
  const SceneDocument document(file, overrides, schema);
  SampleScene sample = read_sample(document, file);
  const MaterialScene solid = read_solid(document);
  const SceneSection& loading = document.section("loading", true);

  Scene scene{std::move(sample), solid.material, read_loading(document), read_until(loading), {}, {}};
  scene.numerics = read_numerics(document, solid.return_mapping);
  scene.output = read_output(document.section("output", false));

  if (scene.lattice) {
    if (*std::ranges::min_element(scene.lattice->points) < 8) {
      document.section("sample", true)
          .refuse("resolution",
                  "expected at least 8, four cells, so that opposite walls do not act on the same nodes");
    }
    const std::string problem = wall_speed_problem(scene.loading, scene.material, scene.lattice->size());
    const bool confined = std::holds_alternative<ConfinedCompression>(scene.loading);
    if (!problem.empty()) loading.refuse(confined ? "speed" : "strain_rate", problem);
  }
  return scene;
}

SampleScene read_sample_scene(const std::filesystem::path& file, std::span<const std::string> overrides) {
  return read_sample(SceneDocument(file, overrides, schema), file);
}

MaterialScene read_material_scene(const std::filesystem::path& file, std::span<const std::string> overrides) {
  return read_solid(SceneDocument(file, overrides, schema));
}

}  // namespace anticrack
