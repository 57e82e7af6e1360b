#include "images/raw_slices.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <fstream>

#include "images/inflate_stream.h"

namespace anticrack {
namespace {

namespace fs = std::filesystem;

static_assert(std::endian::native == std::endian::little);

std::uint64_t voxels_in(const Index3& size) {
  return std::uint64_t(size[0]) * std::uint64_t(size[1]) * std::uint64_t(size[2]);
}

// Integers of 1 to 8 bytes to labels.
class Decoder {
 public:
  explicit Decoder(const VoxelData& data) : data_(data) {}

  std::uint16_t operator()(const std::uint8_t* voxel) const {
    if (data_.bytes == 1 && !data_.is_signed) return *voxel;
    std::uint64_t bits = 0;
    for (int b = 0; b < data_.bytes; ++b)
      bits |= std::uint64_t(voxel[data_.big_endian ? data_.bytes - 1 - b : b]) << 8 * b;
    const int unused = 64 - 8 * data_.bytes;
    const auto value = std::int64_t(bits << unused) >> unused;
    if (data_.is_signed ? value < 0 || value > 65535 : bits > 65535)
      refuse_image(data_.file, fmt::format("a voxel has the value {}; expected 0 to 65535",
                                           data_.is_signed ? fmt::to_string(value) : fmt::to_string(bits)));
    return std::uint16_t(bits);
  }

 private:
  const VoxelData& data_;
};

class VoxelSlices : public SliceReader {
 public:
  explicit VoxelSlices(VoxelData data) : data_(std::move(data)) { size_ = data_.size; }

 protected:
  // One row after the other, as `next` fills it.
  template <class Next>
  void read_rows(std::vector<std::uint16_t>& labels, const Next& next) const {
    const Decoder decode(data_);
    std::vector<std::uint8_t> row(std::size_t(size_[0]) * std::size_t(data_.bytes));
    labels.clear();
    for (int j = 0; j < size_[1]; ++j) {
      next(row);
      for (int i = 0; i < size_[0]; ++i)
        labels.push_back(decode(&row[std::size_t(i) * std::size_t(data_.bytes)]));
    }
  }

  std::uint64_t slice_bytes() const {
    return std::uint64_t(size_[0]) * std::uint64_t(size_[1]) * std::uint64_t(data_.bytes);
  }

  VoxelData data_;
};

class PlainSlices : public VoxelSlices {
 public:
  explicit PlainSlices(const VoxelData& data) : VoxelSlices(data), stream_(data.file, std::ios::binary) {}

  void read(int k, std::vector<std::uint16_t>& labels) override {
    stream_.clear();
    stream_.seekg(std::streamoff(data_.offset + std::uint64_t(k) * slice_bytes()));
    read_rows(labels, [&](std::vector<std::uint8_t>& row) { fill(row); });
  }

 protected:
  void fill(std::vector<std::uint8_t>& bytes) {
    if (!stream_.read(reinterpret_cast<char*>(bytes.data()), std::streamsize(bytes.size())))
      refuse_image(data_.file, "cannot be read");
  }

  std::ifstream stream_;
};

// Slices lie across the whole file: it is read once for as many of them as a buffer holds.
class ZFastestSlices : public PlainSlices {
 public:
  using PlainSlices::PlainSlices;

  void read(int k, std::vector<std::uint16_t>& labels) override {
    const std::size_t slice = std::size_t(size_[0]) * std::size_t(size_[1]);
    if (buffer_.empty() || k < first_ || k >= first_ + count_) fill_buffer(k, slice);
    const auto begin = buffer_.begin() + std::ptrdiff_t(slice * std::size_t(k - first_));
    labels.assign(begin, begin + std::ptrdiff_t(slice));
  }

 private:
  void fill_buffer(int k, std::size_t slice) {
    constexpr std::size_t most_voxels = 1 << 27;
    first_ = k;
    count_ = int(std::clamp<std::size_t>(most_voxels / slice, 1, std::size_t(size_[2] - k)));
    buffer_.assign(slice * std::size_t(count_), 0);
    const Decoder decode(data_);
    const auto nx = std::size_t(size_[0]), bytes = std::size_t(data_.bytes);
    std::vector<std::uint8_t> column(std::size_t(count_) * bytes);
    for (std::size_t i = 0; i < nx; ++i) {
      for (std::size_t j = 0; j < std::size_t(size_[1]); ++j) {
        const std::size_t voxel =
            (i * std::size_t(size_[1]) + j) * std::size_t(size_[2]) + std::size_t(first_);
        if (count_ < size_[2] || voxel == 0) stream_.seekg(std::streamoff(data_.offset + voxel * bytes));
        fill(column);
        for (std::size_t n = 0; n < std::size_t(count_); ++n)
          buffer_[n * slice + j * nx + i] = decode(&column[n * bytes]);
      }
    }
  }

  int first_ = 0, count_ = 0;
  std::vector<std::uint16_t> buffer_;
};

class CompressedSlices : public VoxelSlices {
 public:
  explicit CompressedSlices(const VoxelData& data) : VoxelSlices(data) {}

  void read(int k, std::vector<std::uint16_t>& labels) override {
    if (!stream_ || k < next_) {
      stream_.emplace(data_.file, data_.offset);
      next_ = 0;
    }
    for (; next_ < k; ++next_) stream_->skip(slice_bytes());
    read_rows(labels, [&](std::vector<std::uint8_t>& row) { stream_->read(row.data(), row.size()); });
    ++next_;
  }

 private:
  std::optional<InflateStream> stream_;
  int next_ = 0;
};

}  // namespace

std::unique_ptr<SliceReader> open_voxel_data(const VoxelData& voxels, bool whole_file) {
  VoxelData data = voxels;
  if (!fs::is_regular_file(data.file)) refuse_image(data.file, "no such file");
  if (std::ranges::any_of(data.size, [](int n) { return n < 1 || n > most_along_an_axis; }))
    refuse_image(data.file,
                 fmt::format("{} voxels; expected 1 to {} along each axis", data.size, most_along_an_axis));
  const std::uint64_t in_file = fs::file_size(data.file);
  if (data.compressed) {
    // Deflate makes at most 1032 bytes of one.
    if (data.offset > in_file ||
        double(voxels_in(data.size)) * data.bytes > 1032.0 * double(in_file - data.offset))
      refuse_image(data.file,
                   fmt::format("{} bytes cannot hold {} voxels of {} bytes", in_file, data.size, data.bytes));
    return std::make_unique<CompressedSlices>(data);
  }
  // At most 2^60 voxels, so eight bytes of each are the one product that may not fit.
  const double about = double(voxels_in(data.size)) * data.bytes;
  const std::uint64_t needed = about < 1e18 ? voxels_in(data.size) * std::uint64_t(data.bytes) : ~0ull;
  if (data.offset_from_end && needed <= in_file) data.offset = in_file - needed;
  const std::uint64_t present = data.offset > in_file ? 0 : in_file - data.offset;
  if (present < needed || (whole_file && present != needed))
    refuse_image(
        data.file,
        fmt::format("{} bytes{}; shape {} needs {}", present, data.offset > 0 ? " of voxels" : "", data.size,
                    needed == ~0ull ? fmt::format("{:g}", about) : fmt::to_string(needed)));
  if (data.z_fastest) return std::make_unique<ZFastestSlices>(data);
  return std::make_unique<PlainSlices>(data);
}

}  // namespace anticrack
