#pragma once

#include <cstdint>
#include <vector>

#include "measures/phase_image.h"

namespace anticrack {

/// Local thickness of each voxel of `phase`, as the squared radius [voxels^2] of the largest ball that lies
/// in the phase and contains the voxel (Hildebrand & Ruegsegger 1997); 0 in the other phase. Balls are open
/// and centred at voxels, and touch the nearest voxel of the other phase with their surface: exact for such
/// balls. A slab along the axes, w voxels wide, gets the diameter w if w is even, w + 1 if odd. The faces of
/// the image bound nothing: a ball goes on beyond them as if the phase did; centres beyond them are unknown
/// and missing.
/// @throws InputError  if the image lacks one of the phases: no ball is bounded, or there is none
std::vector<std::int32_t> squared_local_radii(const PhaseImage& image, Phase phase);

/// Voxels whose local thickness is one and the same.
struct ThicknessShare {
  double diameter;  ///< [m]
  std::uint64_t voxels;
};

/// Size distribution of a phase by local thickness, each voxel counting once (by volume). Pore size for the
/// pores.
struct ThicknessDistribution {
  std::vector<ThicknessShare> shares;  ///< by rising diameter, every value that occurs
  std::uint64_t voxels;                ///< of the phase
  double mean;                         ///< [m]
  double standard_deviation;           ///< [m]

  /// Share of the phase's volume with diameters in [n width, (n+1) width), n = 0, 1, ... [-].
  std::vector<double> histogram(double width) const;
  /// The diameter below which the share lies [m]; 0.5 gives the median. @param share  in [0, 1]
  double quantile(double share) const;
};

/// @throws InputError  if the image lacks one of the phases
ThicknessDistribution thickness_distribution(const PhaseImage& image, Phase phase);

}  // namespace anticrack
