#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "gaussian_random_field.h"
#include "measures/phase_image.h"

namespace anticrack {

/// An image whose voxel (i, j, k) is solid where is_solid(i, j, k).
template <class Rule>
PhaseImage make_image(const Index3& size, double voxel_size, const Rule& is_solid) {
  PhaseImage image{size, voxel_size, {}};
  for (int k = 0; k < size[2]; ++k)
    for (int j = 0; j < size[1]; ++j)
      for (int i = 0; i < size[0]; ++i) image.solid.push_back(is_solid(i, j, k) ? 1 : 0);
  return image;
}

/// A ball about the centre of a cube of n voxels.
inline PhaseImage ball_image(int n, double radius, double voxel_size) {
  const double c = 0.5 * (n - 1);
  return make_image({n, n, n}, voxel_size, [=](int i, int j, int k) {
    return (i - c) * (i - c) + (j - c) * (j - c) + (k - c) * (k - c) < radius * radius;
  });
}

inline PhaseImage complement(PhaseImage image) {
  for (auto& voxel : image.solid) voxel ^= 1;
  return image;
}

/// {G > threshold} on n^3 voxels of a unit cube. `sign` -1 takes the field -G, as likely as G.
inline PhaseImage cut_of_field(int n, double wavelengths, double threshold, std::uint64_t seed,
                               int sign = 1) {
  const auto field = GaussianRandomField::sample(
      {.waves = 10000, .wavelengths_per_side = wavelengths, .heterogeneity = 50, .seed = seed}, 1.0);
  const auto excess = field.evaluate_on_lattice({{n, n, n}, 1.0 / n}, 0);
  PhaseImage image{{n, n, n}, 1.0 / n, {}};
  for (const double value : excess) image.solid.push_back(sign * value > threshold ? 1 : 0);
  return image;
}

/// erfinv(1 - 2 phi), the cut that leaves the solid fraction phi on average.
inline double threshold_of_fraction(double phi) {
  double low = -6, high = 6;
  for (int n = 0; n < 100; ++n) {
    const double middle = 0.5 * (low + high);
    (std::erf(middle) < 1 - 2 * phi ? low : high) = middle;
  }
  return low;
}

}  // namespace anticrack
