#include "observables/angular_momentum.h"

#include <Eigen/Geometry>

namespace anticrack {

Vec3 centre_of_mass(std::span<const Vec3> positions) {
  Vec3 sum = Vec3::Zero();
  for (const Vec3& x : positions) sum += x;
  return sum / double(positions.size());
}

Vec3 angular_momentum(const Simulation& simulation) {
  const Particles& p = simulation.particles();
  const double dx = simulation.setup().cell_size;
  const std::vector<Vec3> x = simulation.positions();
  const Vec3 centre = centre_of_mass(x);
  Vec3 sum = Vec3::Zero();
  for (std::size_t i = 0; i < p.count; ++i) {
    sum += (x[i] - centre).cross(Vec3(p.v[0][i], p.v[1][i], p.v[2][i]));
    if (p.affine[0].size() == 0) continue;
    const auto dx_C = [&](int a, int e) { return p.affine[3 * a + e][i]; };
    sum += 0.25 * dx * Vec3(dx_C(2, 1) - dx_C(1, 2), dx_C(0, 2) - dx_C(2, 0), dx_C(1, 0) - dx_C(0, 1));
  }
  return simulation.particle_mass() * sum;
}

}  // namespace anticrack
