#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <string_view>

#include "images/header_text.h"
#include "images/raw_slices.h"

namespace anticrack {

namespace {

// What follows the key of a Python dictionary; nothing if it is not there.
std::string_view value_of(std::string_view dictionary, std::string_view key) {
  std::size_t at = dictionary.find(fmt::format("'{}'", key));
  if (at == std::string_view::npos) at = dictionary.find(fmt::format("\"{}\"", key));
  if (at == std::string_view::npos) return {};
  const std::string_view rest = trimmed(dictionary.substr(at + key.size() + 2));
  return rest.starts_with(':') ? trimmed(rest.substr(1)) : std::string_view();
}

// The inside of quotes or brackets at the start of `text`; nothing if there are none.
std::string_view quoted(std::string_view text) {
  if (text.empty() || std::string_view("'\"(").find(text[0]) == std::string_view::npos) return {};
  const std::size_t end = text.find(text[0] == '(' ? ')' : text[0], 1);
  return end == std::string_view::npos ? std::string_view() : text.substr(1, end - 1);
}

}  // namespace

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
  const std::string_view type = quoted(value_of(header, "descr"));  // "<u2": order, kind, bytes
  if (type.size() != 3 || std::string_view("bui").find(type[1]) == std::string_view::npos ||
      std::string_view("1248").find(type[2]) == std::string_view::npos)
    refuse_image(file,
                 fmt::format("values of type \"{}\"; expected bool or an integer type such as |u1", type));
  data.big_endian = type[0] == '>';
  data.is_signed = type[1] == 'i';
  data.bytes = type[2] - '0';
  const std::string_view fortran = value_of(header, "fortran_order");
  if (!fortran.starts_with("True") && !fortran.starts_with("False"))
    refuse_image(file, "fortran_order is neither True nor False");
  data.z_fastest = fortran.starts_with("True");
  const std::string_view shape = quoted(value_of(header, "shape"));
  std::string numbers(shape);
  std::ranges::replace(numbers, ',', ' ');
  const std::vector<std::string> axes = words_of(numbers);
  if (axes.size() != 3) refuse_image(file, fmt::format("shape ({}); expected three axes z, y, x", shape));
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto voxels = whole_number(axes[axis], 1, most_along_an_axis);
    if (!voxels)
      refuse_image(file,
                   fmt::format("shape ({}); expected 1 to {} along each axis", shape, most_along_an_axis));
    data.size[2 - axis] = int(*voxels);
  }
  return data;
}

}  // namespace anticrack
