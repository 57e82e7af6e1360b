#pragma once

#include <functional>

#include "gaussian_random_field.h"
#include "measures/field_theory.h"
#include "measures/phase_image.h"

namespace anticrack {

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
