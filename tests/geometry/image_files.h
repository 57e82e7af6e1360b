#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "vec3.h"

namespace anticrack {

/// Labels of an image in memory, x fastest.
struct Labels {
  Index3 size;
  std::vector<std::uint16_t> values;
};

/// 0, step, 2 step, ...
inline Labels numbered(Index3 size, int step) {
  Labels image{size, {}};
  for (int n = 0; n < size[0] * size[1] * size[2]; ++n) image.values.push_back(std::uint16_t(n * step));
  return image;
}

/// The low bytes of a number.
inline std::string bytes_of(std::uint64_t value, int bytes, bool big_endian) {
  std::string text;
  for (int b = 0; b < bytes; ++b) text += char(value >> 8 * (big_endian ? bytes - 1 - b : b));
  return text;
}

/// The voxels as a file holds them.
inline std::string voxel_bytes(const Labels& image, int bytes, bool big_endian) {
  std::string text;
  for (const std::uint16_t value : image.values) text += bytes_of(value, bytes, big_endian);
  return text;
}

/// An uncompressed grey TIFF of one strip a page, written by hand so that nothing but the format is relied
/// on.
inline std::string tiff_bytes(const Labels& image, int bits, bool big_endian) {
  std::string file = big_endian ? "MM" : "II";
  const auto number = [&](std::uint32_t value, int bytes) { file += bytes_of(value, bytes, big_endian); };
  const auto entry = [&](int tag, int type, std::uint32_t value) {  // type 3: 16 bit, 4: 32 bit
    number(std::uint32_t(tag), 2), number(std::uint32_t(type), 2), number(1, 4),
        number(value, type == 3 ? 2 : 4);
    if (type == 3) number(0, 2);
  };
  const auto [nx, ny, nz] = image.size;
  const std::uint32_t page_bytes = std::uint32_t(nx * ny * bits / 8), entries = 9;
  const std::uint32_t directory_bytes = 2 + 12 * entries + 4;
  number(42, 2), number(8, 4);
  for (int k = 0; k < nz; ++k) {
    const auto start = std::uint32_t(file.size());
    number(entries, 2);
    entry(256, 4, std::uint32_t(nx)), entry(257, 4, std::uint32_t(ny)), entry(258, 3, std::uint32_t(bits));
    entry(259, 3, 1), entry(262, 3, 1), entry(273, 4, start + directory_bytes), entry(277, 3, 1);
    entry(278, 4, std::uint32_t(ny)), entry(279, 4, page_bytes);
    number(k + 1 < nz ? start + directory_bytes + page_bytes : 0, 4);
    for (int n = 0; n < nx * ny; ++n) number(image.values[std::size_t(k * nx * ny + n)], bits / 8);
  }
  return file;
}

/// NumPy format `version` of a type such as "<u2".
inline std::string npy_head(int version, const std::string& type, bool fortran, const std::string& shape) {
  const std::string dictionary = "{'descr': '" + type +
                                 "', 'fortran_order': " + (fortran ? "True" : "False") + ", 'shape': (" +
                                 shape + "), }\n";
  return std::string("\x93NUMPY") + char(version) + '\0' +
         bytes_of(dictionary.size(), version == 1 ? 2 : 4, false) + dictionary;
}

}  // namespace anticrack
