#pragma once

#include <cstdint>

#include "level_sets/surface_mesh.h"
#include "vec3.h"

namespace anticrack {

/// A box in the sample's space [m].
struct Window {
  Vec3 lower, upper;
};

/// What a surface has inside a window. The part of a triangle, edge or point inside counts, so no rim and no
/// cap adds to it: the sum over the window's volume estimates a density without bias by edges.
struct SurfaceMeasures {
  double area;                ///< [m^2]
  double mean_curvature;      ///< integral of (kappa_1 + kappa_2)/2, half of length x turn over the edges [m]
  double gaussian_curvature;  ///< integral of kappa_1 kappa_2, angles missing to 2 pi at the points [-]

  /// Euler number of the solid by Gauss and Bonnet; an integer for a closed surface, else a window's share.
  double euler() const;
};

/// The whole mesh.
SurfaceMeasures measure_surface(const SurfaceMesh& mesh);

/// The part inside the window. For a capped sample take the sample box less two voxels on each side: the mesh
/// of a level set rounds the rims of the caps, so that leaving out triangles on the faces would not do.
/// @throws InputError  if the window is empty
SurfaceMeasures measure_surface(const SurfaceMesh& mesh, const Window& window);

/// Box of `size` [m] less `margin` [m] on each side. @throws InputError  if nothing is left
Window inner_window(const Vec3& size, double margin);

/// Volume inside a closed mesh [m^3], by Gauss's theorem.
double enclosed_volume(const SurfaceMesh& mesh);

/// Points - edges + triangles of a mesh: twice the Euler number of the solid that it bounds. Points that no
/// triangle uses do not count.
std::int64_t euler_number(const SurfaceMesh& mesh);

}  // namespace anticrack
