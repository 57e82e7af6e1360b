#pragma once

#include <openvdb/openvdb.h>

namespace anticrack {

/// The narrow-band signed distance of a microstructure; see Microstructure::surface. Kept apart so that only
/// units that work on the grid see OpenVDB.
struct LevelSet {
  openvdb::FloatGrid::ConstPtr grid;
};

}  // namespace anticrack
