#pragma once

#include <openvdb/openvdb.h>

#include "length_unit.h"
#include "level_sets/cut_solid.h"
#include "watch.h"

namespace anticrack {

/// The narrow-band signed distance of a microstructure; see Microstructure::surface. Kept apart so that only
/// units that work on the grid see OpenVDB.
struct LevelSet {
  openvdb::FloatGrid::ConstPtr grid;
  LengthUnit unit = length_units.front();  ///< of the grid's world space and values
};

/// Signed distance [unit], negative inside, to the solid within the sample box: half width 3 voxels, voxel
/// (i,j,k) at `spacing` (i+1/2, j+1/2, k+1/2), in the unit of `length_unit_for(spacing)`. The sign at a
/// lattice point is the sign of the excess there; a face of the box is an exact plane. Closest points are
/// sought on the smooth sheets and on the curves where they cross, not on the kinked excess. Sheets closer to
/// each other than the lattice resolves bound no voxel, but still count for the distance of the points beside
/// them.
/// @param spacing  [m]
/// @param watch    called between blocks of the lattice, by this thread
LevelSet build_level_set(const CutSolid& solid, double spacing, const Watch& watch = {});

/// The same for the solid {excess > 0} of one smooth field.
LevelSet build_level_set(const PaddedField& excess, double spacing, const Watch& watch = {});

}  // namespace anticrack
