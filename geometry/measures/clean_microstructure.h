#pragma once

#include <cstddef>
#include <cstdint>

#include "measures/clusters.h"
#include "microstructure.h"

namespace anticrack {

struct CleanedMicrostructure {
  Microstructure structure;
  std::uint64_t solid_points, connected_points;  ///< of the lattice, before and after
  std::size_t removed_clusters;
};

/// The solid of a microstructure that is connected to a cluster which spans the sample box; clusters are
/// those of the voxels with negative distance. Distances within the solid that stays are unchanged, and so
/// are those outside that do not change by more than 0.05 voxel; where a removed piece was nearer, the
/// distance is that to the solid that stays: the least of distance + way over the unchanged voxels around
/// (Hopf and Lax), a few hundredths of a voxel too long.
/// @throws InputError  if no cluster spans the sample, or its lattice points are no voxels of the level
/// set
CleanedMicrostructure remove_unconnected(const Microstructure& structure, SpanningRule rule,
                                         Connectivity connectivity);

}  // namespace anticrack
