#pragma once

#include <cstdint>
#include <vector>

#include "measures/phase_image.h"

namespace anticrack {

/// Chords of a phase: the stretches of it on the lattice lines along an axis (Torquato and Lu 1993).
struct Chords {
  std::vector<std::uint64_t> whole;  ///< [l]: chords of l voxels that end inside the sample on both sides
  std::vector<std::uint64_t> cut;    ///< [l]: of those that a face of the box cuts on one or both sides
  std::uint64_t ends = 0;            ///< ends of chords inside the sample
  std::uint64_t voxels = 0;          ///< of the phase
  double voxel_size = 0;             ///< h [m]

  /// Mean length of the whole chords [m], NaN if there is none. Too short: long chords are cut more often.
  double mean_of_whole() const;

  /// Length of the phase over half the number of ends [m], NaN if there is none: cut chords count as far as
  /// they show. Without bias but for the ratio's own.
  double mean() const;
};

/// Same counts on any number of threads.
Chords measure_chords(const PhaseImage& image, Phase phase, int axis);

}  // namespace anticrack
