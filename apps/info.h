#pragma once

#include <filesystem>
#include <string>

namespace CLI {
class App;
}

namespace anticrack {

/// `anticrack info FILE_or_DIR`: what is in it.
CLI::App* add_info_command(CLI::App& app);

/// A page about a .vdb file, a scene or a run folder.
/// @throws InputError  it is something else, or a scene that is refused. @throws FileError
std::string describe(const std::filesystem::path& path);

/// The grids of an OpenVDB file with type, extent, voxels and metadata; the voxels themselves are not read.
/// @throws FileError
std::string describe_vdb(const std::filesystem::path& file);

}  // namespace anticrack
