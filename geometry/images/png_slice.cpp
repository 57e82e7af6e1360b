#include "images/png_slice.h"

#include <fmt/format.h>
#include <png.h>

#include <cstdio>
#include <memory>
#include <string>

#include "images/slice_reader.h"

namespace anticrack {
namespace {

namespace fs = std::filesystem;

struct CloseFile {
  void operator()(std::FILE* file) const { std::fclose(file); }
};

// Debian's libpng is compiled so that exceptions pass through it.
[[noreturn]] void raise_error(png_structp png, png_const_charp message) {
  refuse_image(*static_cast<const fs::path*>(png_get_error_ptr(png)), message);
}

void ignore_warning(png_structp, png_const_charp) {}

class PngFile {
 public:
  explicit PngFile(const fs::path& file) : path_(file), file_(std::fopen(file.c_str(), "rb")) {
    if (!file_) refuse_image(file, "cannot be opened");
    png_ = png_create_read_struct(PNG_LIBPNG_VER_STRING, &path_, raise_error, ignore_warning);
    info_ = png_create_info_struct(png_);
    try {
      read_header();
    } catch (...) {
      png_destroy_read_struct(&png_, &info_, nullptr);
      throw;
    }
  }
  ~PngFile() { png_destroy_read_struct(&png_, &info_, nullptr); }
  PngFile(const PngFile&) = delete;

  Index3 size() const { return {int(width_), int(height_), 1}; }

  void read(std::vector<std::uint16_t>& labels) {
    labels.clear();
    if (png_get_interlace_type(png_, info_) != PNG_INTERLACE_NONE)
      refuse_image(path_, "interlaced; expected plain rows");
    std::vector<std::uint8_t> row(png_get_rowbytes(png_, info_));
    for (std::uint32_t y = 0; y < height_; ++y) {
      png_read_row(png_, row.data(), nullptr);
      for (std::uint32_t x = 0; x < width_; ++x)
        labels.push_back(bits_ == 16 ? std::uint16_t(row[2 * x] << 8 | row[2 * x + 1]) : row[x]);
    }
    png_read_end(png_, nullptr);
  }

 private:
  void read_header() {
    png_init_io(png_, file_.get());
    png_read_info(png_, info_);
    width_ = png_get_image_width(png_, info_);
    height_ = png_get_image_height(png_, info_);
    bits_ = png_get_bit_depth(png_, info_);
    if (png_get_color_type(png_, info_) != PNG_COLOR_TYPE_GRAY)
      refuse_image(path_, "expected a grey PNG without alpha or palette");
    constexpr auto most = std::uint32_t(most_along_an_axis);
    if (width_ > most || height_ > most)
      refuse_image(path_, fmt::format("{} x {} pixels; expected 1 to {}", width_, height_, most));
    png_set_packing(png_);  // 1, 2, 4 bits become a byte of the same value
    png_read_update_info(png_, info_);
  }

  fs::path path_;
  std::unique_ptr<std::FILE, CloseFile> file_;
  png_structp png_ = nullptr;
  png_infop info_ = nullptr;
  std::uint32_t width_ = 0, height_ = 0;
  int bits_ = 0;
};

}  // namespace

Index3 read_png_size(const fs::path& file) {
  return PngFile(file).size();
}

void read_png(const fs::path& file, std::vector<std::uint16_t>& labels) {
  PngFile(file).read(labels);
}

}  // namespace anticrack
