#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <variant>
#include <vector>

#include "fields/gaussian_random_field.h"
#include "fields/morphology.h"
#include "sample_lattice.h"
#include "vec3.h"

namespace anticrack {

struct LevelSet;  // level_sets/level_set.h; holds the OpenVDB grid

using MetadataValue = std::variant<std::int64_t, double, std::string>;

/// A solid as a narrow-band signed distance, with the lattice that resolves it and the record of how it was
/// made. Cheap to copy: the level set is shared and never changes.
struct Microstructure {
  /// Grid `surface`: signed distance in its unit, negative in the solid, half width 3 voxels. In the
  /// structures made here voxel (i,j,k) lies at lattice point (i,j,k) and the sample box's faces cap the
  /// solid.
  std::shared_ptr<const LevelSet> surface;

  SampleLattice lattice;  ///< resolves the sample box
  Vec3 origin =
      Vec3::Zero();  ///< lower corner of the sample box in the level set's world space, in [m]; 0 for our own
  std::size_t solid_points = 0;  ///< lattice points in the solid

  /// How it was made, by scene key: `source`, `solid_fraction` (asked), `solid_fraction_achieved`, `waves`,
  /// `wavelengths_per_side`, `heterogeneity`, `seed` (decimal digits), `threshold`, `threshold_rule`,
  /// `morphology`, and what else departs from an isotropic stationary field.
  std::map<std::string, MetadataValue> metadata;

  /// Achieved solid fraction: solid lattice points over all.
  double solid_fraction() const { return double(solid_points) / double(lattice.count()); }
};

enum class ThresholdRule {
  theory,  ///< the threshold that meets phi on average over realizations; see `theoretical_threshold`
  exact,   ///< the order statistic on the lattice: phi holds for this sample to one lattice point
};

/// A cut through one or two Gaussian random fields, capped by the sample box (Eqs. 1-4).
/// @param solid_fraction  phi, in (0, 1]; 1 is the full block
/// @throws InputError  if a parameter is out of range, or no lattice point is solid
Microstructure generate_microstructure(const SampleLattice& lattice, const GaussianRandomFieldSpec& spec,
                                       double solid_fraction, ThresholdRule rule = ThresholdRule::theory,
                                       Morphology morphology = Morphology::single_cut);

/// Empty, or why the lattice is too coarse for the field: it has less than two points a mean wavelength.
std::string resolution_problem(const SampleLattice& lattice, const GaussianRandomFieldSpec& spec);

/// What the metadata of such a structure say of how it was asked for.
std::map<std::string, MetadataValue> microstructure_metadata(const GaussianRandomFieldSpec& spec,
                                                             double solid_fraction, ThresholdRule rule,
                                                             Morphology morphology);

/// A sample box without pores.
Microstructure full_block(const SampleLattice& lattice);

/// The lattice points at which the level set is negative, as positions in the sample box [0, lattice.size()]
/// [m]; x runs fastest, then y, then z, for any number of threads. The level set is read at `origin` + point,
/// trilinearly, which is the voxel's own value where a voxel lies.
/// @throws InputError  if no lattice point is solid
std::vector<Vec3> seed_particles(const Microstructure& structure, const SampleLattice& lattice);

}  // namespace anticrack
