#include "measures/clusters.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <filesystem>

#include "errors.h"
#include "expect_error.h"
#include "images/segmentation.h"
#include "measured_shapes.h"
#include "measures/geodesic.h"

namespace anticrack {
namespace {

PhaseImage sparse_noise(const Index3& size, int every) {
  std::uint32_t state = 1;
  return make_image(size, 1, [&](int, int, int) {
    state = state * 1664525u + 1013904223u;
    return (state >> 16) % 100 < std::uint32_t(every);
  });
}

// Plain flood fill, as another way to the same labels.
std::vector<std::uint32_t> flood_labels(const PhaseImage& image, Phase phase, Connectivity connectivity) {
  std::vector<std::uint32_t> labels(image.count(), 0);
  std::uint32_t number = 0;
  std::vector<Index3> stack;
  const auto [nx, ny, nz] = image.size;
  for (int k = 0; k < nz; ++k)
    for (int j = 0; j < ny; ++j)
      for (int i = 0; i < nx; ++i) {
        if (!image.is(phase, image.offset(i, j, k)) || labels[image.offset(i, j, k)]) continue;
        labels[image.offset(i, j, k)] = ++number;
        stack.push_back({i, j, k});
        while (!stack.empty()) {
          const auto [x, y, z] = stack.back();
          stack.pop_back();
          for (int n = 0; n < 27; ++n) {
            const int a = n % 3 - 1, b = n / 3 % 3 - 1, c = n / 9 - 1;
            if (connectivity == Connectivity::faces && std::abs(a) + std::abs(b) + std::abs(c) != 1) continue;
            const int u = x + a, v = y + b, w = z + c;
            if (u < 0 || v < 0 || w < 0 || u >= nx || v >= ny || w >= nz) continue;
            const std::size_t to = image.offset(u, v, w);
            if (!image.is(phase, to) || labels[to]) continue;
            labels[to] = number;
            stack.push_back({u, v, w});
          }
        }
      }
  return labels;
}

TEST(Clusters, AreThoseOfAFloodFillInBothConnectivitiesAndPhases) {
  // Near both thresholds (0.31 and 0.10) clusters are most ramified; three slabs and a rest.
  for (const int percent : {10, 31, 60}) {
    const PhaseImage image = sparse_noise({37, 29, 53}, percent);
    for (const Phase phase : {Phase::solid, Phase::pore})
      for (const Connectivity connectivity : {Connectivity::faces, Connectivity::corners}) {
        const Clusters found = find_clusters(image, phase, connectivity);
        EXPECT_EQ(found.labels, flood_labels(image, phase, connectivity)) << percent;
        std::uint64_t voxels = 0;
        for (const Cluster& cluster : found.clusters) voxels += cluster.voxels;
        EXPECT_EQ(voxels, std::uint64_t(std::count(image.solid.begin(), image.solid.end(), int(phase))));
      }
  }
}

TEST(Clusters, AreTheSameOnAnyNumberOfThreads) {
  const PhaseImage image = sparse_noise({40, 40, 100}, 31);
  const Clusters many = find_clusters(image, Phase::solid, Connectivity::faces);
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  EXPECT_EQ(find_clusters(image, Phase::solid, Connectivity::faces).labels, many.labels);
}

TEST(Clusters, TellApartVoxelsThatShareAFaceAnEdgeOrACorner) {
  const auto clusters_of_two = [](const Index3& other, Connectivity connectivity) {
    const PhaseImage image = make_image({3, 3, 3}, 1, [&](int i, int j, int k) {
      return (Index3{i, j, k} == Index3{1, 1, 1}) || (Index3{i, j, k} == other);
    });
    return find_clusters(image, Phase::solid, connectivity).clusters.size();
  };
  for (int n = 0; n < 27; ++n) {
    const Index3 other{n % 3, n / 3 % 3, n / 9};
    const int apart = std::abs(other[0] - 1) + std::abs(other[1] - 1) + std::abs(other[2] - 1);
    EXPECT_EQ(clusters_of_two(other, Connectivity::faces), apart > 1 ? 2u : 1u);
    EXPECT_EQ(clusters_of_two(other, Connectivity::corners), 1u);
  }
}

TEST(Clusters, KnowTheFacesTheyTouchAndTheLargest) {
  // A pillar along z in a corner, a plate across x and y within, a lone voxel.
  const PhaseImage image = make_image({9, 8, 7}, 1, [](int i, int j, int k) {
    return (i == 0 && j == 0) || (k == 3 && i >= 2 && j >= 2) || (i == 8 && j == 0 && k == 0);
  });
  const Clusters found = find_clusters(image, Phase::solid, Connectivity::corners);
  ASSERT_EQ(found.clusters.size(), 3u);
  EXPECT_EQ(found.clusters[0].voxels, 7u);
  EXPECT_EQ(found.clusters[0].faces, 1 | 4 | 16 | 32);
  EXPECT_EQ(found.clusters[1].faces, 2 | 4 | 16);
  EXPECT_EQ(found.clusters[2].voxels, 42u);
  EXPECT_EQ(found.clusters[2].faces, 2 | 8);
  EXPECT_EQ(found.largest(), 2u);
  EXPECT_EQ(found.spanning_voxels(SpanningRule::z), 7u);
  EXPECT_EQ(found.spanning_voxels(SpanningRule::x), 0u);
  EXPECT_EQ(found.spanning_voxels(SpanningRule::six_faces), 0u);
}

TEST(Clusters, OfAnAbsentPhaseAreNone) {
  const PhaseImage image = make_image({3, 3, 3}, 1, [](int, int, int) { return true; });
  const Clusters found = find_clusters(image, Phase::pore, Connectivity::faces);
  EXPECT_TRUE(found.clusters.empty());
  EXPECT_FALSE(found.largest());
}

TEST(Clusters, OfTheBereaScanAreExact) {
  PhaseSlices slices(open_image(ANTICRACK_ASSETS "/scans/berea.tif"), "berea.tif", {});
  const PhaseImage image = read_phase_image(slices, 5.345e-6);
  const Clusters pores = find_clusters(image, Phase::pore, Connectivity::faces);
  std::uint64_t voxels = 0;
  for (const Cluster& cluster : pores.clusters) voxels += cluster.voxels;
  EXPECT_EQ(voxels, 12572994u);
  EXPECT_EQ(pores.clusters.size(), 2741u);
  EXPECT_EQ(pores.spanning_voxels(SpanningRule::six_faces), 12494082u);
}

TEST(Cleaning, KeepsWhatBelongsToASpanningClusterAndNothingElse) {
  const PhaseImage image = make_image({9, 8, 7}, 1, [](int i, int j, int k) {
    return (i == 0 && j == 0) || (k == 3 && i >= 2 && j >= 2) || (i == 8 && j == 0 && k == 0);
  });
  const CleanedImage cleaned = remove_unconnected(image, SpanningRule::z, Connectivity::corners);
  EXPECT_EQ(cleaned.image.solid,
            make_image({9, 8, 7}, 1, [](int i, int j, int) { return i == 0 && j == 0; }).solid);
  EXPECT_EQ(cleaned.removed_clusters, 2u);
  EXPECT_DOUBLE_EQ(cleaned.solid_fraction, 50.0 / 504);
  EXPECT_DOUBLE_EQ(cleaned.connected_solid_fraction, 7.0 / 504);
}

TEST(Cleaning, RefusesASampleThatDoesNotPercolate) {
  const PhaseImage image = ball_image(9, 4, 1);
  EXPECT_ERROR(remove_unconnected(image, SpanningRule::six_faces, Connectivity::faces), InputError,
               "no cluster of the solid spans the sample (six_faces): 1 clusters (6-connected), the largest");
  const PhaseImage empty = make_image({3, 3, 3}, 1, [](int, int, int) { return false; });
  EXPECT_ERROR(remove_unconnected(empty, SpanningRule::x, Connectivity::faces), InputError, "there is none");
}

// Refused by the size alone, before a voxel is looked at.
TEST(Clusters, OfMoreVoxelsThanLabelsCountAreRefused) {
  const PhaseImage image{{1 << 11, 1 << 11, 1 << 10}, 1, {}};
  EXPECT_ERROR(find_clusters(image, Phase::solid, Connectivity::faces), InputError,
               "clusters of 4294967296 voxels; expected fewer than 2^32 - 1");
}

TEST(Burning, LeavesTheClustersThatSpanAnAxis) {
  for (const std::uint64_t seed : {1, 2}) {
    const PhaseImage image = cut_of_field(65, 5, theoretical_threshold(Morphology::single_cut, 0.2), seed);
    const Clusters solid = find_clusters(image, Phase::solid, Connectivity::faces);
    for (int axis = 0; axis < 3; ++axis)
      EXPECT_EQ(burned_from_both_faces(image, Phase::solid, axis), solid.spanning_voxels(SpanningRule(axis)));
  }
}

}  // namespace
}  // namespace anticrack
