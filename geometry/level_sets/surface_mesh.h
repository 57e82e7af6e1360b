#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "vec3.h"

namespace anticrack {

struct Microstructure;

/// Triangles of a closed surface.
struct SurfaceMesh {
  std::vector<Eigen::Vector3f> points;                  ///< [m], in the sample box
  std::vector<std::array<std::uint32_t, 3>> triangles;  ///< counter-clockwise seen from the pores
};

/// The surface {distance = 0} of a level set, by OpenVDB's dual contouring without adaptivity: one point a
/// voxel that the surface crosses. Closed at the faces of the sample box.
SurfaceMesh mesh_surface(const Microstructure& structure);

}  // namespace anticrack
