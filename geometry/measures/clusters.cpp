#include "measures/clusters.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <bit>

#include "errors.h"

namespace anticrack {
namespace {

using Label = std::uint32_t;

constexpr Label other_phase = ~Label(0);
constexpr int slab_thickness = 16;  // planes that one task joins

// Union-find within the labels: each voxel holds the offset of an earlier voxel of its cluster, the first its
// own.
class Forest {
 public:
  Forest(const PhaseImage& image, Phase phase, std::vector<Label>& parents)
      : image_(image), phase_(phase), parents_(parents) {}

  // Every voxel of the row points to the first of its stretch.
  void link_row(int j, int k) {
    const std::size_t begin = image_.offset(0, j, k);
    Label first = other_phase;
    for (int i = 0; i < image_.size[0]; ++i) {
      if (!image_.is(phase_, begin + i))
        first = other_phase;
      else if (first == other_phase)
        first = Label(begin + i);
      parents_[begin + i] = first;
    }
  }

  // Joins a row to another one, whose voxels i + shift are neighbours of i; once a stretch.
  void join_rows(std::size_t row, std::size_t other, int shift) {
    const int end = image_.size[0] - std::max(shift, 0);
    bool joined = false;
    for (int i = std::max(-shift, 0); i < end; ++i) {
      const bool both = image_.is(phase_, row + i) && image_.is(phase_, other + i + shift);
      if (both && !joined) join(Label(row + i), Label(other + i + shift));
      joined = both;
    }
  }

  void join_planes(int k, Connectivity connectivity) {
    const int reach = connectivity == Connectivity::corners ? 1 : 0;
    for (int j = 0; j < image_.size[1]; ++j)
      for (int dj = std::max(j - reach, 0); dj <= std::min(j + reach, image_.size[1] - 1); ++dj)
        for (int shift = -reach; shift <= reach; ++shift)
          join_rows(image_.offset(0, j, k), image_.offset(0, dj, k - 1), shift);
  }

  void join_rows_of_plane(int k, Connectivity connectivity) {
    const int reach = connectivity == Connectivity::corners ? 1 : 0;
    for (int j = 1; j < image_.size[1]; ++j)
      for (int shift = -reach; shift <= reach; ++shift)
        join_rows(image_.offset(0, j, k), image_.offset(0, j - 1, k), shift);
  }

 private:
  Label first_of(Label voxel) {
    while (parents_[voxel] != voxel) voxel = parents_[voxel] = parents_[parents_[voxel]];
    return voxel;
  }

  void join(Label a, Label b) {
    a = first_of(a);
    b = first_of(b);
    parents_[std::max(a, b)] = std::min(a, b);
  }

  const PhaseImage& image_;
  Phase phase_;
  std::vector<Label>& parents_;
};

// Numbers the trees by their first voxels. A parent comes before its voxel, so it has its label already.
std::vector<Cluster> label_clusters(const Index3& size, std::vector<Label>& labels) {
  std::vector<Cluster> clusters;
  std::size_t voxel = 0;
  for (int k = 0; k < size[2]; ++k)
    for (int j = 0; j < size[1]; ++j) {
      const int row_faces =
          (j == 0 ? 4 : 0) | (j == size[1] - 1 ? 8 : 0) | (k == 0 ? 16 : 0) | (k == size[2] - 1 ? 32 : 0);
      for (int i = 0; i < size[0]; ++i, ++voxel) {
        Label& label = labels[voxel];
        if (label == other_phase) {
          label = 0;
          continue;
        }
        if (label == voxel) clusters.emplace_back();
        label = label == voxel ? Label(clusters.size()) : labels[label];
        Cluster& cluster = clusters[label - 1];
        ++cluster.voxels;
        cluster.faces |= std::uint8_t(row_faces | (i == 0 ? 1 : 0) | (i == size[0] - 1 ? 2 : 0));
      }
    }
  return clusters;
}

}  // namespace

std::optional<std::size_t> Clusters::largest() const {
  if (clusters.empty()) return std::nullopt;
  return std::size_t(std::ranges::max_element(clusters, {}, &Cluster::voxels) - clusters.begin());
}

std::uint64_t Clusters::spanning_voxels(SpanningRule rule) const {
  std::uint64_t sum = 0;
  for (const Cluster& cluster : clusters)
    if (cluster.spans(rule)) sum += cluster.voxels;
  return sum;
}

Clusters find_clusters(const PhaseImage& image, Phase phase, Connectivity connectivity) {
  if (image.count() >= other_phase)
    throw InputError(fmt::format("clusters of {} voxels; expected fewer than 2^32 - 1", image.count()));
  Clusters result;
  result.labels.resize(image.count());
  Forest forest(image, phase, result.labels);

  // Slabs of their own first, then the seams between them.
  const int planes = image.size[2], slabs = (planes + slab_thickness - 1) / slab_thickness;
  tbb::parallel_for(0, slabs, [&](int slab) {
    const int first = slab * slab_thickness;
    for (int k = first; k < std::min(first + slab_thickness, planes); ++k) {
      for (int j = 0; j < image.size[1]; ++j) forest.link_row(j, k);
      forest.join_rows_of_plane(k, connectivity);
      if (k > first) forest.join_planes(k, connectivity);
    }
  });
  for (int slab = 1; slab < slabs; ++slab) forest.join_planes(slab * slab_thickness, connectivity);
  result.clusters = label_clusters(image.size, result.labels);
  return result;
}

std::string name_of(SpanningRule rule) {
  constexpr const char* names[] = {"x", "y", "z", "six_faces"};
  return names[int(rule)];
}

CleanedImage remove_unconnected(const PhaseImage& image, SpanningRule rule, Connectivity connectivity) {
  const Clusters solid = find_clusters(image, Phase::solid, connectivity);
  CleanedImage result{image, 0, solid.spanning_voxels(rule), 0, 0, 0};
  for (const Cluster& cluster : solid.clusters) {
    result.solid_voxels += cluster.voxels;
    result.removed_clusters += !cluster.spans(rule);
  }
  if (result.connected_voxels == 0) {
    const std::string facts =
        solid.clusters.empty()
            ? "there is none"
            : fmt::format("{} clusters ({}-connected), the largest of {} voxels touches {} of the six faces",
                          solid.clusters.size(), int(connectivity), solid.clusters[*solid.largest()].voxels,
                          std::popcount(solid.clusters[*solid.largest()].faces));
    throw InputError(
        fmt::format("no cluster of the solid spans the sample ({}): {}; solid fraction {:.6f}. Take a larger "
                    "solid fraction, "
                    "another seed or another rule.",
                    name_of(rule), facts, double(result.solid_voxels) / double(image.count())));
  }
  tbb::parallel_for(std::size_t(0), image.count(), [&](std::size_t voxel) {
    const Label label = solid.labels[voxel];
    if (label != 0 && !solid.clusters[label - 1].spans(rule)) result.image.solid[voxel] = 0;
  });
  result.solid_fraction = double(result.solid_voxels) / double(image.count());
  result.connected_solid_fraction = double(result.connected_voxels) / double(image.count());
  return result;
}

}  // namespace anticrack
