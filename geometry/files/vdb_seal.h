#pragma once

#include <filesystem>

namespace anticrack {

/// Replaces the random UUID in the head of an OpenVDB file by a constant that ends in the CRC-32 of all the
/// rest, so that the same content has the same bytes and a reader can tell damage before it parses. @throws
/// FileError
void seal_vdb(const std::filesystem::path& file);

/// Whether `file` is sealed; files of other programs are not.
/// @throws FileError  if it is and its content has changed since
bool check_vdb_seal(const std::filesystem::path& file);

}  // namespace anticrack
