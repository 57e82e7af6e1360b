#include "io/solid_raster.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include "io_frame_samples.h"

namespace anticrack {
namespace {

using Voxel = std::array<int, 3>;

std::map<Voxel, double> values_by_voxel(const SolidRaster& raster,
                                        const std::vector<SolidRaster::Block>& blocks) {
  std::map<Voxel, double> values;
  for (std::size_t b = 0; b < blocks.size(); ++b)
    for (int voxel = 0; voxel < 512; ++voxel) {
      const Voxel at = {raster.origin[b][0] + voxel / 64, raster.origin[b][1] + voxel / 8 % 8,
                        raster.origin[b][2] + voxel % 8};
      if (raster.solid[b][voxel] > 0) values[at] = blocks[b][voxel];
    }
  return values;
}

TEST(SolidRaster, IsOneInsideTheUndeformedSolid) {
  std::vector<std::array<float, 3>> position;
  for (int i = -10; i < 10; ++i)
    for (int j = -10; j < 10; ++j)
      for (int k = -10; k < 10; ++k) position.push_back({(i + 0.5f) / 64, (j + 0.5f) / 64, (k + 0.5f) / 64});
  const SolidRaster raster = rasterize_solid(position, {}, 1.0 / 64);
  EXPECT_TRUE(raster.kappa.empty());
  const auto solid = values_by_voxel(raster, raster.solid);
  // A particle at the centre of a voxel gives it 3/4 and the next ones 1/8 along each axis; all exact in
  // floats.
  EXPECT_EQ(solid.at({0, 0, 0}), 1);
  EXPECT_EQ(solid.at({-9, 8, -9}), 1);
  EXPECT_EQ(solid.at({-10, 0, 0}), 7.0 / 8);
  EXPECT_EQ(solid.at({-11, 0, 0}), 1.0 / 8);
  EXPECT_EQ(solid.at({10, 10, 10}), 1.0 / 512);
  EXPECT_EQ(solid.size(), 22u * 22 * 22);
}

TEST(SolidRaster, EqualsTheSumOverAllParticles) {
  const Frame frame = sample_frame(11);
  const double h = frame.header.particle_spacing;
  const SolidRaster raster = rasterize_solid(frame.position, frame.kappa, h);

  const auto spline = [](double d) {
    d = std::abs(d);
    return d < 0.5 ? 0.75 - d * d : d < 1.5 ? 0.5 * (1.5 - d) * (1.5 - d) : 0;
  };
  std::map<Voxel, double> solid, solid_kappa;
  for (std::size_t p = 0; p < frame.id.size(); ++p) {
    Voxel nearest;
    for (int axis = 0; axis < 3; ++axis) nearest[axis] = int(std::floor(frame.position[p][axis] / h));
    for (int i = -2; i <= 2; ++i)
      for (int j = -2; j <= 2; ++j)
        for (int k = -2; k <= 2; ++k) {
          const Voxel at = {nearest[0] + i, nearest[1] + j, nearest[2] + k};
          double weight = 1;
          for (int axis = 0; axis < 3; ++axis) weight *= spline(frame.position[p][axis] / h - at[axis] - 0.5);
          solid[at] += weight;
          solid_kappa[at] += weight * frame.kappa[p];
        }
  }
  const auto raster_solid = values_by_voxel(raster, raster.solid);
  const auto raster_kappa = values_by_voxel(raster, raster.kappa);
  // Floats: some tens of terms below one, each rounded at 6e-8.
  for (const auto& [voxel, value] : solid) {
    const auto found = raster_solid.find(voxel);
    EXPECT_NEAR(found == raster_solid.end() ? 0 : found->second, value, 2e-6);
    if (value > 1e-3) {
      EXPECT_NEAR(raster_kappa.at(voxel), solid_kappa[voxel] / value, 1e-4);
    }
  }
  EXPECT_LE(raster_solid.size(), solid.size());
}

}  // namespace
}  // namespace anticrack
