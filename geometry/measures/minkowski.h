#pragma once

#include <array>
#include <cstdint>

#include "measures/clusters.h"
#include "measures/phase_image.h"

namespace anticrack {

/// What lies outside the sample.
enum class BoxBoundary {
  open,    ///< unknown: only neighbourhoods inside count. Densities are unbiased for a stationary structure.
  closed,  ///< pore: the measures are those of the solid as a body, faces of the box included
};

/// How often each pattern of 2 x 2 x 2 voxels occurs; bit x + 2 y + 4 z of a pattern is solid (Ohser and
/// Muecklich 2000). All measures below are sums over it.
struct NeighbourhoodCounts {
  std::array<std::uint64_t, 256> counts{};
  std::uint64_t neighbourhoods = 0;
  double voxel_size = 0;  ///< h [m]

  double volume()
      const;  ///< [m^3] that the neighbourhoods represent, one voxel each: what densities refer to
  double solid_volume() const;  ///< [m^3] of solid therein
};

/// Same counts on any number of threads. @throws InputError if an open box has an axis of one voxel
NeighbourhoodCounts count_neighbourhoods(const PhaseImage& image, BoxBoundary boundary);

/// Eight times the Euler number of the solid: vertices - edges + faces - cells of its cell complex;
/// 6-connected: voxel centres and what lies between them; 26-connected: closed voxels (Serra 1982). The pore
/// has the number of the other connectivity. Divisible by 8 in a closed box.
std::int64_t eightfold_euler_number(const NeighbourhoodCounts& counts, Connectivity connectivity);

/// Euler number per volume [1/m^3].
double euler_density(const NeighbourhoodCounts& counts, Connectivity connectivity);

/// Directions of the test lines: axes, or also the diagonals of faces and of the cell.
enum class CroftonDirections { three = 3, thirteen = 13 };

/// Surface area [m^2] by Crofton's formula, S = 2 sum_d w_d N_d h^2 / |d|: N_d changes of phase along the
/// lattice lines of direction d; w_d its share of the sphere (Voronoi cells; Lang, Ohser and Hilfer 2001).
/// Unbiased where all directions of the surface occur alike and it is smooth; of one plane, three directions
/// see 0.667 to 1.155 of the area, thirteen 0.927 to 1.023.
double surface_area(const NeighbourhoodCounts& counts, CroftonDirections directions);

/// Integral of mean curvature [m], of (k1 + k2) / 2 over the surface: 4 pi R for a ball. 2 pi times the mean
/// breadth, from Euler numbers of plane sections in 13 directions (Ohser and Muecklich 2000; mean of the two
/// connectivities where squares are ambiguous, so that the pore has the opposite value).
double integral_of_mean_curvature(const NeighbourhoodCounts& counts);

/// Specific surface area [1/m]: surface over volume of the solid, Crofton with 13 directions.
/// @throws InputError  if there is no solid
double specific_surface_area(const NeighbourhoodCounts& counts);

}  // namespace anticrack
