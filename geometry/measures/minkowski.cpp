#include "measures/minkowski.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>
#include <vector>

#include "errors.h"

namespace anticrack {
namespace {

// Shares of the sphere nearest to each of the 13 lines: of an axis, a face diagonal, a space diagonal.
constexpr double share_of_axis = 2 * 0.04577789120476;
constexpr double share_of_face_diagonal = 2 * 0.03698062787608;
constexpr double share_of_space_diagonal = 2 * 0.03519563978232;

int dimension(int direction) {
  return std::popcount(unsigned(direction));
}

// Calls action(a, b, direction) for the 28 pairs of corners; direction = a xor b: 1, 2, 4 along an axis, 3,
// 5, 6 along a face diagonal, 7 along a space diagonal.
template <class Action>
void for_each_pair(const Action& action) {
  for (int a = 0; a < 8; ++a)
    for (int b = a + 1; b < 8; ++b) action(a, b, a ^ b);
}

// The four corners of the square through `corner` that spans two axes (bits of `plane`).
int square(int corner, int plane) {
  int bits = 0;
  for (int other = 0; other < 8; ++other)
    if (((other ^ corner) & ~plane) == 0) bits |= 1 << other;
  return bits;
}

// Eight times the share of one neighbourhood in vertices - edges + faces - cells, with cells at voxel
// centres.
int eightfold_euler_share(int pattern) {
  int share = std::popcount(unsigned(pattern));
  for_each_pair([&](int a, int b, int direction) {
    if (dimension(direction) == 1 && pattern >> a & 1 && pattern >> b & 1) share -= 2;
  });
  for (const int plane : {3, 5, 6})
    for (const int corner : {0, 7}) {
      const int corners = square(corner, plane);
      if ((pattern & corners) == corners) share += 4;
    }
  return pattern == 255 ? share - 8 : share;
}

template <class Measure>
auto sum(const NeighbourhoodCounts& counts, const Measure& measure) {
  decltype(measure(0)) result = 0;
  for (int pattern = 0; pattern < 256; ++pattern)
    result += decltype(result)(counts.counts[std::size_t(pattern)]) * measure(pattern);
  return result;
}

// Patterns between the planes k - 1 and k; what lies outside the image is pore.
void count_planes(const PhaseImage& image, BoxBoundary boundary, int k,
                  std::array<std::uint64_t, 256>& counts) {
  const auto [nx, ny, nz] = image.size;
  const int closed = boundary == BoxBoundary::closed;
  const std::vector<std::uint8_t> pore(std::size_t(nx), 0);
  const auto row = [&](int j, int plane) {
    return j < 0 || j >= ny || plane < 0 || plane >= nz ? pore.data()
                                                        : &image.solid[image.offset(0, j, plane)];
  };
  // Two tables, since equal patterns in succession would wait for each other's sum.
  std::array<std::array<std::uint64_t, 256>, 2> tables{};
  for (int j = 1 - closed; j < ny + closed; ++j) {
    const std::uint8_t *r0 = row(j - 1, k - 1), *r1 = row(j, k - 1), *r2 = row(j - 1, k), *r3 = row(j, k);
    const auto column = [&](int i) { return r0[i] | r1[i] << 2 | r2[i] << 4 | r3[i] << 6; };
    int left = column(0);
    if (closed) ++tables[0][std::size_t(left << 1)];
    for (int i = 1; i < nx; ++i) {
      const int right = column(i);
      ++tables[std::size_t(i & 1)][std::size_t(left | right << 1)];
      left = right;
    }
    if (closed) ++tables[0][std::size_t(left)];
  }
  for (std::size_t p = 0; p < 256; ++p) counts[p] = tables[0][p] + tables[1][p];
}

}  // namespace

double NeighbourhoodCounts::volume() const {
  return double(neighbourhoods) * std::pow(voxel_size, 3);
}

double NeighbourhoodCounts::solid_volume() const {
  const std::int64_t corners = sum(*this, [](int p) { return std::int64_t(std::popcount(unsigned(p))); });
  return double(corners) / 8 * std::pow(voxel_size, 3);
}

NeighbourhoodCounts count_neighbourhoods(const PhaseImage& image, BoxBoundary boundary) {
  const auto [nx, ny, nz] = image.size;
  const int closed = boundary == BoxBoundary::closed;
  if (!closed && std::min({nx, ny, nz}) < 2)
    throw InputError(fmt::format(
        "neighbourhoods within {} x {} x {} voxels; expected at least 2 along each axis", nx, ny, nz));
  const int first = 1 - closed, last = nz + closed;
  std::vector<std::array<std::uint64_t, 256>> planes(std::size_t(last - first));
  tbb::parallel_for(first, last,
                    [&](int k) { count_planes(image, boundary, k, planes[std::size_t(k - first)]); });
  NeighbourhoodCounts result;
  result.voxel_size = image.voxel_size;
  for (const auto& plane : planes)
    for (std::size_t p = 0; p < 256; ++p) {
      result.counts[p] += plane[p];
      result.neighbourhoods += plane[p];
    }
  return result;
}

std::int64_t eightfold_euler_number(const NeighbourhoodCounts& counts, Connectivity connectivity) {
  // A body of 26-connected voxels has the number of its complement's 6-connected ones, pattern by pattern.
  const int flip = connectivity == Connectivity::corners ? 255 : 0;
  return sum(counts, [&](int pattern) { return std::int64_t(eightfold_euler_share(pattern ^ flip)); });
}

double euler_density(const NeighbourhoodCounts& counts, Connectivity connectivity) {
  return double(eightfold_euler_number(counts, connectivity)) / 8 / counts.volume();
}

double surface_area(const NeighbourhoodCounts& counts, CroftonDirections directions) {
  const bool all = directions == CroftonDirections::thirteen;
  // A pair along an axis lies in four neighbourhoods, along a face diagonal in two, along a space diagonal in
  // one.
  const double weights[] = {0, 2 * (all ? share_of_axis : 1.0 / 3) / 4,
                            all ? 2 * share_of_face_diagonal / std::numbers::sqrt2 / 2 : 0,
                            all ? 2 * share_of_space_diagonal / std::numbers::sqrt3 : 0};
  const double area = sum(counts, [&](int pattern) {
    double share = 0;
    for_each_pair([&](int a, int b, int direction) {
      if ((pattern >> a & 1) != (pattern >> b & 1)) share += weights[dimension(direction)];
    });
    return share;
  });
  return area * counts.voxel_size * counts.voxel_size;
}

double integral_of_mean_curvature(const NeighbourhoodCounts& counts) {
  // Euler number of a plane section: over a square cell (corners - 3 of 4) / 4, over a triangle of the six at
  // each point (one - two corners) / 6; times the distance of the planes in voxels.
  const auto of_square = [](int corners) { return corners == 1 ? 0.25 : corners == 3 ? -0.25 : 0.0; };
  const auto of_triangle = [](int corners) { return corners == 1 ? 1.0 / 6 : corners == 2 ? -1.0 / 6 : 0.0; };
  const auto count = [](int pattern, int corners) { return std::popcount(unsigned(pattern & corners)); };
  const double breadth = sum(counts, [&](int pattern) {
    double axes = 0, face_diagonals = 0, space_diagonals = 0;
    for (const int plane : {3, 5, 6})
      for (const int corner : {0, 7}) axes += of_square(count(pattern, square(corner, plane))) / 2;
    // Rectangles between opposite edges: an edge along each axis, and the one across the cell.
    for (const int axis : {1, 2, 4})
      for (const int corner : {0, 7 & ~axis & -(7 & ~axis)}) {
        const int opposite = corner ^ 7 ^ axis;
        const int corners = square(corner, axis) | square(opposite, axis);
        face_diagonals += of_square(count(pattern, corners)) / std::numbers::sqrt2;
      }
    // Triangles of the three neighbours of each corner.
    for (int corner = 0; corner < 8; ++corner) {
      const int corners = 1 << (corner ^ 1) | 1 << (corner ^ 2) | 1 << (corner ^ 4);
      space_diagonals += of_triangle(count(pattern, corners)) / std::numbers::sqrt3;
    }
    return share_of_axis * axes + share_of_face_diagonal * face_diagonals +
           share_of_space_diagonal * space_diagonals;
  });
  return 2 * std::numbers::pi * breadth * counts.voxel_size;
}

double specific_surface_area(const NeighbourhoodCounts& counts) {
  const double volume = counts.solid_volume();
  if (!(volume > 0))
    throw InputError("specific surface area of an image without solid; expected a solid voxel");
  return surface_area(counts, CroftonDirections::thirteen) / volume;
}

}  // namespace anticrack
