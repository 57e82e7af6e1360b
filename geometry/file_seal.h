#pragma once

#include <filesystem>

namespace anticrack {

/// A seal is 16 bytes behind a file's content: eight letters and a 64-bit checksum of all bytes before.
/// OpenVDB and other programs that find grids by their offsets do not see it.
enum class Seal {
  absent,
  intact,
  broken,  ///< the content is not what was sealed
};

/// Appends the seal. @throws FileError
void seal_file(const std::filesystem::path& file);

/// @throws FileError  if the file cannot be read
Seal check_seal(const std::filesystem::path& file);

}  // namespace anticrack
