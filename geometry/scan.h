#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <vector>

#include "vec3.h"

namespace anticrack {

/// A segmented scan: one label a voxel.
struct VoxelImage {
  Index3 size;                        ///< voxels along x, y, z
  std::vector<std::uint16_t> labels;  ///< x fastest, then y, then z
};

/// Reads a multi-page TIFF (.tif, .tiff; 8 or 16 bit grey, either byte order; columns x, rows y, pages z), or
/// raw bytes (any other name; 8 bit, x fastest), which need their shape.
/// @throws FileError   missing, damaged, of another pixel format, or not as large as the shape says
/// @throws InputError  if raw bytes come without a shape, or the shape is not positive
VoxelImage read_voxel_image(const std::filesystem::path& file, std::optional<Index3> shape = std::nullopt);

/// The centre [m] of each voxel whose label is among `solid_labels`, in the image's order; the box starts at
/// 0.
/// @param voxel_size  [m], > 0
/// @throws InputError  if no voxel is solid (names the labels present), or voxel_size is not positive
std::vector<Vec3> scan_points(const VoxelImage& image, std::span<const int> solid_labels, double voxel_size);

}  // namespace anticrack
