#include "image.h"

#include <png.h>

#include <algorithm>
#include <cmath>

#include "errors.h"

namespace anticrack {

namespace {

void append_bytes(png_structp png, png_bytep data, std::size_t length) {
  static_cast<std::string*>(png_get_io_ptr(png))->append(reinterpret_cast<const char*>(data), length);
}

void flush_nothing(png_structp) {}

[[noreturn]] void raise_error(png_structp, png_const_charp message) {
  throw InputError(std::string("PNG encoder: ") + message);
}

void ignore_warning(png_structp, png_const_charp) {}

}  // namespace

std::string encode_png(const Image& image, const TextChunks& text) {
  if (image.width < 1 || image.height < 1) throw InputError("image is empty; expected at least one pixel");
  std::string bytes;
  png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, raise_error, ignore_warning);
  png_infop info = png_create_info_struct(png);
  try {
    png_set_write_fn(png, &bytes, append_bytes, flush_nothing);
    png_set_IHDR(png, info, png_uint_32(image.width), png_uint_32(image.height), 8, PNG_COLOR_TYPE_RGB,
                 PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
    png_set_sRGB_gAMA_and_cHRM(png, info, PNG_sRGB_INTENT_PERCEPTUAL);
    png_set_compression_level(png, 6);

    std::vector<png_text> chunks;
    for (const auto& [keyword, content] : text) {
      png_text chunk{};
      chunk.compression = PNG_ITXT_COMPRESSION_NONE;
      chunk.key = const_cast<png_charp>(keyword.c_str());
      chunk.text = const_cast<png_charp>(content.c_str());
      chunk.itxt_length = content.size();
      chunks.push_back(chunk);
    }
    png_set_text(png, info, chunks.data(), int(chunks.size()));

    png_write_info(png, info);
    for (int row = 0; row < image.height; ++row) {
      png_write_row(png, image.pixels[std::size_t(row) * std::size_t(image.width)].data());
    }
    png_write_end(png, info);
  } catch (...) {
    png_destroy_write_struct(&png, &info);
    throw;
  }
  png_destroy_write_struct(&png, &info);
  return bytes;
}

std::uint8_t encode_srgb(float linear) {
  const float c = std::clamp(linear, 0.0f, 1.0f);
  const float s = c <= 0.0031308f ? 12.92f * c : 1.055f * std::pow(c, 1 / 2.4f) - 0.055f;
  return std::uint8_t(std::lround(255 * s));
}

float decode_srgb(std::uint8_t byte) {
  const float s = float(byte) / 255;
  return s <= 0.04045f ? s / 12.92f : std::pow((s + 0.055f) / 1.055f, 2.4f);
}

}  // namespace anticrack
