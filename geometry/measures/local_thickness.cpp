#include "measures/local_thickness.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "errors.h"
#include "measures/distance_transform.h"

namespace anticrack {
namespace {

// For each squared radius D: the least squared radius at which a ball around a neighbour holds all lattice
// points of the open ball |x|^2 < D. Neighbours by a face, an edge, a corner (Remy & Thiel 2002; Dougherty &
// Kunzelmann 2007).
struct Containment {
  std::array<std::vector<std::int32_t>, 3> least;

  explicit Containment(std::int32_t largest) {
    const auto steps = std::size_t(largest) + 1;
    for (auto& table : least) table.assign(steps, 0);
    // The farthest point of each norm from the neighbour, |x|^2 + 2 x.d + d.d, lies opposite of it.
    const int reach = int(std::sqrt(double(largest))) + 1;
    for (int a = 0; a <= reach; ++a)
      for (int b = 0; b <= a; ++b)
        for (int c = 0; c <= b; ++c) {
          const std::int64_t norm = std::int64_t(a) * a + std::int64_t(b) * b + std::int64_t(c) * c;
          if (norm >= largest) break;
          const std::int32_t along[] = {a, a + b, a + b + c};
          for (int kind = 0; kind < 3; ++kind) {
            std::int32_t& farthest = least[kind][std::size_t(norm) + 1];
            farthest = std::max(farthest, std::int32_t(norm) + 2 * along[kind] + kind + 2);
          }
        }
    for (auto& table : least)
      for (std::size_t d = 1; d < steps; ++d) table[d] = std::max(table[d], table[d - 1]);
  }
};

struct Ball {
  int i, j, k;
  std::int32_t square;
};

bool is_in_a_neighbours_ball(const PhaseImage& image, const std::vector<std::int32_t>& squares,
                             const Containment& containment, const Ball& ball) {
  const auto [nx, ny, nz] = image.size;
  for (int k = std::max(ball.k - 1, 0); k <= std::min(ball.k + 1, nz - 1); ++k)
    for (int j = std::max(ball.j - 1, 0); j <= std::min(ball.j + 1, ny - 1); ++j)
      for (int i = std::max(ball.i - 1, 0); i <= std::min(ball.i + 1, nx - 1); ++i) {
        const int kind = std::abs(i - ball.i) + std::abs(j - ball.j) + std::abs(k - ball.k) - 1;
        if (kind >= 0 && squares[image.offset(i, j, k)] >= containment.least[kind][ball.square]) return true;
      }
  return false;
}

// Balls that no neighbour's ball holds, by plane.
std::vector<std::vector<Ball>> find_ridge(const PhaseImage& image, const std::vector<std::int32_t>& squares) {
  const auto [nx, ny, nz] = image.size;
  const Containment containment(*std::ranges::max_element(squares));
  std::vector<std::vector<Ball>> planes(nz);
  tbb::parallel_for(0, nz, [&](int k) {
    for (int j = 0; j < ny; ++j)
      for (int i = 0; i < nx; ++i) {
        const Ball ball{i, j, k, squares[image.offset(i, j, k)]};
        if (ball.square > 0 && !is_in_a_neighbours_ball(image, squares, containment, ball))
          planes[k].push_back(ball);
      }
  });
  return planes;
}

// Largest m with m^2 <= square.
int root_of(std::int32_t square) {
  int root = int(std::sqrt(double(square)));
  while (std::int64_t(root) * root > square) --root;
  return root;
}

// The ball's share of a plane at the height dz from its centre.
void paint_disc(const PhaseImage& image, const Ball& ball, int dz, std::int32_t* plane) {
  const auto [nx, ny, nz] = image.size;
  const std::int32_t disc = ball.square - 1 - dz * dz;  // open: |x|^2 <= D - 1
  if (disc < 0) return;
  const int reach = root_of(disc);
  int half = 0;
  for (int dy = -reach; dy <= std::min(reach, ny - 1 - ball.j); ++dy) {
    // The half width of the row rises up to the middle and falls again.
    const std::int32_t rest = disc - dy * dy;
    while ((half + 1) * (half + 1) <= rest) ++half;
    while (half * half > rest) --half;
    if (ball.j + dy < 0) continue;
    std::int32_t* row = plane + std::size_t(ball.j + dy) * std::size_t(nx);
    const int last = std::min(ball.i + half, nx - 1);
    for (int i = std::max(ball.i - half, 0); i <= last; ++i) row[i] = std::max(row[i], ball.square);
  }
}

void require_both_phases(const PhaseImage& image) {
  const auto solid = std::ranges::count(image.solid, std::uint8_t(1));
  if (solid == 0 || std::size_t(solid) == image.count())
    throw InputError(fmt::format(
        "local thickness: the image has no {} voxel; expected both phases, which bound each other's balls",
        solid == 0 ? "solid" : "pore"));
}

}  // namespace

std::vector<std::int32_t> squared_local_radii(const PhaseImage& image, Phase phase) {
  require_both_phases(image);
  const int nz = image.size[2];
  std::vector<std::vector<Ball>> ridge;
  int reach = 0;
  {
    const auto squares = squared_distances(image, phase);
    reach = root_of(*std::ranges::max_element(squares));
    ridge = find_ridge(image, squares);
  }

  // Each plane of voxels takes the balls that reach it: nobody else writes to it.
  std::vector<std::int32_t> radii(image.count(), 0);
  tbb::parallel_for(0, nz, [&](int k) {
    for (int centre = std::max(k - reach, 0); centre <= std::min(k + reach, nz - 1); ++centre)
      for (const Ball& ball : ridge[centre])
        paint_disc(image, ball, k - centre, &radii[image.offset(0, 0, k)]);
  });
  return radii;
}

ThicknessDistribution thickness_distribution(const PhaseImage& image, Phase phase) {
  std::map<std::int32_t, std::uint64_t> by_square;
  {
    const auto radii = squared_local_radii(image, phase);
    std::vector<std::uint64_t> counts(std::size_t(*std::ranges::max_element(radii)) + 1, 0);
    for (std::int32_t square : radii) ++counts[square];
    for (std::size_t square = 1; square < counts.size(); ++square)
      if (counts[square] > 0) by_square[std::int32_t(square)] = counts[square];
  }

  ThicknessDistribution result{};
  double sum = 0, squares = 0;
  for (const auto& [square, voxels] : by_square) {
    const double diameter = 2 * image.voxel_size * std::sqrt(double(square));
    result.shares.push_back({diameter, voxels});
    result.voxels += voxels;
    sum += diameter * double(voxels);
  }
  result.mean = sum / double(result.voxels);
  for (const ThicknessShare& share : result.shares)
    squares += std::pow(share.diameter - result.mean, 2) * double(share.voxels);
  result.standard_deviation = std::sqrt(squares / double(result.voxels));
  return result;
}

std::vector<double> ThicknessDistribution::histogram(double width) const {
  if (!(width > 0) || !std::isfinite(width))
    throw InputError("histogram of thickness: expected a bin width > 0");
  std::vector<double> bins(std::size_t(shares.back().diameter / width) + 1, 0.0);
  for (const ThicknessShare& share : shares)
    bins[std::size_t(share.diameter / width)] += double(share.voxels) / double(voxels);
  return bins;
}

double ThicknessDistribution::quantile(double share) const {
  std::uint64_t below = 0;
  for (const ThicknessShare& s : shares) {
    below += s.voxels;
    if (double(below) >= share * double(voxels)) return s.diameter;
  }
  return shares.back().diameter;
}

}  // namespace anticrack
