#pragma once

#include "mesh.h"
#include "solid_field.h"

namespace anticrack {

/// Surface of the solid at the field's surface fraction, by surface nets (Gibson 1998): one vertex in each
/// lattice cell that the surface crosses, at the mean of the crossings on its edges. Normals from the
/// gradient of the fraction. The same mesh, in the same order, for any number of threads.
Mesh extract_surface(const SolidField& field);

}  // namespace anticrack
