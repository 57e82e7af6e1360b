#include "scan.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>

#include "errors.h"
#include "expect_error.h"

namespace anticrack {
namespace {

namespace fs = std::filesystem;

class Scan : public testing::Test {
 protected:
  Scan() : folder_(fs::path(testing::TempDir()) / ("anticrack_scan_" + std::to_string(::getpid()))) {
    fs::create_directories(folder_);
  }
  ~Scan() override { fs::remove_all(folder_); }

  fs::path write(const std::string& name, const std::string& bytes) const {
    std::ofstream(folder_ / name, std::ios::binary) << bytes;
    return folder_ / name;
  }

 private:
  fs::path folder_;
};

// An uncompressed grey TIFF of one strip a page, written by hand so that nothing but the format is relied on.
std::string tiff(const VoxelImage& image, int bits, bool big_endian) {
  std::string file;
  const auto number = [&](std::uint32_t value, int bytes) {
    for (int b = 0; b < bytes; ++b) file += char(value >> 8 * (big_endian ? bytes - 1 - b : b));
  };
  const auto entry = [&](int tag, int type, std::uint32_t value) {  // type 3: 16 bit, 4: 32 bit
    number(tag, 2), number(type, 2), number(1, 4), number(value, type == 3 ? 2 : 4);
    if (type == 3) number(0, 2);
  };
  const auto [nx, ny, nz] = image.size;
  const std::uint32_t page_bytes = nx * ny * bits / 8, entries = 9, directory_bytes = 2 + 12 * entries + 4;
  file = big_endian ? "MM" : "II";
  number(42, 2), number(8, 4);
  for (int k = 0; k < nz; ++k) {
    const auto start = std::uint32_t(file.size());
    number(entries, 2);
    entry(256, 4, nx), entry(257, 4, ny), entry(258, 3, bits), entry(259, 3, 1), entry(262, 3, 1);
    entry(273, 4, start + directory_bytes), entry(277, 3, 1), entry(278, 4, ny), entry(279, 4, page_bytes);
    number(k + 1 < nz ? start + directory_bytes + page_bytes : 0, 4);
    for (int n = 0; n < nx * ny; ++n) number(image.labels[k * nx * ny + n], bits / 8);
  }
  return file;
}

VoxelImage numbered(Index3 size, int step) {
  VoxelImage image{size, {}};
  for (int n = 0; n < size[0] * size[1] * size[2]; ++n) image.labels.push_back(std::uint16_t(n * step));
  return image;
}

TEST_F(Scan, ReadsTiffPagesOfEitherByteOrderAndDepth) {
  for (int bits : {8, 16}) {
    for (bool big_endian : {false, true}) {
      const VoxelImage expected = numbered({6, 4, 4}, bits == 8 ? 2 : 517);
      const VoxelImage got = read_voxel_image(write("stack.TIF", tiff(expected, bits, big_endian)));
      EXPECT_EQ(got.size, expected.size) << bits << big_endian;
      EXPECT_EQ(got.labels, expected.labels) << bits << big_endian;
    }
  }
}

TEST_F(Scan, ReadsRawBytesOfAGivenShape) {
  const fs::path file = write("scan.raw", std::string("\x00\x01\x02\x03\xff\x05", 6));
  const VoxelImage image = read_voxel_image(file, Index3{3, 2, 1});
  EXPECT_EQ(image.size, (Index3{3, 2, 1}));
  EXPECT_EQ(image.labels, (std::vector<std::uint16_t>{0, 1, 2, 3, 255, 5}));
  EXPECT_ERROR(read_voxel_image(file), InputError, "scan.raw: raw bytes need a shape [nx, ny, nz]");
  EXPECT_ERROR(read_voxel_image(file, Index3{3, 2, 2}), FileError,
               "scan.raw: 6 bytes; shape [3, 2, 2] needs 12");
  EXPECT_ERROR(read_voxel_image(file, Index3{-3, -2, 1}), InputError,
               "scan.raw: shape [-3, -2, 1]; expected 1 to 1048576 voxels along each axis");
}

TEST_F(Scan, RefusesDamagedFilesByName) {
  const std::string whole = tiff(numbered({5, 4, 3}, 1), 8, true);
  for (std::size_t length : {0, 3, 8, 60, 130, 200, int(whole.size()) - 1}) {
    const fs::path file = write("cut.tif", whole.substr(0, length));
    try {
      // libtiff takes a file cut between pages for a shorter stack; the shape tells.
      read_voxel_image(file, Index3{5, 4, 3});
      ADD_FAILURE() << "read " << length << " bytes of " << whole.size();
    } catch (const FileError& error) {
      EXPECT_NE(std::string(error.what()).find("cut.tif"), std::string::npos);
    }
  }
  EXPECT_ERROR(read_voxel_image("/nonexistent.tif"), FileError, "/nonexistent.tif: no such file");
  EXPECT_ERROR(read_voxel_image(write("text.tif", "not an image")), FileError,
               "text.tif: not a readable TIFF");
  EXPECT_ERROR(read_voxel_image(write("deep.tif", tiff(numbered({4, 4, 1}, 1), 32, false))), FileError,
               "deep.tif: page 0: 32 bits, 1 samples a pixel");
}

TEST(ScanPoints, LieAtTheCentresOfSolidVoxels) {
  const VoxelImage image{{2, 2, 2}, {7, 0, 0, 9, 0, 0, 0, 7}};
  const std::vector<int> solid = {7, 9};
  const std::vector<Vec3> points = scan_points(image, solid, 0.5);
  ASSERT_EQ(points.size(), 3u);
  EXPECT_EQ(points[0], Vec3(0.25, 0.25, 0.25));
  EXPECT_EQ(points[1], Vec3(0.75, 0.75, 0.25));
  EXPECT_EQ(points[2], Vec3(0.75, 0.75, 0.75));
}

TEST(ScanPoints, RefusesAScanWithoutSolid) {
  const VoxelImage image{{2, 1, 1}, {3, 5}};
  const std::vector<int> solid = {255, -4, 70000};
  EXPECT_ERROR(scan_points(image, solid, 1.0), InputError,
               "no voxel of the scan has a solid label [255, -4, 70000]; labels present: [3, 5]");
  const std::vector<int> three = {3};
  EXPECT_ERROR(scan_points(image, three, 0.0), InputError, "voxel size = 0 m; expected a finite number > 0");
}

}  // namespace
}  // namespace anticrack
