#pragma once

#include <optional>
#include <span>

#include "level_sets/cut_solid.h"

namespace anticrack {

/// The point that is closest to x of a sheet, or of the curve in which two sheets cross, within the sample
/// box, sought near `start`: Newton's method on the conditions of the constrained minimum, coordinates that
/// reach a face of the box being held there while it binds. The sheets are the cubic interpolants', the last
/// correction along the normals the quintic ones'.
/// @param sheets  one, or two of different fields
/// @param x       index space, anywhere
/// @param start   index space, within the box, near the surface
/// @param settled the step after which the iteration ends [voxels], at most 0.15
/// @return        nothing if the iteration does not settle
std::optional<Vec3> find_closest_point(std::span<const Sheet> sheets, const Vec3& x, const Vec3& start,
                                       double settled);

}  // namespace anticrack
