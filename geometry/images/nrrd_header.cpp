#include <fmt/format.h>

#include <map>
#include <utility>

#include "images/header_text.h"
#include "images/raw_slices.h"

namespace anticrack {
namespace {

namespace fs = std::filesystem;

// Integer types by the names of the NRRD definition (Kindlmann 2005): bytes, signed.
const std::map<std::string, std::pair<int, bool>> types = {{"signed char", {1, true}},
                                                           {"int8", {1, true}},
                                                           {"int8_t", {1, true}},
                                                           {"uchar", {1, false}},
                                                           {"unsigned char", {1, false}},
                                                           {"uint8", {1, false}},
                                                           {"uint8_t", {1, false}},
                                                           {"short", {2, true}},
                                                           {"short int", {2, true}},
                                                           {"signed short", {2, true}},
                                                           {"signed short int", {2, true}},
                                                           {"int16", {2, true}},
                                                           {"int16_t", {2, true}},
                                                           {"ushort", {2, false}},
                                                           {"unsigned short", {2, false}},
                                                           {"unsigned short int", {2, false}},
                                                           {"uint16", {2, false}},
                                                           {"uint16_t", {2, false}},
                                                           {"int", {4, true}},
                                                           {"signed int", {4, true}},
                                                           {"int32", {4, true}},
                                                           {"int32_t", {4, true}},
                                                           {"uint", {4, false}},
                                                           {"unsigned int", {4, false}},
                                                           {"uint32", {4, false}},
                                                           {"uint32_t", {4, false}},
                                                           {"longlong", {8, true}},
                                                           {"long long", {8, true}},
                                                           {"int64", {8, true}},
                                                           {"int64_t", {8, true}},
                                                           {"ulonglong", {8, false}},
                                                           {"unsigned long long", {8, false}},
                                                           {"uint64", {8, false}},
                                                           {"uint64_t", {8, false}}};

struct Fields {
  std::map<std::string, std::string> values;

  std::string of(const std::string& name, const std::string& otherwise = {}) const {
    const auto found = values.find(name);
    return found == values.end() ? otherwise : found->second;
  }
};

// "field: value" lines up to the empty one that ends an attached header.
Fields read_fields(HeaderText& text) {
  std::string line;
  if (!text.next(line) || !line.starts_with("NRRD000")) text.refuse("not a NRRD file");
  Fields fields;
  while (text.next(line)) {
    if (trimmed(line).empty()) break;
    if (line[0] == '#' || line.find(":=") != std::string::npos) continue;
    const std::size_t colon = line.find(": ");
    if (colon == std::string::npos) text.refuse("expected \"field: value\"");
    std::string name = lower_case(trimmed(std::string_view(line).substr(0, colon)));
    std::erase(name, ' ');
    if (name == "datafile" && fields.values.contains(name)) text.refuse("a second data file");
    fields.values[name] = trimmed(std::string_view(line).substr(colon + 2));
  }
  return fields;
}

// Behind so many lines of the file, for "line skip".
std::uint64_t behind_lines(const fs::path& file, std::uint64_t offset, std::int64_t lines) {
  std::ifstream stream(file, std::ios::binary);
  stream.seekg(std::streamoff(offset));
  while (lines > 0) {
    const int c = stream.get();
    if (c == std::ifstream::traits_type::eof())
      refuse_image(file, "\"line skip\" skips more lines than there are");
    if (c == '\n') --lines;
    ++offset;
  }
  return offset;
}

}  // namespace

VoxelData read_nrrd_header(const fs::path& file) {
  HeaderText text(file);
  const Fields fields = read_fields(text);
  VoxelData data;
  if (const std::string dimension = fields.of("dimension"); dimension != "3")
    text.refuse(fmt::format("dimension = {}; expected 3", dimension));
  const std::string type = lower_case(fields.of("type"));
  if (!types.contains(type)) text.refuse(fmt::format("type = {}; expected an integer type", type));
  std::tie(data.bytes, data.is_signed) = types.at(type);
  data.size = text.size("sizes", fields.of("sizes"));
  const std::string encoding = lower_case(fields.of("encoding"));
  if (encoding != "raw" && encoding != "gzip" && encoding != "gz")
    text.refuse(fmt::format("encoding = {}; expected raw or gzip", encoding));
  data.compressed = encoding != "raw";
  const std::string endian = lower_case(fields.of("endian"));
  if (data.bytes > 1 && endian != "big" && endian != "little")
    text.refuse(fmt::format("endian = {}; expected big or little", endian));
  data.big_endian = endian == "big";

  const std::string detached = fields.of("datafile");
  if (words_of(detached).size() > 1 || detached == "LIST" || detached.find('%') != std::string::npos)
    text.refuse(fmt::format("data file = {}; expected the name of one file", detached));
  data.file = detached.empty() ? file : file.parent_path() / detached;
  data.offset = detached.empty() ? text.position() : 0;
  if (!fs::is_regular_file(data.file))
    refuse_image(data.file, fmt::format("no such file; {} names it", file.string()));
  const std::int64_t lines = text.integer("line skip", fields.of("lineskip", "0"), 0, 1 << 20);
  data.offset = behind_lines(data.file, data.offset, lines);
  const std::int64_t skip = text.integer("byte skip", fields.of("byteskip", "0"), -1, std::int64_t(1) << 40);
  if (data.compressed && skip != 0) text.refuse("byte skip of compressed data; expected none");
  if (skip > 0) data.offset += std::uint64_t(skip);
  data.offset_from_end = skip == -1;
  return data;
}

}  // namespace anticrack
