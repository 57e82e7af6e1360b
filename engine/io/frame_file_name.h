#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace anticrack {

/// frame_0007 for index 7; at least four digits. @throws InputError  if index < 0
std::string frame_file_stem(int index);

/// All files frame_NNNN`extension` of `folder` with their indices, in order of index. @throws FileError
std::vector<std::pair<int, std::filesystem::path>> find_frame_files(const std::filesystem::path& folder,
                                                                    std::string_view extension);

}  // namespace anticrack
