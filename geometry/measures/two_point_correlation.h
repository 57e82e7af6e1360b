#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "measures/phase_image.h"

namespace anticrack {

enum class PairRule {
  inside_box,  ///< pairs with both ends in the sample, over the number of such pairs: unbiased
  periodic,  ///< the sample repeats: Blatny et al. 2021, Eq. B.1 by FFT. Biased unless the sample is periodic
};

/// Numbers of voxel pairs at a lag along one axis, by the lag in voxels from 0. Exact.
struct AxisCorrelation {
  std::vector<std::uint64_t> pairs;        ///< all pairs
  std::vector<std::uint64_t> solid_pairs;  ///< both ends solid
  std::vector<std::uint64_t>
      mixed_pairs;  ///< one end solid, the other pore; at lag 1: faces between the phases

  double g(int lag) const { return double(solid_pairs[lag]) / double(pairs[lag]); }  ///< S2 [-]
};

/// The pairs of all lattice vectors whose length rounds to one multiple of the bin width.
struct RadialBin {
  double r;                   ///< mean length of the pairs [m]
  std::uint64_t pairs;        ///< each pair of voxels once
  std::uint64_t solid_pairs;  ///< both ends solid

  double g() const { return double(solid_pairs) / double(pairs); }  ///< S2, averaged over the pairs [-]
};

/// Two-point correlation S2(r): the probability that both ends of a vector r lie in the solid (Torquato 2002,
/// section 2.2); g(r) of Blatny et al. 2021, Eqs. B.1 and B.2. g(0) = phi, g -> phi^2.
struct TwoPointCorrelation {
  PairRule rule;
  double voxel_size;                    ///< [m]
  double solid_fraction;                ///< phi [-]
  std::array<AxisCorrelation, 3> axes;  ///< lags 0 ... largest
  std::vector<RadialBin> radial;        ///< by length; the first bin is r = 0 alone

  /// g_norm = (g - phi^2) / (phi - phi^2), Eq. B.3 [-]; not a number where a phase is missing.
  double normalized(double g) const;
};

/// Lag up to which correlations are taken by default: half the shortest side [voxels].
int default_largest_lag(const PhaseImage& image);

/// By FFT, in double precision, rounded to the exact integers.
/// @param largest_lag        [voxels], >= 1, below the shortest side; periodic: at most half of it
/// @param bins_per_voxel     bins of width 1/bins_per_voxel voxel, >= 1. Bins without a vector are left out
/// @throws InputError  if an argument is out of range
TwoPointCorrelation correlate_solid(const PhaseImage& image, PairRule rule, int largest_lag,
                                    int bins_per_voxel = 1);

/// Area between solid and pores over the volume of the sample, S_V [1/m], from the slope of g at r = 0: S_V =
/// -4 dg/dr (Debye et al. 1957; Berryman 1987; Eq. B.4). The specific surface SSA is S_V / phi.
struct SlopeSurface {
  /// Mean over the axes of 2 mixed_pairs(1) / (pairs(1) h): the count of faces by Crofton's formula in three
  /// directions, and the first difference of g along the axes. Low by the curvature of g over one voxel,
  /// O(h^2); a surface whose normals prefer some directions is over- or underestimated (a plane along the
  /// axes: 2/3).
  double axes_first_difference;
  /// From lags 1 and 2, free of the cubic term: v = mixed_pairs / (2 pairs) = S_V r/4 - c r^3 + O(r^5), which
  /// holds for smooth surfaces. Same directions.
  double axes_extrapolated;
  /// 4 (phi - g(r_1)) / r_1 of the first radial bin, all directions; the paper's way if the rule is periodic.
  /// Bins one voxel wide mix |r| = 1 and sqrt(2), and a wrapped sample that is not periodic gains its faces.
  double radial;
};

/// @throws InputError  if fewer than two lags are known
SlopeSurface surface_by_slope(const TwoPointCorrelation& correlation);

}  // namespace anticrack
