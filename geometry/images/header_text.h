#pragma once

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "vec3.h"

namespace anticrack {

/// The lines of a text header, with what every such format needs to take them apart. Errors name file and
/// line.
class HeaderText {
 public:
  /// @throws FileError  if there is no such file
  explicit HeaderText(const std::filesystem::path& file);

  /// The next line without its end, or false at the end of the file.
  /// @throws FileError  a line of more than 64 kB: no text
  bool next(std::string& line);

  std::uint64_t position();  ///< behind the last line [bytes]

  [[noreturn]] void refuse(std::string_view reason) const;
  /// A whole number from `low` to `high`.
  std::int64_t integer(std::string_view name, std::string_view text, std::int64_t low,
                       std::int64_t high) const;
  /// Three numbers of voxels, separated by blanks.
  Index3 size(std::string_view name, std::string_view text) const;

  const std::filesystem::path& file() const { return file_; }

 private:
  std::filesystem::path file_;
  std::ifstream stream_;
  int line_ = 0;
};

/// A whole number from `low` to `high`, or nothing.
std::optional<std::int64_t> whole_number(std::string_view text, std::int64_t low, std::int64_t high);

std::string_view trimmed(std::string_view text);
std::vector<std::string> words_of(std::string_view text);
std::string lower_case(std::string_view text);

}  // namespace anticrack
