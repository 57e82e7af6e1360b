#pragma once

#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "material/material_parameters.h"
#include "microstructure.h"
#include "numerics.h"
#include "sample_lattice.h"
#include "scene_section.h"
#include "walls/loading.h"

namespace anticrack {

/// A cut through Gaussian random fields.
struct GaussianRandomFieldSource {
  GaussianRandomFieldSpec field;
  double solid_fraction;  ///< phi [-], asked
  ThresholdRule threshold_rule = ThresholdRule::theory;
  Morphology morphology = Morphology::single_cut;
  std::filesystem::path spectrum_file = {};  ///< what `field.spectrum` was read from
};

/// A level set from a .vdb file.
struct VdbSource {
  std::filesystem::path file;
};

/// A segmented scan: one particle at the centre of each solid voxel.
struct ScanSource {
  std::filesystem::path file;
  double voxel_size;                 ///< [m]
  std::vector<int> solid;            ///< labels that count as solid
  std::optional<Index3> shape = {};  ///< voxels, for files of raw bytes
};

/// A box without pores.
struct FullSource {};

using MicrostructureSource = std::variant<GaussianRandomFieldSource, VdbSource, ScanSource, FullSource>;

/// What a scene says of the sample: sections [sample] and [microstructure].
struct SampleScene {
  std::filesystem::path file;            ///< the scene's own, for messages
  std::optional<SampleLattice> lattice;  ///< empty where it follows from the microstructure's file
  MicrostructureSource microstructure;
};

/// What a scene says of the solid phase: section [material], and numerics.return_mapping.
struct MaterialScene {
  Material material;
  ReturnMapping return_mapping;
};

struct UntilStrain {
  double strain;  ///< nominal compression, or the largest wall strain of a triaxial run; in (0, 0.95]
};
struct UntilFailure {};  ///< the second-order work has vanished, W2 = 0
using Until = std::variant<UntilStrain, UntilFailure>;

struct Output {
  int history_every = 20;          ///< steps
  int frames = 40;                 ///< beside the first one
  double checkpoint_minutes = 10;  ///< of wall time
  bool paraview = true;            ///< write the frames as .vtp beside .vdb
};

/// A whole scene, every value checked, in SI units.
struct Scene : SampleScene {
  Material material;
  Loading loading;
  Until until;
  Numerics numerics;
  Output output;
};

/// Reads a scene file (TOML). Files that it names are relative to it.
/// @param overrides  "section.key=value" each, from --set
/// @throws SceneError  naming line, key, value and what is allowed
/// @throws FileError   the scene file is there, but cannot be read
Scene read_scene(const std::filesystem::path& file, std::span<const std::string> overrides = {});

/// The same for a scene of which only the sample matters: other sections may be missing, but hold known keys.
SampleScene read_sample_scene(const std::filesystem::path& file, std::span<const std::string> overrides = {});

/// The same for a scene of which only the material matters.
MaterialScene read_material_scene(const std::filesystem::path& file,
                                  std::span<const std::string> overrides = {});

/// Empty, or why the walls are too fast for a sample of this size [m]: a wall above the elastic wave speed
/// sqrt((lambda + 2 mu) / rho) drives a shock. Names both speeds.
std::string wall_speed_problem(const Loading& loading, const Material& material, const Vec3& size);

/// The scene with every default written out. Reading it back gives the same scene to the last bit.
std::string to_toml(const Scene& scene);

}  // namespace anticrack
