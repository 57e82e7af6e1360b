#include "measures/representative_volume.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "errors.h"

namespace anticrack {
namespace {

PhaseImage cut_cube(const PhaseImage& image, const Index3& corner, int edge) {
  PhaseImage cube{{edge, edge, edge}, image.voxel_size, {}};
  cube.solid.resize(cube.count());
  for (int k = 0; k < edge; ++k)
    for (int j = 0; j < edge; ++j)
      std::copy_n(&image.solid[image.offset(corner[0], corner[1] + j, corner[2] + k)], edge,
                  &cube.solid[cube.offset(0, j, k)]);
  return cube;
}

double solid_fraction_of_cube(const PhaseImage& image, const Index3& corner, int edge) {
  std::int64_t solid = 0;
  for (int k = 0; k < edge; ++k)
    for (int j = 0; j < edge; ++j) {
      const std::uint8_t* row = &image.solid[image.offset(corner[0], corner[1] + j, corner[2] + k)];
      solid += std::count(row, row + edge, std::uint8_t(1));
    }
  return double(solid) / (double(edge) * edge * edge);
}

template <typename Measure>
SubBoxStatistics sub_box_statistics(const PhaseImage& image, int edge, const Measure& measure) {
  if (edge < 1) throw InputError(fmt::format("sub-boxes with an edge of {} voxels; expected >= 1", edge));
  const Index3 boxes{image.size[0] / edge, image.size[1] / edge, image.size[2] / edge};
  const auto count = std::int64_t(boxes[0]) * boxes[1] * boxes[2];
  if (count < 2)
    throw InputError(
        fmt::format("sub-boxes with an edge of {} voxels in an image of {} x {} x {} voxels; expected "
                    "an edge that leaves two boxes or more",
                    edge, image.size[0], image.size[1], image.size[2]));

  std::vector<double> values(count);
  tbb::parallel_for(std::int64_t(0), count, [&](std::int64_t n) {
    const Index3 corner{edge * int(n % boxes[0]), edge * int(n / boxes[0] % boxes[1]),
                        edge * int(n / boxes[0] / boxes[1])};
    values[n] = measure(corner, edge);
  });

  double sum = 0, squares = 0;
  for (double value : values) sum += value;
  const double mean = sum / double(count);
  for (double value : values) squares += (value - mean) * (value - mean);
  return {edge, count, mean, std::sqrt(squares / double(count - 1))};
}

}  // namespace

std::vector<int> sub_box_edges(const PhaseImage& image, int smallest) {
  const int shortest = *std::ranges::min_element(image.size);
  std::vector<int> edges;
  for (int parts = 2; shortest / parts >= std::max(smallest, 1); parts *= 2)  // 2, 3, 4, 6, 8, 12, ...
    for (int edge : {shortest / parts, shortest / (parts + parts / 2)})
      if (edge >= std::max(smallest, 1) && (edges.empty() || edge < edges.back())) edges.push_back(edge);
  return edges;
}

std::vector<SubBoxStatistics> sub_box_solid_fractions(const PhaseImage& image, std::span<const int> edges) {
  std::vector<SubBoxStatistics> curve;
  for (int edge : edges)
    curve.push_back(sub_box_statistics(image, edge, [&](const Index3& corner, int size) {
      return solid_fraction_of_cube(image, corner, size);
    }));
  return curve;
}

std::vector<SubBoxStatistics> sub_box_measure(const PhaseImage& image, std::span<const int> edges,
                                              const std::function<double(const PhaseImage&)>& measure) {
  std::vector<SubBoxStatistics> curve;
  for (int edge : edges)
    curve.push_back(sub_box_statistics(
        image, edge, [&](const Index3& corner, int size) { return measure(cut_cube(image, corner, size)); }));
  return curve;
}

double RepresentativeVolume::edge_for_relative_error(double error) const {
  const double variance = std::pow(0.5 * error * mean, 2);
  return std::pow(scale / variance, 1 / (3 * exponent));
}

RepresentativeVolume fit_representative_volume(std::span<const SubBoxStatistics> curve, double voxel_size,
                                               bool free_exponent) {
  // Straight line through log variance over log volume. The logarithm of a variance of n values scatters by
  // sqrt(2 / (n - 1)).
  int largest = 0;
  for (const SubBoxStatistics& point : curve) largest = std::max(largest, point.edge);
  double weights = 0, x_sum = 0, y_sum = 0, xx_sum = 0, xy_sum = 0, mean = 0;
  int usable = 0, smallest = largest;
  for (const SubBoxStatistics& point : curve) {
    if (!(point.standard_deviation > 0) || point.edge < largest / 3) continue;
    const double x = 3 * std::log(point.edge * voxel_size), y = 2 * std::log(point.standard_deviation);
    const auto weight = double(point.boxes - 1);
    ++usable;
    weights += weight;
    x_sum += weight * x;
    y_sum += weight * y;
    xx_sum += weight * x * x;
    xy_sum += weight * x * y;
    if (point.edge <= smallest) {
      smallest = point.edge;
      mean = point.mean;
    }
  }
  const int needed = free_exponent ? 2 : 1;
  if (usable < needed)
    throw InputError(fmt::format(
        "representative volume: {} edges of sub-boxes, down to {} voxels, between which the measure "
        "varies; expected at least {}",
        usable, largest / 3, needed));
  const double x_mean = x_sum / weights, y_mean = y_sum / weights;
  const double slope =
      free_exponent ? (xy_sum / weights - x_mean * y_mean) / (xx_sum / weights - x_mean * x_mean) : -1;
  return {.mean = mean, .scale = std::exp(y_mean - slope * x_mean), .exponent = -slope};
}

}  // namespace anticrack
