#include "images/image_level_set.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <functional>

#include "errors.h"
#include "expect_error.h"
#include "images/scan.h"
#include "level_sets/level_set.h"
#include "level_sets/surface_mesh.h"

namespace anticrack {
namespace {

/// The image {solid(i, j, k)} as labels 0 and 1.
class Shape : public SliceReader {
 public:
  Shape(Index3 size, std::function<bool(int, int, int)> solid) : solid_(std::move(solid)) { size_ = size; }

  void read(int k, std::vector<std::uint16_t>& labels) override {
    labels.clear();
    for (int j = 0; j < size_[1]; ++j)
      for (int i = 0; i < size_[0]; ++i) labels.push_back(solid_(i, j, k));
  }

 private:
  std::function<bool(int, int, int)> solid_;
};

PhaseSlices slices_of_shape(Index3 size, std::function<bool(int, int, int)> solid, int downsample = 1) {
  return PhaseSlices(std::make_unique<Shape>(size, std::move(solid)), "shape",
                     {.solid = SolidLabels{{1}}, .downsample = downsample});
}

std::function<bool(int, int, int)> ball(double centre, double radius) {
  return [=](int i, int j, int k) { return (Vec3(i, j, k) - Vec3::Constant(centre)).norm() < radius; };
}

PhaseSlices berea(const std::array<std::array<int, 2>, 3>& crop) {
  return PhaseSlices(open_image(ANTICRACK_ASSETS "/scans/berea.tif"), "berea.tif", {.crop = crop});
}

constexpr std::array<std::array<int, 2>, 3> berea_corner = {{{0, 72}, {0, 72}, {0, 72}}};

/// Errors of the distance [voxels] at lattice points within `reach` of a ball's surface; the ball lies within
/// the box.
struct DistanceError {
  double rms = 0, largest = 0, mean = 0;
};

DistanceError error_at_ball(const std::function<double(int, int, int)>& distance, int size, double centre,
                            double radius, double reach) {
  DistanceError error;
  double squares = 0;
  int count = 0;
  for (int k = 0; k < size; ++k)
    for (int j = 0; j < size; ++j)
      for (int i = 0; i < size; ++i) {
        const double exact = (Vec3(i, j, k) - Vec3::Constant(centre)).norm() - radius;
        if (std::abs(exact) > reach) continue;
        const double d = distance(i, j, k) - exact;
        squares += d * d, error.mean += d, ++count;
        error.largest = std::max(error.largest, std::abs(d));
      }
  error.rms = std::sqrt(squares / count), error.mean /= count;
  return error;
}

// Distance [voxels] to the voxel faces between solid and pore, the raw stairs, from a voxel's centre.
double distance_to_stairs(const std::function<bool(int, int, int)>& solid, int i, int j, int k) {
  constexpr int reach = 4;
  const bool here = solid(i, j, k);
  double least = reach;
  for (int dk = -reach; dk <= reach; ++dk)
    for (int dj = -reach; dj <= reach; ++dj)
      for (int di = -reach; di <= reach; ++di) {
        if (solid(i + di, j + dj, k + dk) == here) continue;
        // The nearest point of that voxel's cube.
        const Vec3 way = (Vec3(std::abs(di), std::abs(dj), std::abs(dk)) - Vec3::Constant(0.5)).cwiseMax(0.0);
        least = std::min(least, way.norm());
      }
  return here ? -least : least;
}

DistanceError error_of_level_set(double radius, const ImageSmoothing& smoothing) {
  const int size = 2 * int(radius) + 12;
  const double centre = size / 2 + 0.3;
  PhaseSlices slices = slices_of_shape({size, size, size}, ball(centre, radius));
  const Microstructure structure = build_image_level_set(slices, 1.0, {}, smoothing);
  const auto voxels = structure.surface->grid->getConstAccessor();
  const auto distance = [&](int i, int j, int k) { return double(voxels.getValue(openvdb::Coord(i, j, k))); };
  return error_at_ball(distance, size, centre, radius, 2.0);
}

// The table of geometry/README.md.
TEST(ImageLevelSet, OfABallIsMoreThanTwiceAsNearAsItsStairs) {
  for (const double radius : {5.0, 10.0, 20.0, 40.0}) {
    const int size = 2 * int(radius) + 12;
    const double centre = size / 2 + 0.3;
    const DistanceError stairs =
        error_at_ball([&](int i, int j, int k) { return distance_to_stairs(ball(centre, radius), i, j, k); },
                      size, centre, radius, 2.0);
    std::printf("radius %2.0f  stairs: rms %.3f largest %.3f mean %+.3f\n", radius, stairs.rms,
                stairs.largest, stairs.mean);
    for (const double sigma : {0.75, 1.0, 1.25, 1.5, 2.0}) {
      const DistanceError error = error_of_level_set(radius, {.sigma = sigma});
      std::printf("  sigma %.2f: rms %.3f largest %.3f mean %+.3f\n", sigma, error.rms, error.largest,
                  error.mean);
    }
    EXPECT_LT(error_of_level_set(radius, {}).rms, 0.4 * stairs.rms) << radius;
  }
}

void expect_signs_are_labels(PhaseSlices& slices) {
  const PhaseImage image = read_phase_image(slices, 5.345e-6);
  const Microstructure structure = build_image_level_set(slices, 5.345e-6);
  EXPECT_EQ(structure.solid_points, std::size_t(std::count(image.solid.begin(), image.solid.end(), 1)));
  const auto voxels = structure.surface->grid->getConstAccessor();
  const auto [nx, ny, nz] = image.size;
  std::size_t wrong = 0, solid_outside = 0;
  for (int k = -4; k < nz + 4; ++k)
    for (int j = -4; j < ny + 4; ++j)
      for (int i = -4; i < nx + 4; ++i) {
        const bool is_solid = voxels.getValue(openvdb::Coord(i, j, k)) < 0;
        if (i >= 0 && j >= 0 && k >= 0 && i < nx && j < ny && k < nz)
          wrong += is_solid != (image.solid[image.offset(i, j, k)] == 1);
        else
          solid_outside += is_solid;
      }
  EXPECT_EQ(wrong, 0u);
  EXPECT_EQ(solid_outside, 0u);
  EXPECT_EQ(phase_image_of(structure).solid, image.solid);
}

TEST(ImageLevelSet, HasTheSignOfTheLabelAtEveryVoxelOfARock) {
  PhaseSlices slices = berea(berea_corner);
  expect_signs_are_labels(slices);
}

// Single voxels, plates, a checkerboard, noise: what smoothing would flip or erase.
TEST(ImageLevelSet, HasTheSignOfTheLabelWhereStructureIsAsFineAsAVoxel) {
  const std::function<bool(int, int, int)> shapes[] = {
      [](int i, int j, int k) { return (i + j + k) % 2 == 0; }, [](int i, int, int) { return i % 3 == 0; },
      [](int i, int j, int k) { return i == 10 && j == 10 && k == 10; },
      [](int i, int j, int k) { return !(i == 10 && j == 10 && k == 10); },
      [](int i, int j, int k) {
        return (std::uint32_t(i * 73856093 ^ j * 19349663 ^ k * 83492791) * 2654435761u) >> 31;
      }};
  for (const auto& shape : shapes) {
    PhaseSlices slices = slices_of_shape({21, 22, 23}, shape);
    expect_signs_are_labels(slices);
  }
}

double volume_of_mesh(const Microstructure& structure) {
  const SurfaceMesh mesh = mesh_surface(structure);
  double six_volumes = 0;
  for (const auto& [a, b, c] : mesh.triangles) {
    const Vec3 p = mesh.points[a].cast<double>(), q = mesh.points[b].cast<double>(),
               r = mesh.points[c].cast<double>();
    six_volumes += p.dot(q.cross(r));
  }
  return six_volumes / 6;
}

TEST(ImageLevelSet, MeshesToTheVolumeOfTheBallThatWasVoxelized) {
  constexpr int size = 40;
  const double centre = 19.6, radius = 14.0;
  PhaseSlices slices = slices_of_shape({size, size, size}, ball(centre, radius));
  const Microstructure imported = build_image_level_set(slices, 1e-3);

  PaddedField excess{{size, size, size}, {}};
  excess.values.resize(excess.offset(size + 2, size + 2, size + 2) + 1);
  for (int k = -3; k < size + 3; ++k)
    for (int j = -3; j < size + 3; ++j)
      for (int i = -3; i < size + 3; ++i)
        excess.values[excess.offset(i, j, k)] =
            float(radius - (Vec3(i, j, k) - Vec3::Constant(centre)).norm());
  Microstructure exact = imported;
  exact.surface = std::make_shared<LevelSet>(build_level_set(excess, 1e-3));

  // The surface's mean shift is at most the rms error of the table above, 0.098 voxel at radius 10.
  EXPECT_NEAR(volume_of_mesh(imported) / volume_of_mesh(exact), 1.0, 3 * 0.098 / radius);
}

TEST(ImageLevelSet, BuiltBySlabsIsThatOfOnePiece) {
  PhaseSlices slices = berea(berea_corner);
  const Microstructure whole = build_image_level_set(slices, 1.0, {}, {}, 80);
  for (const int thickness : {8, 24, 32}) {
    const Microstructure slabs = build_image_level_set(slices, 1.0, {}, {}, thickness);
    EXPECT_EQ(slabs.solid_points, whole.solid_points);
    EXPECT_EQ(slabs.surface->grid->activeVoxelCount(), whole.surface->grid->activeVoxelCount()) << thickness;
    EXPECT_TRUE(slabs.surface->grid->tree().hasSameTopology(whole.surface->grid->tree())) << thickness;
    const auto voxels = slabs.surface->grid->getConstAccessor();
    double largest = 0;
    for (auto value = whole.surface->grid->cbeginValueAll(); value; ++value)
      largest = std::max(largest, std::abs(double(*value) - voxels.getValue(value.getCoord())));
    EXPECT_EQ(largest, 0.0) << thickness;
  }
}

TEST(ImageLevelSet, IsStoppedByItsWatchWithinASlab) {
  struct Stop {};
  PhaseSlices slices = slices_of_shape({90, 90, 90}, ball(44, 30));
  ASSERT_GE(slab_thickness(slices.size()), 90);
  std::vector<double> calls;
  const auto watch = [&](double done) {
    calls.push_back(done);
    if (done > 0.5) throw Stop();
  };
  EXPECT_THROW(build_image_level_set(slices, 1.0, watch), Stop);
  EXPECT_GT(calls.size(), 2u);
  EXPECT_LT(calls.back(), 1.0);
  EXPECT_TRUE(std::ranges::is_sorted(calls));
}

TEST(ImageLevelSet, SlabsFollowFromTheSizeAlone) {
  EXPECT_EQ(slab_thickness({400, 400, 400}) % 8, 0);
  EXPECT_GE(slab_thickness({100, 100, 5000}), 1000);
  EXPECT_EQ(slab_thickness({4000, 4000, 4000}), 32);
  // 8.6e9 voxels: a slab of 54 planes, and the band.
  EXPECT_LT(image_level_set_memory({2048, 2048, 2048}), 50e9);
}

TEST(ImageLevelSet, RecordsHowItWasMade) {
  PhaseSlices slices = berea({{{0, 24}, {8, 32}, {0, 24}}});
  const Microstructure structure = build_image_level_set(slices, 5.345e-6);
  EXPECT_EQ(std::get<std::string>(structure.metadata.at("source")), "scan");
  EXPECT_EQ(std::get<std::string>(structure.metadata.at("segmentation")), "solid = 255");
  EXPECT_EQ(std::get<std::string>(structure.metadata.at("crop")), "0:24,8:32,0:24");
  EXPECT_EQ(std::get<double>(structure.metadata.at("voxel_size")), 5.345e-6);
  EXPECT_EQ(std::get<std::int64_t>(structure.metadata.at("downsample")), 1);
  EXPECT_EQ(std::get<double>(structure.metadata.at("solid_fraction_achieved")), structure.solid_fraction());
  EXPECT_EQ(structure.lattice.spacing, 5.345e-6);
  EXPECT_ERROR(build_image_level_set(slices, -1), InputError,
               "voxel size = -1 m; expected a finite number > 0");
}

TEST(ImageLevelSet, IsRefusedWhereDownsamplingLeavesNoSolid) {
  PhaseSlices slices = slices_of_shape(
      {8, 8, 8}, [](int i, int j, int k) { return i == 3 && j == 3 && k == 3; }, 2);
  EXPECT_ERROR(build_image_level_set(slices, 1), InputError,
               "shape: no voxel is solid after downsampling by 2; expected a smaller number");
}

TEST(BereaScan, HasTheKnownNumberOfPoreVoxels) {
  PhaseSlices slices = berea({{{0, -1}, {0, -1}, {0, -1}}});
  const PhaseImage image = read_phase_image(slices, 1.0);
  EXPECT_EQ(image.size, (Index3{400, 400, 400}));
  EXPECT_EQ(std::count(image.solid.begin(), image.solid.end(), 0), 12572994);
}

}  // namespace
}  // namespace anticrack
