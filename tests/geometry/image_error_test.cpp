#include <gtest/gtest.h>
#include <zlib.h>

#include "errors.h"
#include "expect_error.h"
#include "geometry/image_files.h"
#include "images/slice_reader.h"
#include "io_test_folder.h"

namespace anticrack {
namespace {

namespace fs = std::filesystem;

class ImageError : public IoTest {
 protected:
  fs::path write(const std::string& name, const std::string& bytes) const {
    fs::create_directories((folder / name).parent_path());
    put_file(folder / name, bytes);
    return folder / name;
  }

  /// Opening the file, or reading its slices, throws this.
  void expect(const fs::path& file, const std::string& message, const RawLayout& raw = {}) const {
    EXPECT_ERROR(read(file, raw), FileError, message);
  }

  static void read(const fs::path& file, const RawLayout& raw = {}) {
    const auto image = open_image(file, raw);
    std::vector<std::uint16_t> slice;
    for (int k = 0; k < image->size()[2]; ++k) image->read(k, slice);
  }
};

TEST_F(ImageError, OfATruncatedTiffComesBeforeAnySliceIsRead) {
  const std::string whole = tiff_bytes(numbered({5, 4, 3}, 1), 8, true);
  for (std::size_t length = 0; length < whole.size(); ++length) {
    const fs::path file = write("cut.tif", whole.substr(0, length));
    const std::string message = message_of<FileError>([&] { open_image(file); });
    EXPECT_TRUE(message.starts_with(file.string() + ": ")) << length << " bytes: " << message;
  }
  expect(write("cut.tif", whole.substr(0, whole.size() - 1)),
         "cut.tif: page 2: strip 0 of 20 bytes at byte ");
  expect(write("cut.tif", whole.substr(0, whole.size() - 60)), "cut.tif: page 2 is cut off or damaged");
  expect(write("text.tif", "not an image"), "text.tif: not a readable TIFF");
  expect(write("deep.tif", tiff_bytes(numbered({4, 4, 1}, 1), 32, false)),
         "deep.tif: page 0: 32 bits, 1 samples a pixel");
  expect("/nonexistent.tif", "/nonexistent.tif: no such file");
}

TEST_F(ImageError, OfMixedSizesNamesFileAndBothSizes) {
  write("mixed/1.tif", tiff_bytes(numbered({4, 4, 1}, 1), 8, false));
  write("mixed/2.tif", tiff_bytes(numbered({4, 5, 1}, 1), 8, false));
  expect(folder / "mixed", "mixed/2.tif: 4 x 5 pixels; expected 4 x 4 as in 1.tif");
  write("pages/1.tif", tiff_bytes(numbered({4, 4, 2}, 1), 8, false));
  expect(folder / "pages", "pages/1.tif: 2 pages; expected one slice a file");
  write("other/readme.txt", "");
  expect(folder / "other", "other/readme.txt: expected a folder that holds slices only (.tif, .tiff, .png)");
  fs::create_directories(folder / "empty");
  expect(folder / "empty", "empty: the folder holds no slices (.tif, .tiff, .png)");
  write("bad/1.png", "\x89PNG\r\n\x1a\n");
  expect(folder / "bad", "bad/1.png: ");
  std::string mixed = tiff_bytes(numbered({4, 4, 2}, 1), 8, false);
  mixed[8 + 114 + 16 + 2 + 8] = 3;  // width of the second page
  expect(write("mixed.tif", mixed), "mixed.tif: page 1 differs from page 0 in size or depth");
}

TEST_F(ImageError, OfRawBytesNamesShapeAndSize) {
  const fs::path file = write("scan.raw", "123456");
  EXPECT_ERROR(open_image(file), InputError,
               "scan.raw: raw bytes need a shape [nx, ny, nz]; other formats are known");
  EXPECT_ERROR(open_image(file, {.shape = Index3{-3, -2, 1}}), InputError,
               "scan.raw: shape [-3, -2, 1]; expected 1 to 1048576 voxels along each axis");
  expect(file, "scan.raw: 6 bytes; shape [3, 2, 2] needs 12", {.shape = Index3{3, 2, 2}});
  expect(file, "scan.raw: 6 bytes; shape [3, 1, 1] needs 3", {.shape = Index3{3, 1, 1}});
  expect(file, "scan.raw: 6 bytes; shape [3, 2, 1] needs 12", {.shape = Index3{3, 2, 1}, .bits = 16});
  expect(file, "scan.raw: 6 bytes; shape [1048576, 1048576, 1048576] needs 1.15292e+18",
         {.shape = Index3{1 << 20, 1 << 20, 1 << 20}});
  expect(write("a.tif", tiff_bytes(numbered({4, 4, 1}, 1), 8, false)),
         "a.tif: [4, 4, 1] voxels; expected [3, 4, 1]", {.shape = Index3{3, 4, 1}});
  EXPECT_ERROR(open_image(write("a.xyz", "1")), InputError, "a.xyz: raw bytes need a shape");
  expect(write("a.png", "1"), "a.png: a single slice; expected a folder of them");
}

TEST_F(ImageError, OfNrrdNamesFileLineAndField) {
  const auto expect_header = [&](const std::string& fields, const std::string& message) {
    expect(write("a.nrrd", "NRRD0004\n" + fields + "\n12345678"), message);
  };
  const std::string rest = "dimension: 3\nsizes: 2 2 2\nencoding: raw\n";
  expect(write("a.nrrd", "NRRX"), "a.nrrd:1: not a NRRD file");
  expect_header("type: float\n" + rest, "a.nrrd:6: type = float; expected an integer type");
  expect_header("type: uchar\ndimension: 4\n", "dimension = 4; expected 3");
  expect_header("type: uchar\ndimension: 3\nsizes: 2 2\n", "sizes = 2 2; expected three numbers of voxels");
  expect_header("type: uchar\ndimension: 3\nsizes: 2 -2 9999999\n",
                "sizes = -2; expected a whole number from 1 to 1048576");
  expect_header("type: uchar\ndimension: 3\nsizes: 2 2 2\nencoding: bzip2\n",
                "encoding = bzip2; expected raw or gzip");
  expect_header("type: short\n" + rest, "endian = ; expected big or little");
  expect_header("type: uchar\n" + rest + "data file: LIST\n",
                "data file = LIST; expected the name of one file");
  expect_header("type: uchar\n" + rest + "data file: none.raw\n", "none.raw: no such file; ");
  expect_header("type: uchar\n" + rest + "line skip: 5\n", "\"line skip\" skips more lines than there are");
  expect_header("nonsense\n", "a.nrrd:2: expected \"field: value\"");
  expect_header("type: uchar\ndimension: 3\nsizes: 3 2 2\nencoding: raw\n",
                "a.nrrd: 8 bytes of voxels; shape [3, 2, 2] needs 12");
  expect_header("type: uchar\ndimension: 3\nsizes: 1048576 1048576 1048576\nencoding: gzip\n",
                "bytes cannot hold [1048576, 1048576, 1048576] voxels of 1 bytes");
  expect_header("type: uchar\n" + std::string(70000, '#') + "\n",
                "a.nrrd:3: more than 65536 characters; expected a text header");
}

TEST_F(ImageError, OfMetaImageNamesFileLineAndField) {
  const auto expect_header = [&](const std::string& fields, const std::string& message) {
    expect(write("a.mha", "ObjectType = Image\nNDims = 3\n" + fields), message);
  };
  const std::string local = "ElementDataFile = LOCAL\n12345678";
  expect_header("DimSize = 2 2 2\nElementType = MET_FLOAT\n",
                "a.mha:4: ElementType = MET_FLOAT; expected an integer type");
  expect_header("NDims = 2\n", "a.mha:3: NDims = 2; expected 3");
  expect_header("ObjectType = Mesh\n", "ObjectType = Mesh; expected Image");
  expect_header("ElementNumberOfChannels = 3\n", "ElementNumberOfChannels = 3; expected 1");
  expect_header("BinaryData = False\n", "BinaryData = False; expected True");
  expect_header("ElementType = MET_UCHAR\n" + local, "no DimSize in the header");
  expect_header("DimSize = 2 2 2\n" + local, "no ElementType in the header");
  expect_header("DimSize = 2 2 2\nElementType = MET_UCHAR\n", "no ElementDataFile in the header");
  expect_header("DimSize = 2 2 2\nElementType = MET_UCHAR\nElementDataFile = LIST\n",
                "ElementDataFile = LIST; expected LOCAL");
  expect_header("DimSize = 2 2 2\nElementType = MET_UCHAR\nElementDataFile = none.raw\n",
                "none.raw: no such file; ");
  expect_header("DimSize = 2 2 0\n", "DimSize = 0; expected a whole number from 1 to 1048576");
  expect_header("DimSize = 2 2 3\nElementType = MET_UCHAR\n" + local,
                "a.mha: 8 bytes of voxels; shape [2, 2, 3] needs 12");
  expect_header("rubbish\n", "a.mha:3: expected \"Field = value\"");
}

TEST_F(ImageError, OfNumPyNamesWhatTheHeaderSays) {
  const auto expect_npy = [&](const std::string& bytes, const std::string& message) {
    expect(write("a.npy", bytes), message);
  };
  expect_npy("rubbish, long enough", "a.npy: not a NumPy file");
  expect_npy(npy_head(4, "|u1", false, "2, 2, 2"), "a.npy: NumPy format 4; expected 1, 2 or 3");
  expect_npy(npy_head(1, "<f4", false, "2, 2, 2"),
             "a.npy: values of type f4; expected bool or an integer type");
  expect_npy(npy_head(1, "|u1", false, "2, 2"), "a.npy: shape (2, 2); expected three axes z, y, x");
  expect_npy(npy_head(1, "|u1", false, "2, 2, 99999999999"),
             "a.npy: shape (2, 2, 99999999999); expected 1 to 1048576");
  expect_npy(npy_head(1, "|u1", false, "2, 2, 2") + "1234567",
             "a.npy: 7 bytes of voxels; shape [2, 2, 2] needs 8");
  expect_npy(npy_head(1, "|u1", false, "2, 2, 2").substr(0, 30), "a.npy: cut off in the header");
  expect_npy(std::string("\x93NUMPY\x02\0\xff\xff\xff\x7f", 12),
             "a.npy: a header of 2147483647 bytes; expected at most 65536");
  expect_npy(npy_head(1, "<i2", false, "1, 1, 2") + "\xff\xff\x01\x02",
             "a.npy: a voxel has the value -1; expected 0 to 65535");
  expect_npy(npy_head(1, "<u4", false, "1, 1, 1") + std::string("\0\0\1\0", 4),
             "a.npy: a voxel has the value 65536");
}

TEST_F(ImageError, OfCompressedDataThatEndEarlyOrAreDamaged) {
  const std::string head = "NRRD0004\ntype: uchar\ndimension: 3\nsizes: 20 20 20\nencoding: gzip\n\n";
  std::string bytes;
  for (int n = 0; n < 8000; ++n) bytes += char(n * n * 31 >> 3);
  std::string packed(9000, '\0');
  uLongf size = uLongf(packed.size());
  compress(reinterpret_cast<Bytef*>(packed.data()), &size, reinterpret_cast<const Bytef*>(bytes.data()),
           8000);
  packed.resize(size);
  EXPECT_NO_THROW(read(write("a.nrrd", head + packed)));
  expect(write("a.nrrd", head + packed.substr(0, size / 2)), "a.nrrd: the compressed data end early");
  expect(write("a.nrrd", head + packed.substr(0, 1)), "a.nrrd");
  expect(write("a.nrrd", head + "rubbish" + packed), "a.nrrd: the compressed data are damaged");
}

}  // namespace
}  // namespace anticrack
