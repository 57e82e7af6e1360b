#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "vec3.h"

namespace anticrack {

/// Columns and rows of a grey PNG without alpha; depths below 8 bit keep their values. @throws FileError
Index3 read_png_size(const std::filesystem::path& file);

/// Its values, row by row. @throws FileError
void read_png(const std::filesystem::path& file, std::vector<std::uint16_t>& labels);

}  // namespace anticrack
