#pragma once

#include <cstdint>
#include <limits>
#include <vector>

#include "measures/phase_image.h"

namespace anticrack {

/// Where the image has no voxel of the other phase.
inline constexpr std::int32_t no_distance = std::numeric_limits<std::int32_t>::max();

/// Exact Euclidean distance of each voxel of `phase` to the nearest voxel of the other phase, centre to
/// centre, squared [voxels^2]; 0 in the other phase. Only voxels of the image count: its faces bound nothing.
/// Lower envelopes of parabolas, axis by axis, in integers (Felzenszwalb & Huttenlocher 2012; Meijster et al.
/// 2000).
/// @throws InputError  if the diagonal of the image reaches 46340 voxels
std::vector<std::int32_t> squared_distances(const PhaseImage& image, Phase phase);

}  // namespace anticrack
