#include "images/write_image.h"

#include <gtest/gtest.h>

#include <cstring>
#include <random>

#include "errors.h"
#include "expect_error.h"
#include "images/segmentation.h"
#include "images/write_mesh.h"
#include "io_test_folder.h"

namespace anticrack {
namespace {

namespace fs = std::filesystem;

PhaseImage random_image(Index3 size) {
  PhaseImage image{size, 5.345e-6, {}};
  std::mt19937 random(7);
  for (std::size_t n = 0; n < image.count(); ++n) image.solid.push_back(random() % 3 > 0);
  return image;
}

class WriteImage : public IoTest {};

TEST_F(WriteImage, ReadsBackToTheBitInEveryFormat) {
  const PhaseImage image = random_image({13, 11, 12});
  for (const std::string name :
       {"a.tif", "a.tiff", "a.raw", "a.nrrd", "a.mhd", "a.mha", "a.npy", "slices/"}) {
    write_image(slices_of(image), folder / name);
    RawLayout raw;
    if (name == "a.raw") raw.shape = image.size;
    PhaseSlices slices(open_image(folder / name, raw), name, {.solid = SolidLabels{{255}}});
    const PhaseImage back = read_phase_image(slices, image.voxel_size);
    EXPECT_EQ(back.size, image.size) << name;
    EXPECT_EQ(back.solid, image.solid) << name;
  }
  EXPECT_TRUE(fs::exists(folder / "slices/slice_0011.tif"));
}

// VTK ImageData holds the voxels behind the underscore: their number of bytes in 8 bytes, then they.
TEST_F(WriteImage, VtkHoldsVoxelsAsCells) {
  const PhaseImage image = random_image({3, 4, 5});
  write_image(slices_of(image), folder / "a.vti");
  const std::string text = file_content(folder / "a.vti");
  EXPECT_NE(
      text.find("WholeExtent=\"0 3 0 4 0 5\" Origin=\"0 0 0\" Spacing=\"5.345e-06 5.345e-06 5.345e-06\""),
      std::string::npos);
  const std::size_t at = text.find("\n_") + 2;
  std::uint64_t bytes = 0;
  std::memcpy(&bytes, &text[at], 8);
  ASSERT_EQ(bytes, 60u);
  for (std::size_t n = 0; n < 60; ++n) EXPECT_EQ(std::uint8_t(text[at + 8 + n]), image.solid[n] ? 255 : 0);
  EXPECT_EQ(text.substr(at + 68), "\n</AppendedData>\n</VTKFile>\n");
}

TEST_F(WriteImage, NumPyVoxelsBeginAtAMultipleOf64) {
  const PhaseImage image = random_image({3, 4, 5});
  write_image(slices_of(image), folder / "a.npy");
  EXPECT_EQ((fs::file_size(folder / "a.npy") - 60) % 64, 0u);
}

TEST_F(WriteImage, RefusesUnknownEndingsAndFullFolders) {
  const PhaseImage image = random_image({3, 4, 5});
  EXPECT_ERROR(write_image(slices_of(image), folder / "a.xyz"), InputError,
               "a.xyz: unknown ending; expected .tif, .tiff");
  put_file(folder / "file", "");
  EXPECT_ERROR(write_image(slices_of(image), folder / ""), InputError,
               "exists already; expected a new or empty folder");
  EXPECT_EQ(files_in_folder(), 1u);
}

TEST_F(WriteImage, AFolderThatCannotBeMadeIsAnErrorWithTheReason) {
  const PhaseImage image = random_image({3, 4, 5});
  EXPECT_ERROR(write_image(slices_of(image), folder / "none/slices/"), FileError,
               "none/slices: cannot be written: No such file or directory");
}

TEST_F(WriteImage, LeavesNothingWhenItsSourceStops) {
  const PhaseImage image = random_image({3, 4, 5});
  SliceSource source = slices_of(image);
  source.read = [read = source.read](int k, std::vector<std::uint8_t>& solid) {
    if (k == 3) throw NumericalError("stopped");
    read(k, solid);
  };
  for (const std::string name : {"a.tif", "a.raw", "a.nrrd", "a.mhd", "a.mha", "a.npy", "a.vti", "slices/"})
    EXPECT_THROW(write_image(source, folder / name), NumericalError) << name;
  EXPECT_EQ(files_in_folder(), 0u);
}

// A tetrahedron.
const SurfaceMesh mesh = {{{0, 0, 0}, {1e-6f, 0, 0}, {0, 1e-6f, 0}, {0, 0, 1e-6f}},
                          {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}}};

template <class Value>
Value value_at(const std::string& bytes, std::size_t at) {
  Value value;
  std::memcpy(&value, bytes.data() + at, sizeof value);
  return value;
}

TEST_F(WriteImage, StlHoldsThreePointsAndTheNormalOfEachTriangle) {
  write_mesh(mesh, folder / "a.stl");
  const std::string bytes = file_content(folder / "a.stl");
  ASSERT_EQ(bytes.size(), 84u + 50 * 4);
  EXPECT_EQ(value_at<std::uint32_t>(bytes, 80), 4u);
  for (std::size_t n = 0; n < 4; ++n)
    for (std::size_t corner = 0; corner < 3; ++corner)
      for (std::size_t axis = 0; axis < 3; ++axis)
        EXPECT_EQ(value_at<float>(bytes, 84 + 50 * n + 12 * (corner + 1) + 4 * axis),
                  mesh.points[mesh.triangles[n][corner]][int(axis)]);
  EXPECT_EQ(value_at<float>(bytes, 84 + 8), -1.0f);  // outward normal of the face z = 0
  EXPECT_NEAR(value_at<float>(bytes, 84 + 150), 1 / std::sqrt(3.0f), 1e-6);
}

TEST_F(WriteImage, PlyHoldsPointsOnceAndTrianglesByNumber) {
  write_mesh(mesh, folder / "a.ply");
  const std::string bytes = file_content(folder / "a.ply");
  EXPECT_TRUE(bytes.starts_with("ply\nformat binary_little_endian 1.0\n"));
  EXPECT_NE(bytes.find("element vertex 4\n"), std::string::npos);
  EXPECT_NE(bytes.find("element face 4\n"), std::string::npos);
  const std::size_t at = bytes.find("end_header\n") + 11;
  ASSERT_EQ(bytes.size() - at, 4u * 12 + 4 * 13);
  for (std::size_t n = 0; n < 4; ++n) {
    EXPECT_EQ(value_at<float>(bytes, at + 12 * n + 4), mesh.points[n][1]);
    EXPECT_EQ(bytes[at + 48 + 13 * n], 3);
    EXPECT_EQ(value_at<std::uint32_t>(bytes, at + 48 + 13 * n + 9), mesh.triangles[n][2]);
  }
  EXPECT_ERROR(write_mesh(mesh, folder / "a.obj"), InputError, "a.obj: expected .stl or .ply");
}

}  // namespace
}  // namespace anticrack
