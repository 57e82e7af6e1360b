#pragma once

#include <vector>

#include "measures/phase_image.h"
#include "microstructure.h"

namespace anticrack {

/// The centre [m] of each solid voxel, in the image's order; the box starts at 0.
std::vector<Vec3> scan_points(const PhaseImage& image);

/// Which points of a structure's own lattice are solid, as seed_particles takes them.
/// @throws InputError  if no lattice point is solid
PhaseImage phase_image_of(const Microstructure& structure);

}  // namespace anticrack
