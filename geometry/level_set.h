#pragma once

#include <openvdb/openvdb.h>

#include "padded_field.h"

namespace anticrack {

/// The narrow-band signed distance of a microstructure; see Microstructure::surface. Kept apart so that only
/// units that work on the grid see OpenVDB.
struct LevelSet {
  openvdb::FloatGrid::ConstPtr grid;
};

/// Signed distance [m], negative inside, to the solid {excess > 0} within the sample box: half width 3
/// voxels, voxel (i,j,k) at world `spacing` (i+1/2, j+1/2, k+1/2). The sign at a lattice point is the sign of
/// `excess` there; a face of the box is an exact plane.
/// @param spacing  [m]
LevelSet build_level_set(const PaddedField& excess, double spacing);

}  // namespace anticrack
