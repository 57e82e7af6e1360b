#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "measures/phase_image.h"

namespace anticrack {

/// Which voxels are neighbours: those that share a face, or those that share at least a corner.
enum class Connectivity { faces = 6, corners = 26 };

/// What a cluster must touch to span the sample: both faces of one axis, or all six faces of the box.
enum class SpanningRule { x, y, z, six_faces };

/// One connected component of a phase.
struct Cluster {
  std::uint64_t voxels = 0;
  std::uint8_t faces =
      0;  ///< bits 0 to 5: touches the lower x, upper x, lower y, upper y, lower z, upper z face

  bool spans(SpanningRule rule) const {
    const int wanted = rule == SpanningRule::six_faces ? 63 : 3 << 2 * int(rule);
    return (faces & wanted) == wanted;
  }
};

/// The connected components of one phase (Hoshen and Kopelman 1976), numbered by their first voxel.
struct Clusters {
  std::vector<std::uint32_t> labels;  ///< a voxel: 0 in the other phase, else 1 + its index in `clusters`
  std::vector<Cluster> clusters;

  /// Index of the cluster with most voxels (the first of equals); none if the phase has no voxel.
  std::optional<std::size_t> largest() const;

  /// Voxels in clusters that span.
  std::uint64_t spanning_voxels(SpanningRule rule) const;
};

/// Same labels on any number of threads. Memory: 4 bytes a voxel.
/// @throws InputError  if the image has 2^32 - 1 voxels or more
Clusters find_clusters(const PhaseImage& image, Phase phase, Connectivity connectivity);

/// The solid that is left when what belongs to no spanning cluster becomes pore.
struct CleanedImage {
  PhaseImage image;
  std::uint64_t solid_voxels;      ///< before
  std::uint64_t connected_voxels;  ///< after
  std::size_t removed_clusters;
  double solid_fraction;            ///< phi [-], before: solid voxels over all voxels
  double connected_solid_fraction;  ///< phi_p [-]: voxels of the spanning clusters over all voxels
};

/// Removes the solid that is not connected to a cluster which spans the sample.
/// @throws InputError  if no cluster spans; says how many clusters there are and what the largest touches
CleanedImage remove_unconnected(const PhaseImage& image, SpanningRule rule, Connectivity connectivity);

/// "x", "y", "z" or "six_faces".
std::string name_of(SpanningRule rule);

}  // namespace anticrack
