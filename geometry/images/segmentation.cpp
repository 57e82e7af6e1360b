#include "images/segmentation.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "errors.h"

namespace anticrack {
namespace {

constexpr std::size_t values = 65536;
constexpr char axis_names[] = "xyz";

// "0, 128, 255", at most ten of them.
std::string labels_present(const std::vector<std::uint64_t>& counts) {
  std::vector<std::size_t> present;
  for (std::size_t value = 0; value < values; ++value)
    if (counts[value] > 0) present.push_back(value);
  const std::size_t all = present.size();
  if (all > 10) present.resize(10);
  return fmt::format("{}{}", fmt::join(present, ", "), all > 10 ? fmt::format(", ... ({} in all)", all) : "");
}

}  // namespace

Index3 segmented_size(const Index3& image, const Segmentation& segmentation, const std::string& name) {
  Index3 size;
  const int n = segmentation.downsample;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto [begin, last] = segmentation.crop[axis];
    const int end = last == -1 ? image[axis] : last;
    if (begin < 0 || end > image[axis] || begin >= end)
      throw InputError(fmt::format("{}: crop {}:{} along {}; expected a part of 0:{}", name, begin, end,
                                   axis_names[axis], image[axis]));
    if (n < 1 || n > end - begin)
      throw InputError(fmt::format("{}: downsample = {}; expected 1 to the {} voxels along {}", name, n,
                                   end - begin, axis_names[axis]));
    size[axis] = (end - begin) / n;
  }
  return size;
}

PhaseSlices::PhaseSlices(std::unique_ptr<SliceReader> image, std::string name,
                         const Segmentation& segmentation, const Watch& watch)
    : image_(std::move(image)),
      name_(std::move(name)),
      crop_(segmentation.crop),
      downsample_(segmentation.downsample),
      size_(segmented_size(image_->size(), segmentation, name_)),
      is_solid_(values, 0) {
  for (std::size_t axis = 0; axis < 3; ++axis)
    if (crop_[axis][1] == -1) crop_[axis][1] = image_->size()[axis];
  choose_solid(segmentation.solid, count_values(watch));
}

std::vector<std::uint64_t> PhaseSlices::count_values(const Watch& watch) {
  std::vector<std::uint64_t> counts(values, 0);
  const auto [z0, z1] = crop_[2];
  for (int z = z0; z < z1; ++z) {
    if (watch) watch(double(z - z0) / (z1 - z0));
    image_->read(z, labels_);
    for (int y = crop_[1][0]; y < crop_[1][1]; ++y) {
      const std::uint16_t* row = labels_.data() + std::size_t(y) * std::size_t(image_->size()[0]);
      for (int x = crop_[0][0]; x < crop_[0][1]; ++x) ++counts[row[x]];
    }
  }
  return counts;
}

void PhaseSlices::choose_solid(const SolidRule& rule, const std::vector<std::uint64_t>& counts) {
  const auto distinct = std::size_t(std::ranges::count_if(counts, [](std::uint64_t n) { return n > 0; }));
  const auto all_from = [&](int value) {
    std::fill(is_solid_.begin() + value, is_solid_.end(), std::uint8_t(1));
  };
  if (const auto* named = std::get_if<SolidLabels>(&rule)) {
    for (const int label : named->labels) {
      if (label < 0 || label >= int(values) || counts[std::size_t(label)] == 0)
        throw InputError(fmt::format("{}: no voxel has the solid label {}; labels present: {}", name_, label,
                                     labels_present(counts)));
      is_solid_[std::size_t(label)] = 1;
    }
    rule_ = fmt::format("solid = {}", fmt::join(named->labels, ", "));
  } else if (const auto* from = std::get_if<SolidFrom>(&rule)) {
    if (from->value < 0 || from->value >= int(values))
      throw InputError(fmt::format("{}: threshold = {}; expected 0 to {}", name_, from->value, values - 1));
    all_from(from->value);
    rule_ = fmt::format("solid >= {}", from->value);
  } else if (distinct < 2) {
    throw InputError(
        fmt::format("{}: all voxels have the value {}; expected two phases. Use --solid if all are solid",
                    name_, labels_present(counts)));
  } else if (std::holds_alternative<OtsuThreshold>(rule)) {
    const int threshold = otsu_threshold(counts);
    all_from(threshold);
    rule_ = fmt::format("solid >= {} (Otsu)", threshold);
  } else {
    if (distinct > 2)
      throw InputError(
          fmt::format("{}: more than two labels: {}; expected --solid LABEL[,LABEL...] or --threshold", name_,
                      labels_present(counts)));
    int greater = int(values) - 1;
    while (counts[std::size_t(greater)] == 0) --greater;
    is_solid_[std::size_t(greater)] = 1;
    rule_ = fmt::format("solid = {}", greater);
  }

  std::uint64_t solid = 0, all = 0;
  for (std::size_t value = 0; value < values; ++value) {
    all += counts[value];
    if (is_solid_[value]) solid += counts[value];
  }
  if (solid == 0)
    throw InputError(
        fmt::format("{}: no voxel is solid ({}); values present: {}", name_, rule_, labels_present(counts)));
  solid_fraction_ = double(solid) / double(all);
}

void PhaseSlices::read(int k, std::vector<std::uint8_t>& solid) {
  const auto [nx, ny, nz] = size_;
  const int n = downsample_;
  std::vector<std::uint64_t> counts;
  solid.assign(std::size_t(nx) * std::size_t(ny), 0);
  if (n > 1) counts.assign(solid.size(), 0);
  for (int z = 0; z < n; ++z) {
    image_->read(crop_[2][0] + k * n + z, labels_);
    for (int y = 0; y < ny * n; ++y) {
      const std::uint16_t* row = labels_.data() +
                                 std::size_t(crop_[1][0] + y) * std::size_t(image_->size()[0]) +
                                 std::size_t(crop_[0][0]);
      const std::size_t first = std::size_t(y / n) * std::size_t(nx);
      if (z == 0 && y % n == 0)
        for (int i = 0; i < nx; ++i) solid[first + std::size_t(i)] = is_solid_[row[i * n]];
      if (n > 1)
        for (int x = 0; x < nx * n; ++x) counts[first + std::size_t(x / n)] += is_solid_[row[x]];
    }
  }
  // A block's first voxel stands already; it remains where both phases have half.
  const std::uint64_t block = std::uint64_t(n) * std::uint64_t(n) * std::uint64_t(n);
  for (std::size_t i = 0; i < counts.size(); ++i)
    if (2 * counts[i] != block) solid[i] = 2 * counts[i] > block;
}

int otsu_threshold(const std::vector<std::uint64_t>& counts) {
  double all = 0, sum = 0;
  for (std::size_t value = 0; value < counts.size(); ++value) {
    all += double(counts[value]);
    sum += double(value) * double(counts[value]);
  }
  double below = 0, sum_below = 0, best = -1;
  int threshold = 0;
  for (std::size_t value = 1; value < counts.size(); ++value) {
    below += double(counts[value - 1]);
    sum_below += double(value - 1) * double(counts[value - 1]);
    if (below == 0 || below == all) continue;
    const double difference = sum_below / below - (sum - sum_below) / (all - below);
    const double variance = below * (all - below) * difference * difference;
    if (variance > best) best = variance, threshold = int(value);
  }
  return threshold;
}

PhaseImage read_phase_image(PhaseSlices& slices, double voxel_size, const Watch& watch) {
  if (!(voxel_size > 0) || !std::isfinite(voxel_size))
    throw InputError(fmt::format("voxel size = {:g} m; expected a finite number > 0", voxel_size));
  PhaseImage image{slices.size(), voxel_size * slices.downsample(), {}};
  image.solid.reserve(image.count());
  std::vector<std::uint8_t> slice;
  for (int k = 0; k < image.size[2]; ++k) {
    if (watch) watch(double(k) / image.size[2]);
    slices.read(k, slice);
    image.solid.insert(image.solid.end(), slice.begin(), slice.end());
  }
  if (std::ranges::find(image.solid, 1) == image.solid.end())
    throw InputError(fmt::format("{}: no voxel is solid after downsampling by {}; expected a smaller number",
                                 slices.name(), slices.downsample()));
  return image;
}

}  // namespace anticrack
