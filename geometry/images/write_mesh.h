#pragma once

#include <filesystem>

#include "level_sets/surface_mesh.h"

namespace anticrack {

/// Whether write_mesh knows the ending of the name: .stl, .ply.
bool is_mesh_name(const std::filesystem::path& file);

/// Writes triangles in metres, binary, little-endian: .stl (three points a triangle and its normal) or .ply
/// (points once, triangles by their numbers). @throws InputError  unknown ending. @throws FileError
void write_mesh(const SurfaceMesh& mesh, const std::filesystem::path& file);

}  // namespace anticrack
