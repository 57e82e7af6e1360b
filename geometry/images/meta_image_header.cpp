#include <fmt/format.h>

#include <map>
#include <optional>
#include <tuple>
#include <utility>

#include "images/header_text.h"
#include "images/raw_slices.h"

namespace anticrack {
namespace {

namespace fs = std::filesystem;

// Integer types of MetaIO: bytes, signed. A long has 4 bytes there.
const std::map<std::string, std::pair<int, bool>> types = {
    {"MET_CHAR", {1, true}},       {"MET_UCHAR", {1, false}}, {"MET_SHORT", {2, true}},
    {"MET_USHORT", {2, false}},    {"MET_INT", {4, true}},    {"MET_UINT", {4, false}},
    {"MET_LONG", {4, true}},       {"MET_ULONG", {4, false}}, {"MET_LONG_LONG", {8, true}},
    {"MET_ULONG_LONG", {8, false}}};

}  // namespace

VoxelData read_meta_image_header(const fs::path& file) {
  HeaderText text(file);
  VoxelData data;
  data.bytes = 0;
  std::optional<Index3> size;
  const auto is_true = [](std::string_view value) { return lower_case(value) == "true" || value == "1"; };
  std::int64_t skip = 0;
  std::string line, data_file;
  // ElementDataFile is the last field; the voxels of LOCAL data follow it.
  while (data_file.empty() && text.next(line)) {
    const std::size_t equals = line.find('=');
    if (equals == std::string::npos) text.refuse("expected \"Field = value\" of a MetaImage header");
    const std::string name(trimmed(std::string_view(line).substr(0, equals)));
    const std::string value(trimmed(std::string_view(line).substr(equals + 1)));
    if (name == "ObjectType" && value != "Image")
      text.refuse(fmt::format("ObjectType = {}; expected Image", value));
    if (name == "NDims" && value != "3") text.refuse(fmt::format("NDims = {}; expected 3", value));
    if (name == "DimSize") size = text.size(name, value);
    if (name == "ElementType") {
      if (!types.contains(value))
        text.refuse(fmt::format("ElementType = {}; expected an integer type such as MET_UCHAR", value));
      std::tie(data.bytes, data.is_signed) = types.at(value);
    }
    if (name == "ElementNumberOfChannels" && value != "1")
      text.refuse(fmt::format("ElementNumberOfChannels = {}; expected 1", value));
    if (name == "BinaryData" && !is_true(value)) text.refuse("BinaryData = False; expected True");
    if (name == "BinaryDataByteOrderMSB" || name == "ElementByteOrderMSB") data.big_endian = is_true(value);
    if (name == "CompressedData") data.compressed = is_true(value);
    if (name == "HeaderSize") skip = text.integer(name, value, -1, std::int64_t(1) << 40);
    if (name == "ElementDataFile") data_file = value;
  }
  if (!size) text.refuse("no DimSize in the header");
  if (data.bytes == 0) text.refuse("no ElementType in the header");
  if (data_file.empty()) text.refuse("no ElementDataFile in the header");
  if (data_file == "LIST" || words_of(data_file).size() > 1 || data_file.find('%') != std::string::npos)
    text.refuse(fmt::format("ElementDataFile = {}; expected LOCAL or the name of one file", data_file));
  if (data.compressed && skip != 0) text.refuse("HeaderSize of compressed data; expected none");

  data.size = *size;
  const bool local = data_file == "LOCAL" || data_file == "Local" || data_file == "local";
  data.file = local ? file : file.parent_path() / data_file;
  data.offset = local ? text.position() : skip > 0 ? std::uint64_t(skip) : 0;
  data.offset_from_end = skip == -1;
  if (!fs::is_regular_file(data.file))
    refuse_image(data.file, fmt::format("no such file; {} names it", file.string()));
  return data;
}

}  // namespace anticrack
