#include "images/tiff_slices.h"

#include <fmt/format.h>
#include <tiffio.h>

#include <algorithm>
#include <cstring>
#include <optional>
#include <string_view>

#include "images/header_text.h"
#include "images/raw_slices.h"

namespace anticrack {
namespace {

namespace fs = std::filesystem;

struct CloseTiff {
  void operator()(TIFF* tiff) const { TIFFClose(tiff); }
};

struct Page {
  std::uint32_t width = 0, height = 0;
  std::uint16_t bits = 0;

  bool operator==(const Page&) const = default;
};

// libtiff swaps bytes and expands compression; a 16-bit row arrives in this machine's order.
void append(std::vector<std::uint16_t>& labels, const std::uint8_t* row, std::uint32_t width, int bits) {
  if (bits == 8) {
    labels.insert(labels.end(), row, row + width);
  } else {
    const std::size_t before = labels.size();
    labels.resize(before + width);
    std::memcpy(labels.data() + before, row, 2 * std::size_t(width));
  }
}

class TiffSlices : public SliceReader {
 public:
  explicit TiffSlices(const fs::path& file) : file_(file) {
    TIFFSetErrorHandler(nullptr);
    TIFFSetWarningHandler(nullptr);
    tiff_.reset(TIFFOpen(file.c_str(), "rm"));  // m: no memory map, which a file cut meanwhile would crash
    if (!tiff_) refuse_image(file, "not a readable TIFF");
    const std::uintmax_t bytes = fs::file_size(file);
    page_ = read_header(0);
    do {
      const int index = int(offsets_.size());
      if (read_header(index) != page_)
        refuse_image(file, fmt::format("page {} differs from page 0 in size or depth", index));
      check_extents(index, bytes);
      offsets_.push_back(TIFFCurrentDirOffset(tiff_.get()));
      if (TIFFLastDirectory(tiff_.get())) break;
      if (!TIFFReadDirectory(tiff_.get()))
        refuse_image(file, fmt::format("page {} is cut off or damaged", index + 1));
    } while (offsets_.size() < std::size_t(most_along_an_axis));
    size_ = {int(page_.width), int(page_.height), int(offsets_.size())};
  }

  void read(int k, std::vector<std::uint16_t>& labels) override {
    labels.clear();
    if (!TIFFSetSubDirectory(tiff_.get(), offsets_[std::size_t(k)]))
      refuse_image(file_, fmt::format("page {} is damaged", k));
    TIFFIsTiled(tiff_.get()) ? read_tiles(k, labels) : read_rows(k, labels);
  }

  // ImageJ writes stacks beyond 4 GB as one page, and behind its pixels those of the other slices; how many
  // it says in the description.
  std::optional<VoxelData> imagej_stack() const {
    const char* description = nullptr;
    std::uint16_t compression = 0;
    if (size_[2] != 1 || !TIFFGetField(tiff_.get(), TIFFTAG_IMAGEDESCRIPTION, &description) ||
        !TIFFGetFieldDefaulted(tiff_.get(), TIFFTAG_COMPRESSION, &compression))
      return std::nullopt;
    const std::string_view text(description), key = "\nimages=";
    const std::size_t at = text.find(key);
    if (!text.starts_with("ImageJ=") || at == std::string_view::npos) return std::nullopt;
    const std::string_view from = text.substr(at + key.size());
    const auto slices = whole_number(from.substr(0, from.find('\n')), 2, most_along_an_axis);
    if (!slices || compression != COMPRESSION_NONE) return std::nullopt;
    return VoxelData{.file = file_,
                     .offset = TIFFGetStrileOffset(tiff_.get(), 0),
                     .size = {size_[0], size_[1], int(*slices)},
                     .bytes = page_.bits / 8,
                     .big_endian = TIFFIsBigEndian(tiff_.get()) != 0};
  }

 private:
  Page read_header(int index) const {
    Page page;
    std::uint16_t samples = 1, format = SAMPLEFORMAT_UINT;
    TIFFGetField(tiff_.get(), TIFFTAG_IMAGEWIDTH, &page.width);
    TIFFGetField(tiff_.get(), TIFFTAG_IMAGELENGTH, &page.height);
    TIFFGetFieldDefaulted(tiff_.get(), TIFFTAG_BITSPERSAMPLE, &page.bits);
    TIFFGetFieldDefaulted(tiff_.get(), TIFFTAG_SAMPLESPERPIXEL, &samples);
    TIFFGetFieldDefaulted(tiff_.get(), TIFFTAG_SAMPLEFORMAT, &format);
    constexpr auto most = std::uint32_t(most_along_an_axis);
    if (page.width == 0 || page.height == 0 || page.width > most || page.height > most)
      refuse_image(file_, fmt::format("page {}: {} x {} pixels; expected 1 to {}", index, page.width,
                                      page.height, most));
    if ((page.bits != 8 && page.bits != 16) || samples != 1 || format != SAMPLEFORMAT_UINT)
      refuse_image(file_,
                   fmt::format("page {}: {} bits, {} samples a pixel, sample format {}; expected 8 or 16 bit "
                               "unsigned grey",
                               index, page.bits, samples, format));
    return page;
  }

  // libtiff would give what is left of a strip that the end of the file cuts off.
  void check_extents(int index, std::uintmax_t bytes) const {
    const bool tiled = TIFFIsTiled(tiff_.get());
    const std::uint32_t pieces = tiled ? TIFFNumberOfTiles(tiff_.get()) : TIFFNumberOfStrips(tiff_.get());
    for (std::uint32_t piece = 0; piece < pieces; ++piece) {
      const std::uint64_t begin = TIFFGetStrileOffset(tiff_.get(), piece);
      const std::uint64_t size = TIFFGetStrileByteCount(tiff_.get(), piece);
      if (size == 0 || size > bytes || begin > bytes - size)
        refuse_image(file_, fmt::format("page {}: {} {} of {} bytes at byte {} is not within the file of {} "
                                        "bytes: cut off or damaged",
                                        index, tiled ? "tile" : "strip", piece, size, begin, bytes));
    }
  }

  void read_rows(int k, std::vector<std::uint16_t>& labels) {
    std::vector<std::uint8_t> row(std::size_t(page_.width) * page_.bits / 8);
    if (std::size_t(TIFFScanlineSize(tiff_.get())) != row.size())
      refuse_image(file_, fmt::format("page {}: rows are not one sample a pixel", k));
    for (std::uint32_t y = 0; y < page_.height; ++y) {
      if (TIFFReadScanline(tiff_.get(), row.data(), y) != 1)
        refuse_image(file_, fmt::format("page {}: row {} is damaged", k, y));
      append(labels, row.data(), page_.width, page_.bits);
    }
  }

  // A row of tiles at a time.
  void read_tiles(int k, std::vector<std::uint16_t>& labels) {
    std::uint32_t width = 0, height = 0;
    TIFFGetField(tiff_.get(), TIFFTAG_TILEWIDTH, &width);
    TIFFGetField(tiff_.get(), TIFFTAG_TILELENGTH, &height);
    const std::size_t sample = page_.bits / 8, tile_bytes = std::size_t(width) * height * sample;
    if (width == 0 || height == 0 || width > std::uint32_t(most_along_an_axis) ||
        height > std::uint32_t(most_along_an_axis) || std::size_t(TIFFTileSize(tiff_.get())) != tile_bytes ||
        tile_bytes > most_in_a_tile)
      refuse_image(file_, fmt::format("page {}: tiles of {} x {} pixels; expected at most {} bytes", k, width,
                                      height, most_in_a_tile));
    std::vector<std::uint8_t> tile(tile_bytes);
    std::vector<std::uint16_t> band;
    for (std::uint32_t y = 0; y < page_.height; y += height) {
      const std::uint32_t rows = std::min(height, page_.height - y);
      band.assign(std::size_t(page_.width) * rows, 0);
      for (std::uint32_t x = 0; x < page_.width; x += width) {
        if (TIFFReadTile(tiff_.get(), tile.data(), x, y, 0, 0) < 0)
          refuse_image(file_, fmt::format("page {}: the tile at row {}, column {} is damaged", k, y, x));
        const std::uint32_t columns = std::min(width, page_.width - x);
        std::vector<std::uint16_t> part;
        for (std::uint32_t row = 0; row < rows; ++row) {
          part.clear();
          append(part, tile.data() + std::size_t(row) * width * sample, columns, page_.bits);
          std::ranges::copy(part, band.begin() + std::ptrdiff_t(std::size_t(row) * page_.width + x));
        }
      }
      labels.insert(labels.end(), band.begin(), band.end());
    }
  }

  static constexpr std::size_t most_in_a_tile = 1 << 26;

  fs::path file_;
  std::unique_ptr<TIFF, CloseTiff> tiff_;
  Page page_;
  std::vector<std::uint64_t> offsets_;
};

}  // namespace

std::unique_ptr<SliceReader> open_tiff(const fs::path& file) {
  auto pages = std::make_unique<TiffSlices>(file);
  if (const std::optional<VoxelData> stack = pages->imagej_stack()) return open_voxel_data(*stack);
  return pages;
}

}  // namespace anticrack
