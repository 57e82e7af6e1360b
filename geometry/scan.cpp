#include "scan.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <tiffio.h>

#include <algorithm>
#include <bitset>
#include <cmath>
#include <fstream>
#include <memory>

#include "errors.h"

namespace anticrack {
namespace {

namespace fs = std::filesystem;

struct CloseTiff {
  void operator()(TIFF* tiff) const { TIFFClose(tiff); }
};
using TiffFile = std::unique_ptr<TIFF, CloseTiff>;

struct Page {
  std::uint32_t width, height;
  std::uint16_t bits;

  bool operator==(const Page&) const = default;
};

[[noreturn]] void fail(const fs::path& file, const std::string& reason) {
  throw FileError(fmt::format("{}: {}", file.string(), reason));
}

Page read_page_header(TIFF* tiff, const fs::path& file, int index) {
  Page page{};
  std::uint16_t samples = 1, format = SAMPLEFORMAT_UINT;
  TIFFGetField(tiff, TIFFTAG_IMAGEWIDTH, &page.width);
  TIFFGetField(tiff, TIFFTAG_IMAGELENGTH, &page.height);
  TIFFGetFieldDefaulted(tiff, TIFFTAG_BITSPERSAMPLE, &page.bits);
  TIFFGetFieldDefaulted(tiff, TIFFTAG_SAMPLESPERPIXEL, &samples);
  TIFFGetFieldDefaulted(tiff, TIFFTAG_SAMPLEFORMAT, &format);
  if (page.width == 0 || page.height == 0 || page.width > 1 << 20 || page.height > 1 << 20)
    fail(file, fmt::format("page {}: {} x {} pixels; expected 1 to 1048576", index, page.width, page.height));
  if ((page.bits != 8 && page.bits != 16) || samples != 1 || format != SAMPLEFORMAT_UINT || TIFFIsTiled(tiff))
    fail(
        file,
        fmt::format(
            "page {}: {} bits, {} samples a pixel, sample format {}{}; expected 8 or 16 bit unsigned grey in "
            "strips",
            index, page.bits, samples, format, TIFFIsTiled(tiff) ? ", tiles" : ""));
  return page;
}

// libtiff swaps bytes and expands compression; a 16-bit row arrives in this machine's order.
VoxelImage read_tiff(const fs::path& file) {
  TIFFSetErrorHandler(nullptr);
  TIFFSetWarningHandler(nullptr);
  const TiffFile tiff(TIFFOpen(file.c_str(), "r"));
  if (!tiff) fail(file, "not a readable TIFF");
  const Page first = read_page_header(tiff.get(), file, 0);
  const auto bytes_in_row = std::size_t(TIFFScanlineSize(tiff.get()));
  if (bytes_in_row != std::size_t(first.width) * first.bits / 8)
    fail(file, "page 0: rows are not one sample a pixel");
  VoxelImage image{{int(first.width), int(first.height), 0}, {}};
  std::vector<std::uint8_t> row(bytes_in_row);
  do {
    const int index = image.size[2]++;
    if (read_page_header(tiff.get(), file, index) != first)
      fail(file, fmt::format("page {} differs from page 0 in size or depth", index));
    for (std::uint32_t y = 0; y < first.height; ++y) {
      if (TIFFReadScanline(tiff.get(), row.data(), y) != 1)
        fail(file, fmt::format("page {}: row {} is damaged", index, y));
      if (first.bits == 8) {
        image.labels.insert(image.labels.end(), row.begin(), row.end());
      } else {
        const auto* pixels = reinterpret_cast<const std::uint16_t*>(row.data());
        image.labels.insert(image.labels.end(), pixels, pixels + first.width);
      }
    }
  } while (TIFFReadDirectory(tiff.get()));
  return image;
}

VoxelImage read_raw(const fs::path& file, const std::optional<Index3>& shape) {
  if (!shape) throw InputError(fmt::format("{}: raw bytes need a shape [nx, ny, nz]", file.string()));
  if (std::ranges::any_of(*shape, [](int n) { return n < 1 || n > 1 << 20; }))
    throw InputError(
        fmt::format("{}: shape {}; expected 1 to 1048576 voxels along each axis", file.string(), *shape));
  const std::uintmax_t expected =
      std::uintmax_t((*shape)[0]) * std::uintmax_t((*shape)[1]) * std::uintmax_t((*shape)[2]);
  if (const std::uintmax_t bytes = fs::file_size(file); bytes != expected)
    fail(file, fmt::format("{} bytes; shape {} needs {}", bytes, *shape, expected));
  std::vector<std::uint8_t> bytes(expected);
  std::ifstream stream(file, std::ios::binary);
  if (!stream.read(reinterpret_cast<char*>(bytes.data()), std::streamsize(bytes.size())))
    fail(file, "cannot be read");
  return {*shape, {bytes.begin(), bytes.end()}};
}

}  // namespace

VoxelImage read_voxel_image(const fs::path& file, std::optional<Index3> shape) {
  if (!fs::is_regular_file(file)) fail(file, "no such file");
  std::string extension = file.extension().string();
  std::ranges::transform(extension, extension.begin(), [](unsigned char c) { return char(std::tolower(c)); });
  if (extension != ".tif" && extension != ".tiff") return read_raw(file, shape);
  VoxelImage image = read_tiff(file);
  if (shape && *shape != image.size) fail(file, fmt::format("{} voxels; expected {}", image.size, *shape));
  return image;
}

std::vector<Vec3> scan_points(const VoxelImage& image, std::span<const int> solid_labels, double voxel_size) {
  if (!(voxel_size > 0) || !std::isfinite(voxel_size))
    throw InputError(fmt::format("voxel size = {:g} m; expected a finite number > 0", voxel_size));
  std::bitset<65536> solid;
  for (int label : solid_labels)
    if (label >= 0 && label < 65536) solid.set(std::size_t(label));

  std::vector<Vec3> points;
  points.reserve(
      std::size_t(std::ranges::count_if(image.labels, [&](std::uint16_t label) { return solid[label]; })));
  const auto* label = image.labels.data();
  for (int k = 0; k < image.size[2]; ++k)
    for (int j = 0; j < image.size[1]; ++j)
      for (int i = 0; i < image.size[0]; ++i)
        if (solid[*label++]) points.push_back(voxel_size * Vec3(i + 0.5, j + 0.5, k + 0.5));
  if (points.empty()) {
    std::vector<std::uint16_t> present(image.labels);
    std::ranges::sort(present);
    present.erase(std::unique(present.begin(), present.end()), present.end());
    if (present.size() > 10) present.resize(10);
    throw InputError(
        fmt::format("no voxel of the scan has a solid label {}; labels present: {}", solid_labels, present));
  }
  return points;
}

}  // namespace anticrack
