#pragma once

#include <filesystem>

#include "microstructure.h"

namespace anticrack {

enum class DensityGrid { none, add };

/// Writes grid `surface` with the lattice, the metadata and the program's version in the metadata of grid and
/// file, and on request the fog volume `density`, which volume renderers show: the share of each voxel that
/// is solid, to first order 1/2 - distance / voxel between 0 and 1. The file appears whole or not at all.
/// @throws FileError
void write_microstructure(const Microstructure& structure, const std::filesystem::path& file,
                          DensityGrid density = DensityGrid::none);

/// Reads a file of `write_microstructure`, or any OpenVDB file with a float or double grid of class level
/// set: the one named `surface`, else the first.
///
/// A foreign grid brings no sample box: it becomes the bounding box of the voxels with negative values, each
/// voxel a cube about its point, and the lattice spacing the voxel size (cube root of the voxel volume if
/// edges differ).
/// @throws FileError  missing, not OpenVDB, damaged, without a level set (names the grids found), or without
/// solid
Microstructure read_microstructure(const std::filesystem::path& file);

}  // namespace anticrack
