#pragma once

#include <optional>
#include <span>

#include "level_sets/cut_solid.h"

namespace anticrack {

enum class Accuracy {
  usual,  ///< ends after a step below 0.15 voxel
  fine    ///< below 0.03, and goes on with the septic interpolants where these are needed
};

/// The point that is closest to x of a sheet, or of the curve in which two sheets cross, within the sample
/// box, sought near `start`: Newton's method on the conditions of the constrained minimum, coordinates that
/// reach a face of the box being held there while it binds. The sheets are the cubic interpolants', the last
/// correction along the normals the quintic ones'. Creases of `Accuracy::fine`, and sheets whose place or
/// curvature the cubic ones know badly, are the septic ones'.
/// @param sheets  one, or two of different fields
/// @param x       index space, anywhere
/// @param start   index space, within the box, near the surface
/// @return        nothing if the iteration does not settle
std::optional<Vec3> find_closest_point(std::span<const Sheet> sheets, const Vec3& x, const Vec3& start,
                                       Accuracy accuracy);

}  // namespace anticrack
