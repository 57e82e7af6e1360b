#include "body_force.h"

#include <tbb/parallel_for.h>

#include "bspline.h"

namespace anticrack {

namespace {

/// Adds `force` at place `s` of a cell to the block's group of sums.
void scatter_force(const Vec3& force, const SparseGrid::Block& block, int cell, const Vec3& s) {
  const QuadraticBSpline<double> N[3] = {QuadraticBSpline<double>(s[0]), QuadraticBSpline<double>(s[1]),
                                         QuadraticBSpline<double>(s[2])};
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      for (int k = 0; k < 3; ++k) {
        const int x = (cell >> 4) + i, y = (cell >> 2 & 3) + j, z = (cell & 3) + k;
        Node& node = block.partial[(x >> 2) * 4 + (y >> 2) * 2 + (z >> 2)][leaf_index(x & 3, y & 3, z & 3)];
        const double weight = N[0].w[i] * N[1].w[j] * N[2].w[k];
        for (int a = 0; a < 3; ++a) node.increment[a] += weight * force[a];
      }
}

}  // namespace

void add_body_force(const BodyAcceleration& b, double time, double mass, double cell_size,
                    const Vec3& grid_offset, const Particles& particles, std::span<const Stray> strays,
                    const std::vector<CellRanges>& cells, const SparseGrid& grid) {
  const auto add = [&](std::uint32_t block, int cell, const Vec3& s) {
    const Index3& origin = grid.blocks()[block].reach.origin;
    Vec3 x;
    for (int a = 0; a < 3; ++a)
      x[a] = cell_size * (origin[a] * block_edge + (cell >> (4 - 2 * a) & 3) + 0.5 + s[a] + grid_offset[a]);
    scatter_force(mass * b(x, time), grid.blocks()[block], cell, s);
  };
  const auto place = [&](std::uint32_t i) {
    return Vec3(particles.s[0][i], particles.s[1][i], particles.s[2][i]);
  };
  // A group's sums are its own.
  tbb::parallel_for(std::size_t(0), grid.groups().size(), [&](std::size_t g) {
    for (std::uint32_t block = grid.groups()[g].first_block; block < grid.groups()[g].last_block; ++block)
      for (int cell = 0; cell < block_cells; ++cell)
        for (std::uint32_t i = cells[block][cell]; i < cells[block][cell + 1]; ++i) {
          const Vec3 s = place(i);
          if (s.minCoeff() >= 0 && s.maxCoeff() <= 1) add(block, cell, s);
        }
  });
  for (const Stray& stray : strays)
    if (stray.shift != Index3{})
      add(stray.block, stray.cell,
          place(stray.particle) - Vec3(stray.shift[0], stray.shift[1], stray.shift[2]));
}

}  // namespace anticrack
