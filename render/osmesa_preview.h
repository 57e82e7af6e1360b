#pragma once

#include <optional>

#include "camera.h"
#include "color_map.h"
#include "cut_section.h"
#include "image.h"
#include "mesh.h"
#include "quick_light.h"

namespace anticrack {

/// Fast picture of the same scene as EmbreeScene's, rasterized by OSMesa: same camera and colours, light
/// from `QuickLight` in place of traced rays. Four samples a pixel.
/// @param light  one a vertex
/// @throws FileError, InputError  as `make_osmesa_context`
Image preview_surface(const Mesh& mesh, const PointLight& light, const Camera& camera,
                      const ColorScale& scale, const std::optional<CutSection>& cut = {});

/// Spheres as point impostors, one sample a pixel; those with a centre beyond the cut are left out.
/// @param light  one a sphere
Image preview_spheres(const SphereCloud& spheres, const PointLight& light, const Camera& camera,
                      const ColorScale& scale, const std::optional<CutPlane>& cut = {});

}  // namespace anticrack
