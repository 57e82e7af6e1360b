#pragma once

#include <filesystem>
#include <memory>

#include "images/slice_reader.h"

namespace anticrack {

/// The pages of a TIFF file as slices; see open_image. Checks at once that all that the directories name lies
/// within the file.
std::unique_ptr<SliceReader> open_tiff(const std::filesystem::path& file);

}  // namespace anticrack
