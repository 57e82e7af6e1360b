#pragma once

#include <png.h>

#include <stdexcept>
#include <string>

#include "image.h"

namespace anticrack {

/// The pixels of a PNG, read by libpng's own simple interface.
inline Image decode_png(const std::string& bytes) {
  png_image png{};
  png.version = PNG_IMAGE_VERSION;
  if (png_image_begin_read_from_memory(&png, bytes.data(), bytes.size()) == 0)
    throw std::runtime_error(png.message);
  png.format = PNG_FORMAT_RGB;
  Image image(int(png.width), int(png.height));
  if (png_image_finish_read(&png, nullptr, image.pixels.data(), 0, nullptr) == 0)
    throw std::runtime_error(png.message);
  return image;
}

}  // namespace anticrack
