#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <regex>

#include "images/header_text.h"
#include "images/raw_slices.h"

namespace anticrack {

// NumPy format 1 to 3: magic, version, length of the header, the header as a Python dictionary.
VoxelData read_npy_header(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  unsigned char head[12] = {};
  stream.read(reinterpret_cast<char*>(head), 10);
  if (!stream || std::string_view(reinterpret_cast<char*>(head), 6) != "\x93NUMPY")
    refuse_image(file, "not a NumPy file");
  const int version = head[6];
  if (version < 1 || version > 3)
    refuse_image(file, fmt::format("NumPy format {}; expected 1, 2 or 3", version));
  if (version > 1 && !stream.read(reinterpret_cast<char*>(head) + 10, 2))
    refuse_image(file, "cut off in the header");
  const std::uint32_t length = version == 1
                                   ? head[8] | head[9] << 8
                                   : head[8] | head[9] << 8 | head[10] << 16 | std::uint32_t(head[11]) << 24;
  constexpr std::uint32_t longest = 1 << 16;
  if (length > longest)
    refuse_image(file, fmt::format("a header of {} bytes; expected at most {}", length, longest));
  const std::uint64_t begin = version == 1 ? 10 : 12;
  if (begin + length > std::filesystem::file_size(file)) refuse_image(file, "cut off in the header");
  std::string header(length, ' ');
  if (!stream.read(header.data(), std::streamsize(length))) refuse_image(file, "cut off in the header");

  VoxelData data;
  data.file = file;
  data.offset = begin + length;
  const auto value_of = [&](const char* key, const char* pattern) {
    std::smatch match;
    if (!std::regex_search(header, match,
                           std::regex(fmt::format("['\"]{}['\"]\\s{{0,9}}:\\s{{0,9}}{}", key, pattern))))
      refuse_image(file, fmt::format("no {} in the header, or not as expected", key));
    return match;
  };
  const std::smatch type = value_of("descr", "['\"]([<>|=])([buif?])(\\d{1,2})['\"]");
  const std::string kind = type[2];
  data.bytes = std::stoi(type[3]);
  if ((kind != "b" && kind != "u" && kind != "i") ||
      (data.bytes != 1 && data.bytes != 2 && data.bytes != 4 && data.bytes != 8))
    refuse_image(file,
                 fmt::format("values of type {}{}; expected bool or an integer type", kind, data.bytes));
  data.is_signed = kind == "i";
  data.big_endian = type[1] == ">";
  const bool fortran = value_of("fortran_order", "(True|False)")[1] == "True";
  const std::smatch shape = value_of("shape", "\\(([^)]{0,80})\\)");
  std::string numbers = shape[1];
  std::ranges::replace(numbers, ',', ' ');
  const std::vector<std::string> axes = words_of(numbers);
  if (axes.size() != 3)
    refuse_image(file, fmt::format("shape ({}); expected three axes z, y, x", shape[1].str()));
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto voxels = whole_number(axes[axis], 1, most_along_an_axis);
    if (!voxels)
      refuse_image(file, fmt::format("shape ({}); expected 1 to {} along each axis", shape[1].str(),
                                     most_along_an_axis));
    data.size[2 - axis] = int(*voxels);
  }
  data.z_fastest = fortran;
  return data;
}

}  // namespace anticrack
