#include <gtest/gtest.h>
#include <png.h>
#include <tiffio.h>
#include <zlib.h>

#include <fstream>

#include "errors.h"
#include "expect_error.h"
#include "geometry/image_files.h"
#include "images/slice_folder.h"
#include "images/slice_reader.h"
#include "io_test_folder.h"

namespace anticrack {
namespace {

namespace fs = std::filesystem;

Labels read_all(const fs::path& file, const RawLayout& raw = {}) {
  const auto image = open_image(file, raw);
  Labels labels{image->size(), {}};
  std::vector<std::uint16_t> slice;
  for (int k = 0; k < image->size()[2]; ++k) {
    image->read(k, slice);
    labels.values.insert(labels.values.end(), slice.begin(), slice.end());
  }
  // The last slices again, out of order.
  for (int k = image->size()[2]; k-- > 0;) {
    image->read(k, slice);
    const auto begin = labels.values.begin() + std::ptrdiff_t(std::size_t(k) * slice.size());
    EXPECT_TRUE(std::equal(slice.begin(), slice.end(), begin)) << file << " slice " << k;
  }
  return labels;
}

void expect_equal(const Labels& got, const Labels& expected, const std::string& what) {
  EXPECT_EQ(got.size, expected.size) << what;
  EXPECT_EQ(got.values, expected.values) << what;
}

// By libtiff: strips of `rows` rows, or tiles of 16 x 16.
void write_tiff(const fs::path& file, const Labels& image, int bits, int compression, bool tiled) {
  TIFF* tiff = TIFFOpen(file.c_str(), "w");
  const auto [nx, ny, nz] = image.size;
  const std::size_t sample = std::size_t(bits / 8);
  for (int k = 0; k < nz; ++k) {
    TIFFSetField(tiff, TIFFTAG_IMAGEWIDTH, nx);
    TIFFSetField(tiff, TIFFTAG_IMAGELENGTH, ny);
    TIFFSetField(tiff, TIFFTAG_BITSPERSAMPLE, bits);
    TIFFSetField(tiff, TIFFTAG_SAMPLESPERPIXEL, 1);
    TIFFSetField(tiff, TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_MINISBLACK);
    TIFFSetField(tiff, TIFFTAG_COMPRESSION, compression);
    const std::string page = voxel_bytes(
        {{nx, ny, 1}, {image.values.begin() + k * nx * ny, image.values.begin() + (k + 1) * nx * ny}},
        bits / 8, false);
    if (tiled) {
      TIFFSetField(tiff, TIFFTAG_TILEWIDTH, 16);
      TIFFSetField(tiff, TIFFTAG_TILELENGTH, 16);
      for (int y = 0; y < ny; y += 16)
        for (int x = 0; x < nx; x += 16) {
          std::string tile(256 * sample, '\x7f');
          for (int j = y; j < std::min(ny, y + 16); ++j)
            for (int i = x; i < std::min(nx, x + 16); ++i)
              for (std::size_t b = 0; b < sample; ++b)
                tile[std::size_t((j - y) * 16 + i - x) * sample + b] =
                    page[std::size_t(j * nx + i) * sample + b];
          ASSERT_GE(TIFFWriteTile(tiff, tile.data(), std::uint32_t(x), std::uint32_t(y), 0, 0), 0);
        }
    } else {
      TIFFSetField(tiff, TIFFTAG_ROWSPERSTRIP, 3);
      for (int y = 0; y < ny; ++y) {
        std::string row = page.substr(std::size_t(y * nx) * sample, std::size_t(nx) * sample);
        ASSERT_EQ(TIFFWriteScanline(tiff, row.data(), std::uint32_t(y)), 1);
      }
    }
    TIFFWriteDirectory(tiff);
  }
  TIFFClose(tiff);
}

void write_png(const fs::path& file, const Labels& image, int bits) {
  std::FILE* stream = std::fopen(file.c_str(), "wb");
  png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);
  png_infop info = png_create_info_struct(png);
  png_init_io(png, stream);
  png_set_IHDR(png, info, png_uint_32(image.size[0]), png_uint_32(image.size[1]), bits, PNG_COLOR_TYPE_GRAY,
               PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
  png_write_info(png, info);
  if (bits < 8) png_set_packing(png);
  const int bytes = bits == 16 ? 2 : 1;
  std::string all = voxel_bytes(image, bytes, true);
  for (int y = 0; y < image.size[1]; ++y)
    png_write_row(png, reinterpret_cast<png_bytep>(&all[std::size_t(y * image.size[0] * bytes)]));
  png_write_end(png, info);
  png_destroy_write_struct(&png, &info);
  std::fclose(stream);
}

std::string compressed(const std::string& bytes, bool gzip) {
  z_stream state{};
  deflateInit2(&state, 9, Z_DEFLATED, MAX_WBITS + (gzip ? 16 : 0), 8, Z_DEFAULT_STRATEGY);
  std::string packed(bytes.size() + 100, '\0');
  state.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data()));
  state.avail_in = uInt(bytes.size());
  state.next_out = reinterpret_cast<Bytef*>(packed.data());
  state.avail_out = uInt(packed.size());
  deflate(&state, Z_FINISH);
  packed.resize(state.total_out);
  deflateEnd(&state);
  return packed;
}

class ImageReader : public IoTest {
 protected:
  fs::path write(const std::string& name, const std::string& bytes) const {
    fs::create_directories((folder / name).parent_path());
    put_file(folder / name, bytes);
    return folder / name;
  }
};

TEST_F(ImageReader, ReadsTiffPagesOfEitherByteOrderAndDepth) {
  for (const int bits : {8, 16})
    for (const bool big_endian : {false, true}) {
      const Labels expected = numbered({6, 4, 4}, bits == 8 ? 2 : 517);
      expect_equal(read_all(write("stack.TIF", tiff_bytes(expected, bits, big_endian))), expected,
                   std::to_string(bits) + (big_endian ? " big" : " little"));
    }
}

// One page that names three slices, which follow its pixels.
TEST_F(ImageReader, ReadsImageJStacksOfASinglePage) {
  const Labels expected = numbered({5, 4, 3}, 700);
  const std::string description = std::string("ImageJ=1.53t\nimages=3\nslices=3\n") + '\0';
  for (const bool big_endian : {false, true}) {
    std::string file = big_endian ? "MM" : "II";
    const auto number = [&](std::uint64_t value, int bytes) { file += bytes_of(value, bytes, big_endian); };
    const auto entry = [&](int tag, int type, std::uint64_t count, std::uint64_t value) {
      number(std::uint64_t(tag), 2), number(std::uint64_t(type), 2), number(count, 4),
          number(value, type == 3 ? 2 : 4);
      if (type == 3) number(0, 2);
    };
    const std::uint64_t behind = 8 + 2 + 10 * 12 + 4;
    number(42, 2), number(8, 4), number(10, 2);
    entry(256, 4, 1, 5), entry(257, 4, 1, 4), entry(258, 3, 1, 16), entry(259, 3, 1, 1), entry(262, 3, 1, 1);
    entry(270, 2, description.size(), behind), entry(273, 4, 1, behind + description.size()),
        entry(277, 3, 1, 1);
    entry(278, 4, 1, 4), entry(279, 4, 1, 40), number(0, 4);
    file += description + voxel_bytes(expected, 2, big_endian);
    expect_equal(read_all(write("imagej.tif", file)), expected, big_endian ? "big" : "little");
    EXPECT_ERROR(open_image(write("cut.tif", file.substr(0, file.size() - 1))), FileError,
                 "cut.tif: 119 bytes of voxels; shape");
  }
}

// Those that Debian's libtiff writes without loss for grey values.
TEST_F(ImageReader, ReadsEveryTiffCompressionInStripsAndTiles) {
  for (const int compression :
       {COMPRESSION_NONE, COMPRESSION_LZW, COMPRESSION_PACKBITS, COMPRESSION_ADOBE_DEFLATE,
        COMPRESSION_DEFLATE, COMPRESSION_LZMA, COMPRESSION_ZSTD})
    for (const int bits : {8, 16})
      for (const bool tiled : {false, true}) {
        ASSERT_TRUE(TIFFIsCODECConfigured(std::uint16_t(compression))) << compression;
        const Labels expected = numbered({21, 18, 2}, bits == 8 ? 1 : 83);
        Labels bytes = expected;
        if (bits == 8)
          for (std::uint16_t& value : bytes.values) value &= 255;
        write_tiff(folder / "c.tif", bytes, bits, compression, tiled);
        expect_equal(read_all(folder / "c.tif"), bytes,
                     std::to_string(compression) + (tiled ? " tiles" : " strips"));
      }
}

TEST_F(ImageReader, ReadsFoldersOfSlicesInNaturalOrder) {
  const Labels image = numbered({5, 4, 12}, 1);
  for (int k = 0; k < 12; ++k) {
    const Labels slice{{5, 4, 1}, {image.values.begin() + 20 * k, image.values.begin() + 20 * (k + 1)}};
    write("tiffs/slice" + std::to_string(k) + ".tif", tiff_bytes(slice, 8, false));
    fs::create_directories(folder / "pngs");
    write_png(folder / ("pngs/" + std::to_string(k) + "_a.PNG"), slice, k % 2 ? 16 : 8);
  }
  write("tiffs/.hidden", "");
  expect_equal(read_all(folder / "tiffs"), image, "TIFF");
  expect_equal(read_all(folder / "pngs"), image, "PNG");
  EXPECT_TRUE(comes_before("a2", "a10"));
  EXPECT_TRUE(comes_before("a2b10", "a2c2"));
  EXPECT_TRUE(comes_before("a002", "a10"));
  EXPECT_TRUE(comes_before("a02", "a2"));
  EXPECT_FALSE(comes_before("a2", "a02"));
  EXPECT_FALSE(comes_before("a2", "a2"));
}

TEST_F(ImageReader, KeepsTheValuesOfPngsOfFewBits) {
  fs::create_directories(folder / "bits");
  const Labels image{{4, 2, 1}, {0, 1, 1, 0, 1, 0, 0, 1}};
  write_png(folder / "bits/0.png", image, 1);
  expect_equal(read_all(folder / "bits"), image, "1 bit");
}

TEST_F(ImageReader, ReadsRawBytesOfAGivenShapeAndOrder) {
  const Labels bytes = numbered({3, 2, 2}, 7), words = numbered({3, 2, 2}, 700);
  expect_equal(read_all(write("scan.raw", voxel_bytes(bytes, 1, false)), {.shape = bytes.size}), bytes,
               "bytes");
  for (const bool big_endian : {false, true})
    expect_equal(read_all(write("scan.bin", voxel_bytes(words, 2, big_endian)),
                          {.shape = words.size, .bits = 16, .big_endian = big_endian}),
                 words, "words");
}

TEST_F(ImageReader, ReadsNrrdRawAndGzipAttachedAndDetached) {
  const Labels bytes = numbered({3, 4, 5}, 4), words = numbered({3, 4, 5}, 500);
  const std::string head =
      "NRRD0004\n# comment\ntype: uint8\ndimension: 3\nsizes: 3 4 5\nkey:=value\nencoding: ";
  expect_equal(read_all(write("a.nrrd", head + "raw\n\n" + voxel_bytes(bytes, 1, false))), bytes, "raw");
  expect_equal(
      read_all(write("b.nrrd", head + "gzip\r\n\r\n" + compressed(voxel_bytes(bytes, 1, false), true))),
      bytes, "gzip");
  for (const bool big_endian : {false, true}) {
    const std::string order = big_endian ? "big" : "little";
    write("w.raw", "one line\nxx" + voxel_bytes(words, 2, big_endian));
    expect_equal(read_all(write("c.nhdr",
                                "NRRD0005\ntype: short\ndimension: 3\nsizes: 3 4 5\nencoding: raw\nendian: " +
                                    order + "\nline skip: 1\nbyte skip: 2\ndata file: w.raw\n")),
                 words, "detached " + order);
    expect_equal(read_all(write(
                     "d.nhdr", "NRRD0005\ntype: ushort\ndimension: 3\nsizes: 3 4 5\nencoding: raw\nendian: " +
                                   order + "\nbyte skip: -1\ndata file: w.raw\n")),
                 words, "from the end " + order);
  }
}

TEST_F(ImageReader, ReadsMetaImagesLocalSeparateAndCompressed) {
  const Labels bytes = numbered({3, 4, 5}, 4), words = numbered({3, 4, 5}, 1000);
  const std::string head = "ObjectType = Image\nNDims = 3\nDimSize = 3 4 5\n";
  const std::string packed = compressed(voxel_bytes(bytes, 1, false), false);
  expect_equal(read_all(write("a.mha", head + "ElementType = MET_UCHAR\nElementDataFile = LOCAL\n" +
                                           voxel_bytes(bytes, 1, false))),
               bytes, "local");
  expect_equal(read_all(write("b.mha", head + "CompressedData = True\nCompressedDataSize = " +
                                           std::to_string(packed.size()) +
                                           "\nElementType = MET_UCHAR\nElementDataFile = LOCAL\n" + packed)),
               bytes, "compressed");
  for (const bool big_endian : {false, true}) {
    write("v.raw", "head" + voxel_bytes(words, 2, big_endian));
    expect_equal(
        read_all(write("c.mhd", head + "BinaryDataByteOrderMSB = " + (big_endian ? "True" : "False") +
                                    "\nHeaderSize = 4\nElementType = MET_USHORT\nElementDataFile = v.raw\n")),
        words, "separate");
  }
}

TEST_F(ImageReader, ReadsNumPyArraysOfEitherOrderAndEveryVersion) {
  const Labels bytes = numbered({3, 4, 5}, 4), words = numbered({3, 4, 5}, 1000);
  Labels by_columns = words;  // z fastest, then y, then x
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 4; ++j)
      for (int k = 0; k < 5; ++k)
        by_columns.values[std::size_t((i * 4 + j) * 5 + k)] = words.values[std::size_t((k * 4 + j) * 3 + i)];
  for (const int version : {1, 2, 3}) {
    expect_equal(
        read_all(write("a.npy", npy_head(version, "|u1", false, "5, 4, 3") + voxel_bytes(bytes, 1, false))),
        bytes, "bytes");
    expect_equal(read_all(write(
                     "b.npy", npy_head(version, ">u2", true, "5, 4, 3") + voxel_bytes(by_columns, 2, true))),
                 words, "Fortran order");
    expect_equal(
        read_all(write("c.npy", npy_head(version, "<i8", false, "5, 4, 3") + voxel_bytes(words, 8, false))),
        words, "int64");
  }
  const Labels bools{{2, 2, 1}, {0, 1, 1, 0}};
  expect_equal(read_all(write("d.npy", npy_head(1, "|b1", false, "1, 2, 2") + voxel_bytes(bools, 1, false))),
               bools, "bool");
}

// 3 GB that take no place on disk: a reader that loads, or counts voxels in 32 bits, fails here.
TEST_F(ImageReader, SeeksInImagesOfMoreThanTwoToThe31Voxels) {
  const Index3 size = {1300, 1300, 1800};
  const fs::path file = write("huge.raw", "");
  const std::uintmax_t voxels = 1300ull * 1300 * 1800;
  ASSERT_GT(voxels, 1ull << 31);
  fs::resize_file(file, voxels);
  std::fstream(file, std::ios::binary | std::ios::in | std::ios::out)
      .seekp(std::streamoff(voxels - 2))
      .put('\x09');
  const auto image = open_image(file, {.shape = size});
  std::vector<std::uint16_t> slice;
  image->read(1799, slice);
  EXPECT_EQ(slice.size(), 1300u * 1300u);
  EXPECT_EQ(slice[1300 * 1300 - 2], 9);
  EXPECT_EQ(slice[1300 * 1300 - 1], 0);
}

}  // namespace
}  // namespace anticrack
