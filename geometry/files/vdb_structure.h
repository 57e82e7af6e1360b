#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

namespace anticrack {

/// Walks the head of an OpenVDB file (metadata, list of grids, their metadata and transforms) and refuses
/// sizes that the file does not hold: OpenVDB allocates what a length says before it reads, and goes on with
/// rubbish when there is less. Tree and voxels are not looked at.
/// @return  where the type names of metadata for delayed loading begin, whose reader in OpenVDB trusts them
/// @throws FileError
std::vector<std::uint64_t> check_vdb_structure(const std::filesystem::path& file);

}  // namespace anticrack
