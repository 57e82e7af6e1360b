#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace anticrack {

using Rgb8 = std::array<std::uint8_t, 3>;  ///< sRGB

/// sRGB picture, rows from the top.
struct Image {
  int width = 0;
  int height = 0;
  std::vector<Rgb8> pixels;  ///< width * height

  Image() = default;
  Image(int width, int height, Rgb8 fill = {255, 255, 255})
      : width(width), height(height), pixels(std::size_t(width) * std::size_t(height), fill) {}
  Rgb8& at(int column, int row) {
    return pixels[std::size_t(row) * std::size_t(width) + std::size_t(column)];
  }
  const Rgb8& at(int column, int row) const {
    return pixels[std::size_t(row) * std::size_t(width) + std::size_t(column)];
  }
};

using TextChunks =
    std::vector<std::pair<std::string, std::string>>;  ///< keyword (Latin, < 80 bytes), UTF-8 text

/// PNG bytes with an sRGB chunk and the given text chunks; no date, so that equal pictures are equal files.
/// @throws InputError  if the image is empty
std::string encode_png(const Image& image, const TextChunks& text = {});

/// sRGB transfer function of IEC 61966-2-1: linear light in [0, 1] (clipped) to a byte, and back.
std::uint8_t encode_srgb(float linear);
float decode_srgb(std::uint8_t byte);

}  // namespace anticrack
