#pragma once

#include <optional>
#include <span>

#include "characterization.h"
#include "level_sets/surface_mesh.h"
#include "measures/field_theory.h"
#include "measures/phase_image.h"

namespace anticrack {

/// A sample as `characterize` measures it.
struct MeasuredSample {
  PhaseImage image;
  SurfaceMesh surface;                ///< of its level set
  std::optional<FieldTheory> theory;  ///< of the random field that it was cut from

  /// A density that theory knows. Curvature and Euler number of solids with sharp edges (open and closed
  /// cells) are left out: neither voxels nor meshes converge to them.
  std::optional<double> density_in_theory(double MinkowskiDensities::*density) const;
};

/// Measures that share their work.
struct MeasureGroup {
  const char* name;
  double cost;  ///< share of the time of all, for the progress line
  void (*measure)(const MeasuredSample& sample, Characterization& result);
};

/// All of them, in the order of the report.
std::span<const MeasureGroup> measure_groups();

void measure_fractions(const MeasuredSample& sample, Characterization& result);
void measure_correlation(const MeasuredSample& sample, Characterization& result);
void measure_surfaces(const MeasuredSample& sample, Characterization& result);
void measure_topology(const MeasuredSample& sample, Characterization& result);
void measure_chords(const MeasuredSample& sample, Characterization& result);
void measure_paths(const MeasuredSample& sample, Characterization& result);
void measure_thickness(const MeasuredSample& sample, Characterization& result);
void measure_representative_volume(const MeasuredSample& sample, Characterization& result);

}  // namespace anticrack
