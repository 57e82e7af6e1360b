#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include "measures/phase_image.h"

namespace anticrack {

/// One face of the sample box.
struct BoxFace {
  int axis;    ///< 0 x, 1 y, 2 z
  bool upper;  ///< the face at the far end of the axis
};

inline constexpr std::uint32_t never_burned = std::numeric_limits<std::uint32_t>::max();

/// Burning (Herrmann, Hong and Stanley 1984): a fire starts in every voxel of the phase on a face and spreads
/// to the six neighbours within the phase. One value a voxel, in the image's order: the step at which it
/// burns, 0 on the face; `never_burned` where the fire does not come, or in the other phase. The least on the
/// opposite face is the shortest path, in steps between voxel centres.
std::vector<std::uint32_t> burning_times(const PhaseImage& image, Phase phase, const BoxFace& face);

/// Voxels that burn from both faces of an axis: those of the clusters (6-connected) that span it.
/// Divided by all voxels, phi_p of the phase.
std::uint64_t burned_from_both_faces(const PhaseImage& image, Phase phase, int axis);

/// Arrival times of a front that leaves a face at t = 0 and runs at one voxel a unit of time: |grad t| = 1 in
/// the phase, first order upwind (Sethian 1996). One value a voxel, infinity where the front does not come.
/// Exact for a plane front along an axis; from a point, distances along a diagonal come out too long: by a
/// tenth at 10 voxels, a few percent at 50.
std::vector<float> arrival_times(const PhaseImage& image, Phase phase, const BoxFace& face);

/// Geodesic tortuosity [-]: shortest path within the phase from the lower face of an axis to each voxel of
/// the upper face that can be reached, averaged over these voxels, divided by the straight way (N - 1
/// voxels).
struct Tortuosity {
  double mean;                  ///< >= 1
  double least;                 ///< of the shortest path of all, >= 1
  std::uint64_t outlet_voxels;  ///< reached on the upper face
};

/// Paths along voxel edges, six neighbours: too long by up to sqrt(3) in oblique channels. Nothing if the
/// phase does not percolate.
/// @throws InputError  if the image has fewer than two voxels along the axis
std::optional<Tortuosity> tortuosity_by_steps(const PhaseImage& image, Phase phase, int axis);

/// Euclidean paths, from `arrival_times`. Nothing if the phase does not percolate.
/// @throws InputError  if the image has fewer than two voxels along the axis
std::optional<Tortuosity> tortuosity_by_fast_marching(const PhaseImage& image, Phase phase, int axis);

}  // namespace anticrack
