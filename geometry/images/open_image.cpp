#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "errors.h"
#include "images/header_text.h"
#include "images/raw_slices.h"
#include "images/slice_folder.h"
#include "images/slice_reader.h"
#include "images/tiff_slices.h"

namespace anticrack {
namespace {

namespace fs = std::filesystem;

std::unique_ptr<SliceReader> open_raw(const fs::path& file, const RawLayout& raw) {
  if (std::ranges::any_of(*raw.shape, [](int n) { return n < 1 || n > most_along_an_axis; }))
    throw InputError(fmt::format("{}: shape {}; expected 1 to {} voxels along each axis", file.string(),
                                 *raw.shape, most_along_an_axis));
  return open_voxel_data(
      {.file = file, .size = *raw.shape, .bytes = raw.bits / 8, .big_endian = raw.big_endian}, true);
}

std::unique_ptr<SliceReader> open_by_ending(const fs::path& file, const RawLayout& raw) {
  const std::string ending = lower_case(file.extension().string());
  if (fs::is_directory(file)) return open_slice_folder(file);
  if (!fs::is_regular_file(file)) refuse_image(file, "no such file");
  if (ending == ".tif" || ending == ".tiff") return open_tiff(file);
  if (ending == ".nrrd" || ending == ".nhdr") return open_voxel_data(read_nrrd_header(file));
  if (ending == ".mhd" || ending == ".mha") return open_voxel_data(read_meta_image_header(file));
  if (ending == ".npy") return open_voxel_data(read_npy_header(file));
  if (ending == ".png") refuse_image(file, "a single slice; expected a folder of them");
  if (raw.shape) return open_raw(file, raw);
  throw InputError(fmt::format(
      "{}: raw bytes need a shape [nx, ny, nz]; other formats are known by their ending: .tif, .tiff, .nrrd, "
      ".nhdr, .mhd, .mha, .npy, or a folder of .tif or .png slices",
      file.string()));
}

}  // namespace

void refuse_image(const fs::path& file, std::string_view reason) {
  throw FileError(fmt::format("{}: {}", file.string(), reason));
}

std::unique_ptr<SliceReader> open_image(const fs::path& file, const RawLayout& raw) {
  std::unique_ptr<SliceReader> image = open_by_ending(file, raw);
  if (raw.shape && *raw.shape != image->size())
    refuse_image(file, fmt::format("{} voxels; expected {}", image->size(), *raw.shape));
  return image;
}

}  // namespace anticrack
