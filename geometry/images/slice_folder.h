#pragma once

#include <filesystem>
#include <memory>
#include <string_view>

#include "images/slice_reader.h"

namespace anticrack {

/// Whether `a` comes before `b` in natural order: runs of digits by their number (slice2 before slice10).
bool comes_before(std::string_view a, std::string_view b);

/// A folder of TIFF or PNG slices, one a file, in natural order of the names; other files are an error,
/// hidden ones are not looked at. See open_image.
/// @throws FileError  no slices; slices of different sizes (names both); an unreadable one
std::unique_ptr<SliceReader> open_slice_folder(const std::filesystem::path& folder);

}  // namespace anticrack
