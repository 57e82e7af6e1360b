#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>

#include "fields/gaussian_random_field.h"
#include "measures/field_theory.h"
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

/// The image whose voxel is solid where `inside` holds at its centre [m].
inline PhaseImage image_of(const Index3& size, double voxel_size,
                           const std::function<bool(const Vec3&)>& inside) {
  PhaseImage image{size, voxel_size, {}};
  image.solid.reserve(image.count());
  for (int k = 0; k < size[2]; ++k)
    for (int j = 0; j < size[1]; ++j)
      for (int i = 0; i < size[0]; ++i)
        image.solid.push_back(inside(voxel_size * Vec3(i + 0.5, j + 0.5, k + 0.5)));
  return image;
}

/// The single cut of a field at the threshold of theory, not capped.
inline PhaseImage image_of_field(const SampleLattice& lattice, const GaussianRandomFieldSpec& spec,
                                 double solid_fraction) {
  const auto field = GaussianRandomField::sample(spec, Vec3(lattice.size()).minCoeff());
  PhaseImage image{lattice.points, lattice.spacing, {}};
  image.solid.reserve(image.count());
  for (float excess : field.evaluate_excess_on_lattice(
           lattice, 0, theoretical_threshold(Morphology::single_cut, solid_fraction)))
    image.solid.push_back(excess > 0);
  return image;
}

}  // namespace anticrack
