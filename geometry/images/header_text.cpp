#include "images/header_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <charconv>

#include "images/slice_reader.h"

namespace anticrack {

HeaderText::HeaderText(const std::filesystem::path& file) : file_(file), stream_(file, std::ios::binary) {
  if (!stream_) refuse_image(file, "cannot be opened");
}

bool HeaderText::next(std::string& line) {
  constexpr std::size_t longest = 1 << 16;
  line.clear();
  ++line_;
  for (int c; (c = stream_.get()) != std::ifstream::traits_type::eof();) {
    if (c == '\n') {
      if (line.ends_with('\r')) line.pop_back();
      return true;
    }
    if (line.size() == longest)
      refuse(fmt::format("more than {} characters; expected a text header", longest));
    line += char(c);
  }
  stream_.clear();
  return !line.empty();
}

std::uint64_t HeaderText::position() {
  return std::uint64_t(stream_.tellg());
}

void HeaderText::refuse(std::string_view reason) const {
  refuse_image(fmt::format("{}:{}", file_.string(), line_), reason);
}

std::int64_t HeaderText::integer(std::string_view name, std::string_view text, std::int64_t low,
                                 std::int64_t high) const {
  const std::optional<std::int64_t> value = whole_number(text, low, high);
  if (!value) refuse(fmt::format("{} = {}; expected a whole number from {} to {}", name, text, low, high));
  return *value;
}

Index3 HeaderText::size(std::string_view name, std::string_view text) const {
  const std::vector<std::string> words = words_of(text);
  if (words.size() != 3) refuse(fmt::format("{} = {}; expected three numbers of voxels", name, text));
  Index3 size;
  for (std::size_t axis = 0; axis < 3; ++axis)
    size[axis] = int(integer(name, words[axis], 1, most_along_an_axis));
  return size;
}

std::optional<std::int64_t> whole_number(std::string_view text, std::int64_t low, std::int64_t high) {
  std::int64_t value = 0;
  const auto read = std::from_chars(text.data(), text.data() + text.size(), value);
  if (read.ec != std::errc() || read.ptr != text.data() + text.size() || value < low || value > high)
    return {};
  return value;
}

std::string_view trimmed(std::string_view text) {
  const auto is_blank = [](char c) { return c == ' ' || c == '\t' || c == '\r'; };
  while (!text.empty() && is_blank(text.front())) text.remove_prefix(1);
  while (!text.empty() && is_blank(text.back())) text.remove_suffix(1);
  return text;
}

std::vector<std::string> words_of(std::string_view text) {
  std::vector<std::string> words;
  for (text = trimmed(text); !text.empty(); text = trimmed(text)) {
    const std::size_t end = std::min(text.find_first_of(" \t"), text.size());
    words.emplace_back(text.substr(0, end));
    text.remove_prefix(end);
  }
  return words;
}

std::string lower_case(std::string_view text) {
  std::string lower(text);
  std::ranges::transform(lower, lower.begin(), [](unsigned char c) { return char(std::tolower(c)); });
  return lower;
}

}  // namespace anticrack
