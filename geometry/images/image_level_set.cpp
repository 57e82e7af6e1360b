#include "images/image_level_set.h"

#include <fmt/format.h>
#include <openvdb/tools/SignedFloodFill.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <deque>

#include "errors.h"
#include "level_sets/level_set.h"

namespace anticrack {
namespace {

constexpr int leaf_edge = 8;
constexpr int overlap =
    8;  // planes: a distance depends on the field at most 5 rings of seeds and a stencil away
constexpr int padding = PaddedField::padding;

int smoothing_radius(double sigma) {
  return int(std::ceil(3 * sigma));
}

// A Gaussian times 3/2 - d^2 / (2 sigma^2): its second moment vanishes, so that a curved surface does not
// move towards its centre of curvature (a ball of radius R would lose sigma^2 / R by the Gaussian alone).
std::vector<float> smoothing_weights(double sigma) {
  const int radius = smoothing_radius(sigma);
  std::vector<double> weights(std::size_t(2 * radius + 1));
  double sum = 0;
  for (int d = -radius; d <= radius; ++d) {
    const double squared = d * d / (sigma * sigma);
    sum += weights[std::size_t(d + radius)] = std::exp(-0.5 * squared) * (1.5 - 0.5 * squared);
  }
  std::vector<float> rounded;
  for (const double weight : weights) rounded.push_back(float(weight / sum));
  return rounded;
}

// One slice, smoothed along x and y, into a plane of the padded lattice.
void smooth_slice(const std::uint8_t* slice, const Index3& size, const std::vector<float>& weights,
                  float* plane) {
  const auto [nx, ny, nz] = size;
  const int radius = int(weights.size() / 2), width = nx + 2 * padding;
  const int rows = ny + 2 * padding + 2 * radius;  // from -padding - radius
  std::vector<float> along_x(std::size_t(width) * std::size_t(rows)), row(std::size_t(width + 2 * radius));
  for (int r = 0; r < rows; ++r) {
    const int j = std::clamp(r - padding - radius, 0, ny - 1);
    for (int i = 0; i < int(row.size()); ++i)
      row[std::size_t(i)] =
          slice[std::size_t(j) * std::size_t(nx) + std::size_t(std::clamp(i - padding - radius, 0, nx - 1))];
    float* to = &along_x[std::size_t(r) * std::size_t(width)];
    for (std::size_t d = 0; d < weights.size(); ++d)
      for (int i = 0; i < width; ++i) to[i] += weights[d] * row[std::size_t(i) + d];
  }
  for (int r = 0; r < ny + 2 * padding; ++r) {
    float* to = plane + std::size_t(r) * std::size_t(width);
    std::fill(to, to + width, 0.0f);
    for (std::size_t d = 0; d < weights.size(); ++d) {
      const float* from = &along_x[(std::size_t(r) + d) * std::size_t(width)];
      for (int i = 0; i < width; ++i) to[i] += weights[d] * from[i];
    }
  }
}

// Moves the leaves whose origin lies in [first, last) planes of the slab to the grid, `shift` planes higher.
void move_leaves(const LevelSet& slab, int first, int last, int shift, openvdb::FloatTree& tree) {
  using Leaf = openvdb::FloatTree::LeafNodeType;
  for (auto leaf = slab.grid->tree().cbeginLeaf(); leaf; ++leaf) {
    const openvdb::Coord origin = leaf->origin();
    if (origin[2] < first || origin[2] >= last) continue;
    auto moved = std::make_unique<Leaf>(*leaf);
    moved->setOrigin(origin.offsetBy(0, 0, shift));
    tree.addLeaf(moved.release());
  }
}

// The last slices that were asked for; those before `first` are let go.
class SliceWindow {
 public:
  explicit SliceWindow(PhaseSlices& slices) : slices_(slices) {}

  void hold(int first, int last) {
    for (; !window_.empty() && first_ < first; ++first_) window_.pop_front();
    if (window_.empty()) first_ = first;
    while (first_ + int(window_.size()) < last) {
      std::vector<std::uint8_t>& slice = window_.emplace_back();
      slices_.read(first_ + int(window_.size()) - 1, slice);
    }
  }
  const std::vector<std::uint8_t>& operator[](int k) const { return window_[std::size_t(k - first_)]; }

 private:
  PhaseSlices& slices_;
  int first_ = 0;
  std::deque<std::vector<std::uint8_t>> window_;
};

std::string crop_text(const PhaseSlices& slices) {
  std::string text;
  for (const auto& [begin, end] : slices.crop())
    text += fmt::format("{}{}:{}", text.empty() ? "" : ",", begin, end);
  return text;
}

}  // namespace

PaddedField smooth_excess(const Index3& size, int first, int count, const ImageSmoothing& smoothing,
                          const std::function<const std::uint8_t*(int k)>& slice) {
  const std::vector<float> weights = smoothing_weights(smoothing.sigma);
  const int radius = int(weights.size() / 2), planes = count + 2 * padding;
  PaddedField field{{size[0], size[1], count}, {}};
  const std::size_t plane = field.plane_stride(), row = field.row_stride();
  field.values.resize(plane * std::size_t(planes + 2 * radius));
  const auto in_image = [&](int k) { return slice(std::clamp(first + k, 0, size[2] - 1)); };
  tbb::parallel_for(0, planes + 2 * radius, [&](int p) {
    smooth_slice(in_image(p - padding - radius), size, weights, &field.values[std::size_t(p) * plane]);
  });
  // Along z in place: plane p needs the planes from p on.
  const auto margin = float(smoothing.margin);
  tbb::parallel_for(0, size[1] + 2 * padding, [&](int r) {
    std::vector<float> sum(row);
    const int j = std::clamp(r - padding, 0, size[1] - 1);
    for (int p = 0; p < planes; ++p) {
      float* to = &field.values[std::size_t(p) * plane + std::size_t(r) * row];
      std::ranges::fill(sum, 0.0f);
      for (std::size_t d = 0; d < weights.size(); ++d)
        for (std::size_t i = 0; i < row; ++i) sum[i] += weights[d] * to[d * plane + i];
      const std::uint8_t* solid = in_image(p - padding) + std::size_t(j) * std::size_t(size[0]);
      for (std::size_t i = 0; i < row; ++i) {
        const float excess = sum[i] - 0.5f;
        to[i] = solid[std::clamp(int(i) - padding, 0, size[0] - 1)] ? std::max(excess, margin)
                                                                    : std::min(excess, -margin);
      }
    }
  });
  field.values.resize(plane * std::size_t(planes));
  return field;
}

int slab_thickness(const Index3& size) {
  constexpr std::int64_t most_points = std::int64_t(1) << 25;
  constexpr int fewest = 32;
  const std::int64_t plane = std::int64_t(size[0] + 2 * padding) * (size[1] + 2 * padding);
  const std::int64_t planes = most_points / plane - 2 * (overlap + padding);
  return int(std::clamp<std::int64_t>(planes / leaf_edge * leaf_edge, fewest, 1 << 21));
}

double image_level_set_memory(const Index3& size) {
  constexpr double bytes_in_slab = 10, bytes_in_band = 4.5;
  const double plane = double(size[0] + 2 * padding) * (size[1] + 2 * padding);
  const double planes = std::min(size[2], slab_thickness(size) + 2 * overlap) + 2 * padding;
  return bytes_in_slab * plane * planes + bytes_in_band * size[0] * size[1] * size[2];
}

Microstructure build_image_level_set(PhaseSlices& slices, double voxel_size, const Watch& watch,
                                     const ImageSmoothing& smoothing, int thickness) {
  if (!(voxel_size > 0) || !std::isfinite(voxel_size))
    throw InputError(fmt::format("voxel size = {:g} m; expected a finite number > 0", voxel_size));
  const Index3 size = slices.size();
  const int nz = size[2];
  if (thickness == 0) thickness = slab_thickness(size);
  Microstructure result;
  result.lattice = {size, voxel_size * slices.downsample()};

  SliceWindow window(slices);
  openvdb::FloatGrid::Ptr grid;
  LengthUnit unit{};
  const int reach = overlap + padding + smoothing_radius(smoothing.sigma);
  for (int z = 0; z < nz; z += thickness) {
    if (watch) watch(double(z) / nz);
    const int end = std::min(nz, z + thickness);
    window.hold(std::max(0, z - reach), std::min(nz, end + reach));
    for (int k = z; k < end; ++k)
      result.solid_points += std::size_t(std::ranges::count(window[k], std::uint8_t(1)));

    const int first = std::max(0, z - overlap), last = std::min(nz, end + overlap);
    const PaddedField excess =
        smooth_excess(size, first, last - first, smoothing, [&](int k) { return window[k].data(); });
    const LevelSet slab = build_level_set(excess, result.lattice.spacing, [&](double done) {
      if (watch) watch((z + done * (end - z)) / nz);
    });
    if (!grid) grid = slab.grid->copyWithNewTree(), unit = slab.unit;
    // The first slab holds the band below the box too, the last the band above it.
    move_leaves(slab, z == 0 ? -leaf_edge : z - first, end == nz ? nz - first + leaf_edge : end - first,
                first, grid->tree());
  }
  if (result.solid_points == 0)
    throw InputError(fmt::format("{}: no voxel is solid after downsampling by {}; expected a smaller number",
                                 slices.name(), slices.downsample()));
  openvdb::tools::signedFloodFill(grid->tree());
  if (watch) watch(1);
  result.surface = std::make_shared<LevelSet>(LevelSet{grid, unit});
  result.metadata = {{"source", "scan"},
                     {"voxel_size", voxel_size},
                     {"segmentation", slices.rule()},
                     {"crop", crop_text(slices)},
                     {"downsample", std::int64_t(slices.downsample())},
                     {"solid_fraction_of_image", slices.solid_fraction_of_image()},
                     {"solid_fraction_achieved", result.solid_fraction()}};
  return result;
}

}  // namespace anticrack
