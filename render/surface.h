#pragma once

#include "mesh.h"
#include "solid_field.h"

namespace anticrack {

/// Surface of the solid at the field's surface fraction, by surface nets (Gibson 1998): one vertex in each
/// lattice cell that the surface crosses, at the mean of the crossings on its edges. Normals from the
/// gradient of the fraction. The same mesh, in the same order, for any number of threads.
Mesh extract_surface(const SolidField& field);

/// Cheap stand-in for ray-traced occlusion, for previews: how much solid lies in front of each vertex, looked
/// up in the field at a few distances along the normal. 1 is open, 0 is buried.
std::vector<float> estimate_openness(const Mesh& mesh, const SolidField& field);

}  // namespace anticrack
