#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string_view>
#include <vector>

#include "vec3.h"

namespace anticrack {

/// An image on disk that is read slice by slice, so that its size does not matter.
class SliceReader {
 public:
  virtual ~SliceReader() = default;

  const Index3& size() const { return size_; }  ///< voxels along x (columns), y (rows), z (slices)

  /// Replaces `labels` by those of slice k: x fastest, then y. Slices in order cost least. The vector grows
  /// as rows arrive, so that a header that promises too much does not ask for memory.
  /// @throws FileError  damaged or short file; a value outside 0 to 65535
  virtual void read(int k, std::vector<std::uint16_t>& labels) = 0;

 protected:
  Index3 size_{};
};

/// What a file of raw bytes does not say itself.
struct RawLayout {
  std::optional<Index3> shape;  ///< nx, ny, nz; x fastest. Of other formats: what the file must agree with
  int bits = 8;                 ///< 8 or 16, unsigned
  bool big_endian = false;
};

constexpr int most_along_an_axis = 1 << 20;  ///< voxels; larger images are wrong numbers

/// Opens an image by the ending of its name (either case):
///   .tif .tiff   grey TIFF, one slice a page, any byte order and compression of libtiff, 8 or 16 bit
///   a folder     of TIFF or PNG slices, one a file, in natural order (2 before 10)
///   .nrrd .nhdr  NRRD, raw or gzip, attached or detached
///   .mhd .mha    MetaImage, plain or compressed, data in the file or beside it
///   .npy         NumPy array [z, y, x] of integers
///   other        raw bytes, if `raw` has a shape
/// @throws FileError   missing, damaged, of another pixel format, or not as large as the shape says
/// @throws InputError  an unknown ending without a shape, or a shape out of range
std::unique_ptr<SliceReader> open_image(const std::filesystem::path& file, const RawLayout& raw = {});

/// Throws FileError "FILE: REASON".
[[noreturn]] void refuse_image(const std::filesystem::path& file, std::string_view reason);

}  // namespace anticrack
