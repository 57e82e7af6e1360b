#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>

#include "images/slice_reader.h"

namespace anticrack {

/// Where and how the voxels of an image lie in a file: what the headers of NRRD, MetaImage and NumPy say.
struct VoxelData {
  std::filesystem::path file;
  std::uint64_t offset = 0;      ///< of the first voxel [bytes]; if compressed, of the compressed stream
  bool offset_from_end = false;  ///< the voxels are the last bytes of the file; not if compressed
  Index3 size{};                 ///< nx, ny, nz
  int bytes = 1;                 ///< a voxel: 1, 2, 4 or 8
  bool is_signed = false;
  bool big_endian = false;
  bool z_fastest = false;   ///< z runs fastest, then y, then x; not if compressed
  bool compressed = false;  ///< gzip or zlib
};

/// Reads voxels as they lie. Checks at once that the file is large enough; a file without compression that is
/// larger is refused if `whole_file`.
/// @throws FileError
std::unique_ptr<SliceReader> open_voxel_data(const VoxelData& data, bool whole_file = false);

/// The headers. @throws FileError
VoxelData read_nrrd_header(const std::filesystem::path& file);
VoxelData read_meta_image_header(const std::filesystem::path& file);
VoxelData read_npy_header(const std::filesystem::path& file);

}  // namespace anticrack
