#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <vector>

#include "measures/phase_image.h"

namespace anticrack {

/// A two-phase image that is written slice by slice.
struct SliceSource {
  Index3 size;        ///< voxels along x, y, z
  double voxel_size;  ///< [m]
  /// Replaces `solid` by slice k (1 solid, 0 pore; x fastest); asked for in order. May throw to stop.
  std::function<void(int k, std::vector<std::uint8_t>& solid)> read;
};

/// Slices of an image in memory, which must outlive the source.
SliceSource slices_of(const PhaseImage& image);

/// Whether write_image knows the ending of the name.
bool is_image_name(const std::filesystem::path& file);

/// "a, b, c": the endings that write_image knows.
const char* image_endings();

/// Writes a byte a voxel, 255 solid and 0 pore, in the format that the name's ending tells; whole or not at
/// all:
///   .tif .tiff  a page a slice, Deflate; BigTIFF beyond 2 GB
///   NAME/       a new folder of such slices: slice_0000.tif, ...
///   .raw        x fastest, then y, then z
///   .nrrd       attached header, raw encoding, spacings in m
///   .mha .mhd   MetaImage, ElementSpacing in m; .mhd with the voxels in NAME.raw beside it
///   .npy        array [z, y, x]
///   .vti        VTK ImageData, the voxels as cells, appended raw; spacing in m
/// @throws InputError  unknown ending; a folder that holds something. @throws FileError
void write_image(const SliceSource& image, const std::filesystem::path& file);

}  // namespace anticrack
