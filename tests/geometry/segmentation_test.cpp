#include "images/segmentation.h"

#include <gtest/gtest.h>

#include <random>

#include "errors.h"
#include "expect_error.h"
#include "geometry/image_files.h"
#include "images/scan.h"

namespace anticrack {
namespace {

/// An image in memory as a reader.
class LabelSlices : public SliceReader {
 public:
  explicit LabelSlices(Labels labels) : labels_(std::move(labels)) { size_ = labels_.size; }

  void read(int k, std::vector<std::uint16_t>& labels) override {
    const auto slice = std::ptrdiff_t(size_[0]) * size_[1];
    labels.assign(labels_.values.begin() + k * slice, labels_.values.begin() + (k + 1) * slice);
  }

 private:
  Labels labels_;
};

PhaseSlices segment(const Labels& labels, const Segmentation& segmentation) {
  return PhaseSlices(std::make_unique<LabelSlices>(labels), "a.tif", segmentation);
}

std::vector<std::uint8_t> solid_of(const Labels& labels, const Segmentation& segmentation) {
  PhaseSlices slices = segment(labels, segmentation);
  return read_phase_image(slices, 1.0).solid;
}

using Solid = std::vector<std::uint8_t>;

TEST(Segmentation, TakesLabelsThresholdOrTheGreaterOfTwo) {
  const Labels image{{3, 1, 2}, {0, 1, 2, 3, 2, 0}}, two{{2, 1, 2}, {5, 9, 9, 5}};
  EXPECT_EQ(solid_of(image, {.solid = SolidLabels{{1, 3}}}), (Solid{0, 1, 0, 1, 0, 0}));
  EXPECT_EQ(solid_of(image, {.solid = SolidFrom{2}}), (Solid{0, 0, 1, 1, 1, 0}));
  EXPECT_EQ(solid_of(two, {}), (Solid{0, 1, 1, 0}));
  EXPECT_EQ(segment(two, {}).rule(), "solid = 9");
  EXPECT_DOUBLE_EQ(segment(image, {.solid = SolidFrom{2}}).solid_fraction_of_image(), 0.5);
}

TEST(Segmentation, CropKeepsTheNamedPart) {
  const Labels image = numbered({4, 3, 5}, 1);
  const Segmentation part{.solid = SolidFrom{0}, .crop = {{{1, 3}, {0, 2}, {4, -1}}}};
  PhaseSlices slices = segment(image, part);
  EXPECT_EQ(slices.size(), (Index3{2, 2, 1}));
  // Values 49, 50, 53, 54 of the last slice.
  EXPECT_EQ(solid_of(image, {.solid = SolidLabels{{50, 53}}, .crop = part.crop}), (Solid{0, 1, 1, 0}));
}

TEST(Segmentation, DownsamplesByMajorityAndTiesFollowTheFirstVoxel) {
  Labels image{{4, 2, 2},
               {1, 1, 0, 1,  //
                1, 0, 0, 1,  //
                0, 0, 1, 1,  //
                1, 0, 0, 0}};
  EXPECT_EQ(solid_of(image, {.downsample = 2}),
            (Solid{1, 0}));  // four of eight each: as at (0,0,0) and (2,0,0)
  image.values[8] = 1;       // five of eight
  EXPECT_EQ(solid_of(image, {.downsample = 2}), (Solid{1, 0}));
  image.values = {0, 1, 0, 1, 1, 1, 0, 1, 1, 1, 0, 0, 0, 0, 0, 0};  // five solid although the first is pore
  EXPECT_EQ(solid_of(image, {.downsample = 2}), (Solid{1, 0}));
  PhaseSlices odd = segment(numbered({7, 5, 9}, 1), {.solid = SolidFrom{1}, .downsample = 3});
  EXPECT_EQ(odd.size(), (Index3{2, 1, 3}));
  EXPECT_EQ(read_phase_image(odd, 2.0).voxel_size, 6.0);
}

// Pore and solid exchanged, the result is exchanged: a rule that prefers a phase would not pass.
TEST(Segmentation, DownsamplingPrefersNoPhase) {
  std::mt19937 random(1);
  Labels image{{24, 24, 24}, {}};
  for (int n = 0; n < 24 * 24 * 24; ++n) image.values.push_back(random() % 2);
  Solid solid = solid_of(image, {.downsample = 2});
  for (std::uint16_t& value : image.values) value = 1 - value;
  for (std::uint8_t& voxel : solid) voxel = 1 - voxel;
  EXPECT_EQ(solid_of(image, {.downsample = 2}), solid);
}

TEST(Segmentation, OtsuMaximizesTheVarianceBetweenClasses) {
  std::vector<std::uint64_t> counts(65536, 0);
  counts[10] = 30, counts[12] = 30, counts[200] = 20, counts[1000] = 20;
  // By hand: split at 11..12: classes {10}, {12, 200, 1000}; at 13..200: means 11 and 600; at 201..1000:
  // means 58.25 and 1000. w0 w1 d^2: 0.3 0.7 339.1^2 = 24151; 0.6 0.4 589^2 = 83261; 0.8 0.2 941.75^2 =
  // 141903.
  EXPECT_EQ(otsu_threshold(counts), 201);
  const Labels image{{4, 1, 1}, {10, 12, 90, 95}};
  EXPECT_EQ(solid_of(image, {.solid = OtsuThreshold{}}), (Solid{0, 0, 1, 1}));
  EXPECT_EQ(segment(image, {.solid = OtsuThreshold{}}).rule(), "solid >= 13 (Otsu)");
}

TEST(Segmentation, RefusesWhatNamesNoSolid) {
  const Labels three{{3, 1, 1}, {0, 128, 255}}, one{{2, 1, 1}, {7, 7}};
  const auto expect = [](const Labels& image, const Segmentation& segmentation, const std::string& message) {
    EXPECT_ERROR(segment(image, segmentation), InputError, message);
  };
  expect(three, {},
         "a.tif: more than two labels: 0, 128, 255; expected --solid LABEL[,LABEL...] or --threshold");
  expect(numbered({4, 4, 1}, 1), {}, "more than two labels: 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, ... (16 in all)");
  expect(three, {.solid = SolidLabels{{128, 3}}},
         "a.tif: no voxel has the solid label 3; labels present: 0, 128, 255");
  expect(three, {.solid = SolidLabels{{70000}}}, "no voxel has the solid label 70000");
  expect(three, {.solid = SolidFrom{256}},
         "a.tif: no voxel is solid (solid >= 256); values present: 0, 128, 255");
  expect(three, {.solid = SolidFrom{70000}}, "threshold = 70000; expected 0 to 65535");
  expect(one, {}, "a.tif: all voxels have the value 7; expected two phases. Use --solid if all are solid");
  expect(one, {.solid = OtsuThreshold{}}, "all voxels have the value 7; expected two phases");
  expect(three, {.crop = {{{0, 4}, {0, -1}, {0, -1}}}}, "a.tif: crop 0:4 along x; expected a part of 0:3");
  expect(three, {.crop = {{{2, 2}, {0, -1}, {0, -1}}}}, "a.tif: crop 2:2 along x; expected a part of 0:3");
  expect(three, {.downsample = 2}, "a.tif: downsample = 2; expected 1 to the 1 voxels along y");
  const Labels dot{{2, 2, 2}, {0, 0, 0, 1, 0, 0, 0, 0}};
  PhaseSlices vanishing = segment(dot, {.downsample = 2});
  EXPECT_ERROR(read_phase_image(vanishing, 1.0), InputError,
               "a.tif: no voxel is solid after downsampling by 2; expected a smaller number");
  EXPECT_ERROR(read_phase_image(vanishing, 0.0), InputError,
               "voxel size = 0 m; expected a finite number > 0");
}

TEST(ScanPoints, LieAtTheCentresOfSolidVoxels) {
  const std::vector<Vec3> points = scan_points({{2, 2, 2}, 0.5, {1, 0, 0, 1, 0, 0, 0, 1}});
  ASSERT_EQ(points.size(), 3u);
  EXPECT_EQ(points[0], Vec3(0.25, 0.25, 0.25));
  EXPECT_EQ(points[1], Vec3(0.75, 0.75, 0.25));
  EXPECT_EQ(points[2], Vec3(0.75, 0.75, 0.75));
}

}  // namespace
}  // namespace anticrack
