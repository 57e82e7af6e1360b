#include "inversion.h"

#include <tbb/parallel_for.h>

#include <Eigen/LU>
#include <algorithm>
#include <limits>

#include "bspline.h"

namespace anticrack {

namespace {

/// Node (x, y, z), each in 0..5, of a block; nullptr in a leaf that the block does not reach.
const Node* node_of(const SparseGrid::Block& block, int x, int y, int z) {
  const Node* leaf = block.nodes[(x >> 2) * 4 + (y >> 2) * 2 + (z >> 2)];
  return leaf ? leaf + leaf_index(x & 3, y & 3, z & 3) : nullptr;
}

/// Largest difference of a velocity component among the nodes with mass.
double velocity_range(const SparseGrid::Block& block) {
  constexpr double infinity = std::numeric_limits<double>::infinity();
  double low[3] = {infinity, infinity, infinity}, high[3] = {-infinity, -infinity, -infinity};
  for (int n = 0; n < tile_nodes; ++n) {
    const Node* node = node_of(block, n / 36, n / 6 % 6, n % 6);
    if (!node || node->mass <= 0) continue;
    for (int a = 0; a < 3; ++a) {
      low[a] = std::min(low[a], node->velocity[a]);
      high[a] = std::max(high[a], node->velocity[a]);
    }
  }
  double range = 0;
  for (int a = 0; a < 3; ++a) range = std::max(range, high[a] - low[a]);
  return range;
}

/// det(I + dt grad v) at the place `s` of a cell of a block.
double determinant_at(const SparseGrid::Block& block, int cell, const Vec3& s, double dt_over_dx) {
  const QuadraticBSpline<double> N[3] = {QuadraticBSpline<double>(s[0]), QuadraticBSpline<double>(s[1]),
                                         QuadraticBSpline<double>(s[2])};
  Mat3 F = Mat3::Identity();
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      for (int k = 0; k < 3; ++k) {
        const Node& node = *node_of(block, (cell >> 4) + i, (cell >> 2 & 3) + j, (cell & 3) + k);
        const Vec3 v(node.velocity[0], node.velocity[1], node.velocity[2]);
        const Vec3 slope(N[0].dw[i] * N[1].w[j] * N[2].w[k], N[0].w[i] * N[1].dw[j] * N[2].w[k],
                         N[0].w[i] * N[1].w[j] * N[2].dw[k]);
        if (node.mass > 0) F += dt_over_dx * v * slope.transpose();
      }
  return F.determinant();
}

bool inside_cell(const Vec3& s) {
  return s.minCoeff() >= 0 && s.maxCoeff() <= 1;
}

}  // namespace

std::optional<std::uint32_t> find_inverted_particle(const Particles& particles, const SparseGrid& grid,
                                                    const std::vector<CellRanges>& cells,
                                                    std::span<const Stray> strays, double dt_over_dx) {
  const auto place = [&](std::uint32_t i) {
    return Vec3(particles.s[0][i], particles.s[1][i], particles.s[2][i]);
  };
  constexpr std::uint32_t none = SparseGrid::none;
  std::vector<std::uint32_t> inverted(cells.size(), none);
  std::vector<char> suspect(cells.size());
  tbb::parallel_for(std::size_t(0), cells.size(), [&](std::size_t b) {
    const SparseGrid::Block& block = grid.blocks()[b];
    suspect[b] = 3 * dt_over_dx * velocity_range(block) >= 1;
    if (!suspect[b]) return;
    for (int cell = 0; cell < block_cells; ++cell)
      for (std::uint32_t i = cells[b][cell]; i < cells[b][cell + 1] && inverted[b] == none; ++i) {
        const Vec3 s = place(i);
        if (inside_cell(s) && !(determinant_at(block, cell, s, dt_over_dx) > 0)) inverted[b] = i;
      }
  });
  std::uint32_t first = none;
  for (const std::uint32_t i : inverted) first = std::min(first, i);
  for (const Stray& stray : strays) {
    if (!suspect[stray.block]) continue;
    const Vec3 s = place(stray.particle) - Vec3(stray.shift[0], stray.shift[1], stray.shift[2]);
    if (!(determinant_at(grid.blocks()[stray.block], stray.cell, s, dt_over_dx) > 0))
      first = std::min(first, stray.particle);
  }
  return first == none ? std::nullopt : std::optional(first);
}

}  // namespace anticrack
