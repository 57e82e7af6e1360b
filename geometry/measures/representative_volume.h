#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "measures/phase_image.h"

namespace anticrack {

/// A measure over the disjoint cubes of one edge that a sample holds.
struct SubBoxStatistics {
  int edge;                   ///< [voxels]
  std::int64_t boxes;         ///< >= 2
  double mean;                ///< unit of the measure
  double standard_deviation;  ///< over the cubes, with boxes - 1
};

/// Edges N/2, N/3, N/4, N/6, N/8, N/12, ... down to `smallest`, N the shortest side; each once. [voxels]
std::vector<int> sub_box_edges(const PhaseImage& image, int smallest = 4);

/// Solid fraction of the cubes of each edge. Cubes fill the sample from its lower corner; what is left is
/// left out.
/// @throws InputError  if an edge is below 1 or leaves fewer than two cubes
std::vector<SubBoxStatistics> sub_box_solid_fractions(const PhaseImage& image, std::span<const int> edges);

/// Any measure of the cubes; `measure` is called from several threads at a time.
/// @throws InputError  as above
std::vector<SubBoxStatistics> sub_box_measure(const PhaseImage& image, std::span<const int> edges,
                                              const std::function<double(const PhaseImage&)>& measure);

/// variance(V) = scale V^-exponent, fitted to the logarithms over the edges from the largest to a third of it
/// (N/2 to N/6: smaller cubes are not large against the structure), each weighed by its number of cubes less
/// one. With the exponent 1, scale is the point variance times the integral range: A_3 = scale / (phi (1 -
/// phi)) for the solid fraction (Lantuejoul 1991; Kanit et al. 2003, section 5; with an exponent:
/// Dirrenberger et al. 2014).
struct RepresentativeVolume {
  double mean;      ///< over the cubes of the smallest edge fitted; unit of the measure
  double scale;     ///< [unit^2 m^(3 exponent)]
  double exponent;  ///< [-]; 1 for volumes large against the structure

  /// Edge [m] of the cube whose measure deviates by `error` of the mean: error = 2 standard deviations / mean
  /// (Kanit et al. 2003, Eq. 18, for one realization).
  double edge_for_relative_error(double error) const;
};

/// @param free_exponent  false: exponent 1
/// @throws InputError  if fewer than two edges (one without the exponent) have a variance
RepresentativeVolume fit_representative_volume(std::span<const SubBoxStatistics> curve, double voxel_size,
                                               bool free_exponent = true);

}  // namespace anticrack
