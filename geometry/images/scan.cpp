#include "images/scan.h"

#include <tbb/parallel_for.h>

#include "solid_lattice.h"

namespace anticrack {

std::vector<Vec3> scan_points(const PhaseImage& image) {
  std::vector<Vec3> points;
  points.reserve(std::size_t(std::ranges::count(image.solid, std::uint8_t(1))));
  const std::uint8_t* solid = image.solid.data();
  for (int k = 0; k < image.size[2]; ++k)
    for (int j = 0; j < image.size[1]; ++j)
      for (int i = 0; i < image.size[0]; ++i)
        if (*solid++) points.push_back(image.voxel_size * Vec3(i + 0.5, j + 0.5, k + 0.5));
  return points;
}

PhaseImage phase_image_of(const Microstructure& structure) {
  const SampleLattice& lattice = structure.lattice;
  PhaseImage image{lattice.points, lattice.spacing, {}};
  image.solid.resize(image.count());
  tbb::parallel_for(0, lattice.points[2], [&](int k) {
    find_solid_points(structure, lattice, k, {&image.solid[image.offset(0, 0, k)], image.offset(0, 0, 1)});
  });
  if (std::ranges::find(image.solid, 1) == image.solid.end()) throw no_solid_point(lattice);
  return image;
}

}  // namespace anticrack
