#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "scene.h"
#include "scene_names.h"

namespace anticrack {

namespace {

/// A TOML text; only what TOML wants escaped is.
std::string quoted(const std::string& text) {
  std::string quoted = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') {
      quoted += '\\';
      quoted += c;
    } else if (static_cast<unsigned char>(c) < 0x20) {
      quoted += fmt::format("\\u{:04X}", int(c));
    } else {
      quoted += c;
    }
  }
  return quoted + '"';
}

template <class Choices, class Choice>
std::string name_of(const Choices& names, Choice choice) {
  return fmt::format("\"{}\"", names[std::size_t(choice)]);
}

/// The edge of which `points` parts are `spacing` long to the last bit, by as few digits as that takes.
double edge_length(double spacing, int points) {
  const double edge = spacing * points;
  const double rounded = std::strtod(fmt::format("{:.15g}", edge).c_str(), nullptr);
  for (const double candidate : {rounded, edge, std::nextafter(edge, 0.0), std::nextafter(edge, 2 * edge)}) {
    if (candidate / points == spacing) return candidate;
  }
  return edge;
}

class TomlText {
 public:
  void section(std::string_view name) { text_ += fmt::format("{}[{}]\n", text_.empty() ? "" : "\n", name); }
  void raw(std::string_view key, const std::string& value) { text_ += fmt::format("{} = {}\n", key, value); }
  /// The shortest digits that read back as the same number.
  void number(std::string_view key, double value) { raw(key, fmt::format("{}", value)); }
  void integer(std::string_view key, std::uint64_t value) { raw(key, fmt::format("{}", value)); }
  template <class Numbers>
  void list(std::string_view key, const Numbers& numbers) {
    raw(key, fmt::format("[{}]", fmt::join(numbers, ", ")));
  }
  const std::string& text() const { return text_; }

 private:
  std::string text_;
};

struct MicrostructureWriter {
  TomlText& toml;

  void operator()(const GaussianRandomFieldSource& source) const {
    toml.number("solid_fraction", source.solid_fraction);
    toml.integer("waves", std::uint64_t(source.field.waves));
    if (source.field.spectrum) {
      toml.raw("spectrum", quoted(source.spectrum_file.string()));
    } else {
      toml.number("wavelengths_per_side", source.field.wavelengths_per_side);
      toml.number("heterogeneity", source.field.heterogeneity);
    }
    toml.integer("seed", source.field.seed);
    toml.raw("threshold_rule", name_of(scene_names::threshold_rule, source.threshold_rule));
    toml.raw("morphology", name_of(scene_names::morphology, source.morphology));
    toml.number("anisotropy", source.field.anisotropy);
    toml.raw("anisotropy_axis", name_of(scene_names::axis, source.field.anisotropy_axis));
    toml.number("wavelength_gradient", source.field.wavelength_gradient);
    toml.raw("gradient_axis", name_of(scene_names::axis, source.field.gradient_axis));
    toml.raw("periodic", source.field.periodic ? "true" : "false");
  }
  void operator()(const VdbSource& source) const { toml.raw("file", quoted(source.file.string())); }
  void operator()(const ScanSource& source) const {
    toml.raw("file", quoted(source.file.string()));
    toml.number("voxel_size", source.voxel_size);
    toml.list("solid", source.solid);
    if (source.shape) toml.list("shape", *source.shape);
  }
  void operator()(const FullSource&) const {}
};

struct LoadingWriter {
  TomlText& toml;

  void operator()(const TriaxialLoading& loading) const {
    toml.number("beta1", loading.beta1);
    toml.number("beta2", loading.beta2);
    toml.number("strain_rate", loading.strain_rate);
    toml.raw("walls", name_of(scene_names::walls, loading.walls));
    toml.number("ramp_time", loading.ramp_time);
  }
  void operator()(const ConfinedCompression& loading) const {
    toml.raw("axis", name_of(scene_names::axis, loading.axis));
    toml.raw("platen", name_of(scene_names::platen, loading.both_platens));
    toml.number("speed", loading.speed);
    toml.number("ramp_time", loading.ramp_time);
  }
};

void write_sample(TomlText& toml, const Scene& scene) {
  if (scene.lattice) {
    const SampleLattice& lattice = *scene.lattice;
    std::array<double, 3> size;
    for (int a = 0; a < 3; ++a) size[a] = edge_length(lattice.spacing, lattice.points[a]);
    toml.section("sample");
    toml.list("size", size);
    toml.integer("resolution",
                 std::uint64_t(*std::min_element(lattice.points.begin(), lattice.points.end())));
  }
  toml.section("microstructure");
  toml.raw("source", name_of(scene_names::source, scene.microstructure.index()));
  std::visit(MicrostructureWriter{toml}, scene.microstructure);
}

void write_material(TomlText& toml, const Material& material) {
  toml.section("material");
  toml.raw("model", name_of(scene_names::model, material.plasticity ? 0 : 1));
  toml.number("density", material.density);
  toml.number("young_modulus", material.elasticity.young_modulus);
  toml.number("poisson_ratio", material.elasticity.poisson_ratio);
  if (!material.plasticity) return;
  toml.number("friction", material.plasticity->friction);
  toml.number("cohesion", material.plasticity->cohesion);
  toml.number("softening", material.plasticity->softening);
}

void write_numerics(TomlText& toml, const Numerics& numerics, bool plastic) {
  toml.section("numerics");
  toml.raw("time_step", name_of(scene_names::time_step, numerics.time_step));
  toml.number("time_step_factor", numerics.time_step_factor);
  toml.raw("transfer", name_of(scene_names::transfer, numerics.transfer));
  if (numerics.transfer == TransferScheme::pic_flip) {
    if (numerics.flip_time) {
      toml.number("flip_time", *numerics.flip_time);
    } else {
      toml.number("flip", numerics.flip);
    }
  }
  toml.raw("wall_rule", name_of(scene_names::wall_rule, numerics.wall_rule));
  if (plastic) toml.raw("return_mapping", name_of(scene_names::return_mapping, numerics.return_mapping));
  toml.list("grid_offset", numerics.grid_offset);
}

}  // namespace

std::string to_toml(const Scene& scene) {
  TomlText toml;
  write_sample(toml, scene);
  write_material(toml, scene.material);

  toml.section("loading");
  toml.raw("kind", name_of(scene_names::loading, scene.loading.index()));
  std::visit(LoadingWriter{toml}, scene.loading);
  if (const auto* until = std::get_if<UntilStrain>(&scene.until)) {
    toml.number("until_strain", until->strain);
  } else {
    toml.raw("until", "\"failure\"");
  }

  write_numerics(toml, scene.numerics, scene.material.plasticity.has_value());

  toml.section("output");
  toml.integer("history_every", std::uint64_t(scene.output.history_every));
  toml.integer("frames", std::uint64_t(scene.output.frames));
  toml.number("checkpoint_minutes", scene.output.checkpoint_minutes);
  toml.raw("paraview", scene.output.paraview ? "true" : "false");
  return toml.text();
}

}  // namespace anticrack
