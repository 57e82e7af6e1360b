#include "images/write_image.h"

#include <fmt/format.h>
#include <tiffio.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <fstream>
#include <memory>
#include <string>

#include "errors.h"
#include "files/atomic_file.h"
#include "images/header_text.h"

namespace anticrack {
namespace {

namespace fs = std::filesystem;

// Slice k as bytes of the file.
void read_bytes(const SliceSource& image, int k, std::vector<std::uint8_t>& bytes) {
  image.read(k, bytes);
  for (std::uint8_t& voxel : bytes) voxel = voxel ? 255 : 0;
}

std::uint64_t voxels_of(const SliceSource& image) {
  return std::uint64_t(image.size[0]) * std::uint64_t(image.size[1]) * std::uint64_t(image.size[2]);
}

// A header, the voxels, and what follows.
void write_plain(const SliceSource& image, const fs::path& file, const std::string& header,
                 const std::string& end = {}) {
  write_atomically(file, [&](const fs::path& temporary) {
    std::ofstream stream;
    stream.exceptions(std::ios::badbit | std::ios::failbit);
    stream.open(temporary, std::ios::binary);
    stream << header;
    std::vector<std::uint8_t> bytes;
    for (int k = 0; k < image.size[2]; ++k) {
      read_bytes(image, k, bytes);
      stream.write(reinterpret_cast<const char*>(bytes.data()), std::streamsize(bytes.size()));
    }
    stream << end;
    stream.close();
  });
}

struct CloseTiff {
  void operator()(TIFF* tiff) const { TIFFClose(tiff); }
};

// The slices [first, last) as pages. `named`: the file as errors call it.
void write_pages(const SliceSource& image, int first, int last, const fs::path& file, const fs::path& named) {
  TIFFSetErrorHandler(nullptr);
  TIFFSetWarningHandler(nullptr);
  const auto require = [&](bool good) {
    if (!good) throw system_file_error(named, "cannot be written", errno);
  };
  constexpr std::uint64_t most_in_classic = 1ull << 31;
  const bool big = voxels_of(image) > most_in_classic && last - first > 1;
  const std::unique_ptr<TIFF, CloseTiff> tiff(TIFFOpen(file.c_str(), big ? "w8" : "w"));
  require(tiff != nullptr);
  const std::string description = fmt::format("0 pore, 255 solid; voxel size {} m", image.voxel_size);
  std::vector<std::uint8_t> bytes;
  for (int k = first; k < last; ++k) {
    read_bytes(image, k, bytes);
    TIFFSetField(tiff.get(), TIFFTAG_IMAGEWIDTH, std::uint32_t(image.size[0]));
    TIFFSetField(tiff.get(), TIFFTAG_IMAGELENGTH, std::uint32_t(image.size[1]));
    TIFFSetField(tiff.get(), TIFFTAG_BITSPERSAMPLE, 8);
    TIFFSetField(tiff.get(), TIFFTAG_SAMPLESPERPIXEL, 1);
    TIFFSetField(tiff.get(), TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_MINISBLACK);
    TIFFSetField(tiff.get(), TIFFTAG_COMPRESSION, COMPRESSION_ADOBE_DEFLATE);
    TIFFSetField(tiff.get(), TIFFTAG_ROWSPERSTRIP, std::uint32_t(image.size[1]));
    if (k == first) TIFFSetField(tiff.get(), TIFFTAG_IMAGEDESCRIPTION, description.c_str());
    require(TIFFWriteEncodedStrip(tiff.get(), 0, bytes.data(), tmsize_t(bytes.size())) >= 0);
    require(TIFFWriteDirectory(tiff.get()) == 1);
  }
  require(TIFFFlush(tiff.get()) == 1);
}

void write_tiff(const SliceSource& image, const fs::path& file) {
  write_atomically(file,
                   [&](const fs::path& temporary) { write_pages(image, 0, image.size[2], temporary, file); });
}

// Filled under another name and renamed, like a file.
void write_folder(const SliceSource& image, const fs::path& named) {
  fs::path folder = named;
  if (!folder.has_filename()) folder = folder.parent_path();
  if (fs::exists(folder) && !(fs::is_directory(folder) && fs::is_empty(folder)))
    throw InputError(fmt::format("{}: exists already; expected a new or empty folder", folder.string()));
  const fs::path temporary =
      folder.parent_path() / fmt::format(".{}.{}.tmp", folder.filename().string(), ::getpid());
  std::error_code ignored;
  try {
    fs::remove_all(temporary);
    fs::create_directory(temporary);
    const int digits = std::max(4, int(std::to_string(image.size[2] - 1).size()));
    for (int k = 0; k < image.size[2]; ++k) {
      const fs::path slice = temporary / fmt::format("slice_{:0{}}.tif", k, digits);
      write_pages(image, k, k + 1, slice, folder);
      flush_to_disk(slice);
    }
    flush_to_disk(temporary);
    fs::rename(temporary, folder);
  } catch (const fs::filesystem_error& error) {
    fs::remove_all(temporary, ignored);
    throw system_file_error(folder, "cannot be written", error.code().value());
  } catch (...) {
    fs::remove_all(temporary, ignored);
    throw;
  }
  flush_to_disk(folder.has_parent_path() ? folder.parent_path() : fs::path("."));
}

std::string nrrd_header(const SliceSource& image) {
  const auto [nx, ny, nz] = image.size;
  return fmt::format(
      "NRRD0004\n# 0 pore, 255 solid\ntype: uchar\ndimension: 3\nsizes: {} {} {}\nspacings: {} {} {}\n"
      "units: \"m\" \"m\" \"m\"\nencoding: raw\n\n",
      nx, ny, nz, image.voxel_size, image.voxel_size, image.voxel_size);
}

std::string meta_image_header(const SliceSource& image, const std::string& data_file) {
  const auto [nx, ny, nz] = image.size;
  const double h = image.voxel_size;
  return fmt::format(
      "ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\n"
      "CompressedData = False\nTransformMatrix = 1 0 0 0 1 0 0 0 1\nOffset = {} {} {}\nElementSpacing = {} "
      "{} {}\n"
      "DimSize = {} {} {}\nElementType = MET_UCHAR\nElementDataFile = {}\n",
      0.5 * h, 0.5 * h, 0.5 * h, h, h, h, nx, ny, nz, data_file);
}

// NumPy format 1: the header's length makes the voxels begin at a multiple of 64.
std::string npy_header(const SliceSource& image) {
  const auto [nx, ny, nz] = image.size;
  std::string text =
      fmt::format("{{'descr': '|u1', 'fortran_order': False, 'shape': ({}, {}, {}), }}", nz, ny, nx);
  constexpr std::size_t before = 10, multiple = 64;
  text.append(multiple - (before + text.size() + 1) % multiple, ' ');
  text += '\n';
  std::string header("\x93NUMPY\x01\x00", 8);
  header += char(text.size() & 0xff);
  header += char(text.size() >> 8);
  return header + text;
}

void write_vti(const SliceSource& image, const fs::path& file) {
  const auto [nx, ny, nz] = image.size;
  const std::string extent = fmt::format("0 {} 0 {} 0 {}", nx, ny, nz);
  std::string header = fmt::format(
      "<?xml version=\"1.0\"?>\n<VTKFile type=\"ImageData\" version=\"1.0\" byte_order=\"LittleEndian\" "
      "header_type=\"UInt64\">\n<ImageData WholeExtent=\"{}\" Origin=\"0 0 0\" Spacing=\"{} {} {}\">\n"
      "<Piece Extent=\"{}\">\n<CellData Scalars=\"solid\">\n<DataArray type=\"UInt8\" Name=\"solid\" "
      "format=\"appended\" offset=\"0\"/>\n</CellData>\n</Piece>\n</ImageData>\n<AppendedData "
      "encoding=\"raw\">\n_",
      extent, image.voxel_size, image.voxel_size, image.voxel_size, extent);
  const std::uint64_t bytes = voxels_of(image);
  for (int b = 0; b < 8; ++b) header += char(bytes >> 8 * b & 0xff);
  write_plain(image, file, header, "\n</AppendedData>\n</VTKFile>\n");
}

void write_mhd(const SliceSource& image, const fs::path& file) {
  fs::path voxels = file;
  voxels.replace_extension(".raw");
  write_plain(image, voxels, {});
  write_text_atomically(file, meta_image_header(image, voxels.filename().string()));
}

std::string ending_of(const fs::path& file) {
  return file.has_filename() ? lower_case(file.extension().string()) : "/";
}

}  // namespace

const char* image_endings() {
  return ".tif, .tiff, .raw, .nrrd, .mhd, .mha, .npy, .vti, or / for a folder of slices";
}

bool is_image_name(const fs::path& file) {
  constexpr const char* known[] = {".tif", ".tiff", ".raw", ".nrrd", ".mhd", ".mha", ".npy", ".vti", "/"};
  return std::ranges::find(known, ending_of(file)) != std::end(known);
}

SliceSource slices_of(const PhaseImage& image) {
  return {image.size, image.voxel_size, [&image](int k, std::vector<std::uint8_t>& solid) {
            const auto begin = image.solid.begin() + std::ptrdiff_t(image.offset(0, 0, k));
            solid.assign(begin, begin + std::ptrdiff_t(image.offset(0, 0, 1)));
          }};
}

void write_image(const SliceSource& image, const fs::path& file) {
  const std::string ending = ending_of(file);
  if (ending == "/") return write_folder(image, file);
  if (ending == ".tif" || ending == ".tiff") return write_tiff(image, file);
  if (ending == ".raw") return write_plain(image, file, {});
  if (ending == ".nrrd") return write_plain(image, file, nrrd_header(image));
  if (ending == ".mha") return write_plain(image, file, meta_image_header(image, "LOCAL"));
  if (ending == ".mhd") return write_mhd(image, file);
  if (ending == ".npy") return write_plain(image, file, npy_header(image));
  if (ending == ".vti") return write_vti(image, file);
  throw InputError(fmt::format("{}: unknown ending; expected {}", file.string(), image_endings()));
}

}  // namespace anticrack
