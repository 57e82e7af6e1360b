#include "io/frame_file_name.h"

#include <algorithm>
#include <charconv>

#include "errors.h"
#include "files/atomic_file.h"
#include "io/frame.h"

namespace anticrack {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view prefix = "frame_";

std::optional<int> frame_index(const fs::path& file, std::string_view extension) {
  const std::string name = file.filename().string();
  if (!name.starts_with(prefix) || !name.ends_with(extension)) return std::nullopt;
  if (name.size() < prefix.size() + 4 + extension.size()) return std::nullopt;
  int index = 0;
  const char* const end = name.data() + name.size() - extension.size();
  const auto [stop, failed] = std::from_chars(name.data() + prefix.size(), end, index);
  return failed == std::errc{} && stop == end && index >= 0 ? std::optional(index) : std::nullopt;
}

}  // namespace

std::string frame_file_stem(int index) {
  if (index < 0) throw InputError("frame index " + std::to_string(index) + "; expected >= 0");
  const std::string digits = std::to_string(index);
  return std::string(prefix) + std::string(digits.size() < 4 ? 4 - digits.size() : 0, '0') + digits;
}

std::vector<std::pair<int, fs::path>> find_frame_files(const fs::path& folder, std::string_view extension) {
  std::vector<std::pair<int, fs::path>> files;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    if (const auto index = frame_index(entry.path(), extension)) files.emplace_back(*index, entry.path());
  }
  if (error) throw system_file_error(folder, "cannot be listed", error.value());
  std::ranges::sort(files);
  return files;
}

std::vector<fs::path> list_frames(const fs::path& folder) {
  std::vector<fs::path> files;
  for (auto& [index, file] : find_frame_files(folder, ".vdb")) files.push_back(std::move(file));
  if (files.empty()) throw FileError(folder.string() + ": no frames (frame_NNNN.vdb) in it");
  return files;
}

}  // namespace anticrack
