#include "measure_groups.h"

namespace anticrack {

std::span<const MeasureGroup> measure_groups() {
  // Costs are seconds for the Berea scan, 400^3 voxels, on two cores.
  static constexpr MeasureGroup groups[] = {
      {"fractions", 0.1, measure_fractions}, {"correlation", 30, measure_correlation},
      {"surfaces", 5, measure_surfaces},     {"topology", 8, measure_topology},
      {"chords", 2, measure_chords},         {"paths", 40, measure_paths},
      {"thickness", 40, measure_thickness},  {"representative_volume", 1, measure_representative_volume},
  };
  return groups;
}

std::optional<double> MeasuredSample::density_in_theory(double MinkowskiDensities::*density) const {
  if (!theory) return {};
  const bool smooth =
      theory->morphology == Morphology::single_cut || theory->morphology == Morphology::two_cut;
  if (!smooth && density != &MinkowskiDensities::surface) return {};
  return minkowski_densities(*theory).*density;
}

}  // namespace anticrack
