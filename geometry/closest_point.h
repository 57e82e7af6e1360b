#pragma once

#include <optional>

#include "padded_field.h"

namespace anticrack {

/// The point of {field = 0} within the sample box that is closest to x, sought near `start`: Newton's method
/// on the conditions of the constrained minimum, coordinates that reach a face of the box being held there
/// while it binds. The surface is the cubic interpolant's, the last correction along the normal the quintic
/// one's.
/// @param x      index space, anywhere
/// @param start  index space, within the box, near the surface
/// @return       nothing if the iteration does not settle
std::optional<Vec3> find_closest_point(const PaddedField& field, const Vec3& x, const Vec3& start);

}  // namespace anticrack
