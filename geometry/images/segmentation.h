#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <variant>
#include <vector>

#include "images/slice_reader.h"
#include "measures/phase_image.h"
#include "watch.h"

namespace anticrack {

struct SolidLabels {
  std::vector<int> labels;  ///< these are solid; each must be present
};
struct SolidFrom {
  int value;  ///< this grey value and all above are solid
};
struct OtsuThreshold {};  ///< SolidFrom at the value that separates two classes best (Otsu 1979)
struct TwoLabels {};      ///< the image holds two values only; the greater is solid

using SolidRule = std::variant<TwoLabels, SolidLabels, SolidFrom, OtsuThreshold>;

/// What to take from an image, and which of it is solid.
struct Segmentation {
  SolidRule solid = TwoLabels{};
  /// First voxel and the one behind the last along each axis; -1: to the end.
  std::array<std::array<int, 2>, 3> crop = {{{0, -1}, {0, -1}, {0, -1}}};
  /// n: each block of n^3 voxels becomes one, of the phase that most of them have; if both have as many, of
  /// the phase of the block's first voxel, so that neither is preferred. Voxels beyond the last whole block
  /// are left out.
  int downsample = 1;
};

/// Size of an image after crop and downsampling. @param name  of the image in messages
/// @throws InputError  crop or downsample out of range
Index3 segmented_size(const Index3& image, const Segmentation& segmentation, const std::string& name);

/// An image as solid and pore, slice by slice: cropped, segmented, downsampled. Holds n slices at a time.
class PhaseSlices {
 public:
  /// Reads all that the crop leaves once, to count the values; later passes cannot fail for what they are.
  /// @param name  of the image in messages
  /// @throws InputError  crop or downsample out of range; no solid voxel; a solid label that is not present;
  /// more
  ///   than two labels and no rule
  /// @throws FileError   damaged file
  PhaseSlices(std::unique_ptr<SliceReader> image, std::string name, const Segmentation& segmentation,
              const Watch& watch = {});

  const std::string& name() const { return name_; }
  const Index3& size() const { return size_; }  ///< voxels, after crop and downsampling
  int downsample() const { return downsample_; }
  const std::array<std::array<int, 2>, 3>& crop() const { return crop_; }
  const std::string& rule() const { return rule_; }  ///< "solid = 255", "solid >= 107 (Otsu)"
  /// Of the voxels before downsampling.
  double solid_fraction_of_image() const { return solid_fraction_; }

  /// Slice k: 1 solid, 0 pore; x fastest. In order they cost least.
  void read(int k, std::vector<std::uint8_t>& solid);

 private:
  std::vector<std::uint64_t> count_values(const Watch& watch);
  void choose_solid(const SolidRule& rule, const std::vector<std::uint64_t>& counts);

  std::unique_ptr<SliceReader> image_;
  std::string name_;
  std::array<std::array<int, 2>, 3> crop_;
  int downsample_;
  Index3 size_;
  std::vector<std::uint8_t> is_solid_;  // by value
  std::string rule_;
  double solid_fraction_ = 0;
  std::vector<std::uint16_t> labels_;
};

/// The grey value t that maximizes the variance between the classes below t and from t on; the smallest of
/// equals (Otsu 1979, IEEE Trans. Systems, Man, and Cybernetics 9, 62).
/// @param counts  voxels of each value; at least two of them are not 0
int otsu_threshold(const std::vector<std::uint64_t>& counts);

/// All slices. @param voxel_size  [m] of the image as it is on disk; downsampling multiplies it
/// @throws InputError  voxel_size not positive; no voxel solid after downsampling
PhaseImage read_phase_image(PhaseSlices& slices, double voxel_size, const Watch& watch = {});

}  // namespace anticrack
