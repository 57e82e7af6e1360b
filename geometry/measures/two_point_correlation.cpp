#include "measures/two_point_correlation.h"

#include <fmt/format.h>
#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <unsupported/Eigen/FFT>

#include "errors.h"

namespace anticrack {
namespace {

using Complex = std::complex<double>;

// Columns gathered at a time: 128 bytes of a row.
constexpr int columns_at_once = 8;

bool has_small_factors(int n) {
  for (int factor : {2, 3, 5})
    while (n % factor == 0) n /= factor;
  return n == 1;
}

// Points of the transform along an axis: room for the lags between zeros, or the period itself if the
// transform is fast for it. A period with a large prime factor is folded afterwards, which needs all lags.
int transform_size(int voxels, int largest_lag, PairRule rule, int multiple) {
  if (rule == PairRule::periodic && has_small_factors(voxels)) return voxels;
  const int least = rule == PairRule::periodic ? 2 * voxels - 1 : voxels + largest_lag;
  int size = (least + multiple - 1) / multiple * multiple;
  while (!has_small_factors(size)) size += multiple;
  return size;
}

// One thread's transforms and their buffers.
struct Transform {
  Eigen::FFT<double> fft;
  std::vector<Complex> in, out, plane;
  std::vector<double> row;

  Transform() {
    fft.SetFlag(Eigen::FFT<double>::HalfSpectrum);
    fft.SetFlag(Eigen::FFT<double>::Unscaled);
  }
};

// Number of solid pairs of every lag vector, each of the lags -R ... R along x and y, 0 ... R along z, handed
// on plane by plane. Wiener and Khinchin: transform, square, transform back; axis by axis, so that the zeros
// along z are never stored.
class Autocorrelation {
 public:
  Autocorrelation(const PhaseImage& image, PairRule rule, int largest_lag)
      : image_(image), rule_(rule), lags_(largest_lag + 1) {
    for (int axis = 0; axis < 3; ++axis)
      size_[axis] = transform_size(image.size[axis], largest_lag, rule, axis == 0 ? 4 : 1);
    columns_ = size_[0] / 2 + 1;
    spectrum_.resize(std::size_t(image.size[2]) * size_[1] * columns_);
  }

  // Calls take(z, counts) for each lag z, counts[(y + R) (2R + 1) + x + R], from several threads.
  template <typename Take>
  void run(const Take& take) {
    tbb::parallel_for(0, image_.size[2], [&](int z) { transform_plane(z, threads_.local()); });
    tbb::parallel_for(0, size_[1], [&](int y) { correlate_columns(y, threads_.local()); });
    tbb::parallel_for(0, lags_, [&](int z) {
      std::vector<std::uint64_t> counts;
      transform_plane_back(z, threads_.local(), counts);
      take(z, counts);
    });
  }

 private:
  Complex* spectrum_row(int z, int y) {
    return &spectrum_[(std::size_t(z) * size_[1] + std::size_t(y)) * columns_];
  }

  // Adds what a period lets wrap around: lag l is also lag l - n.
  template <typename Value>
  void fold(Value* values, int axis) const {
    const int n = image_.size[axis];
    if (rule_ == PairRule::inside_box || size_[axis] == n) return;
    for (int lag = 1; lag < lags_; ++lag) {
      const Value wrapped = values[lag] + values[size_[axis] - (n - lag)];
      const Value opposite = values[size_[axis] - lag] + values[n - lag];
      values[lag] = wrapped;
      values[size_[axis] - lag] = opposite;
    }
  }

  void transform_plane(int z, Transform& t) {
    const auto [nx, ny, nz] = image_.size;
    t.plane.resize(std::size_t(ny) * columns_);
    t.row.assign(size_[0], 0.0);
    for (int y = 0; y < ny; ++y) {
      std::copy_n(&image_.solid[image_.offset(0, y, z)], nx, t.row.begin());
      t.fft.fwd(&t.plane[std::size_t(y) * columns_], t.row.data(), size_[0]);
    }
    for (int first = 0; first < columns_; first += columns_at_once) {
      const int some = std::min(columns_at_once, columns_ - first);
      t.in.assign(std::size_t(columns_at_once) * size_[1], 0.0);
      t.out.resize(t.in.size());
      for (int y = 0; y < ny; ++y)
        for (int c = 0; c < some; ++c)
          t.in[std::size_t(c) * size_[1] + y] = t.plane[std::size_t(y) * columns_ + first + c];
      for (int c = 0; c < some; ++c)
        t.fft.fwd(&t.out[std::size_t(c) * size_[1]], &t.in[std::size_t(c) * size_[1]], size_[1]);
      for (int y = 0; y < size_[1]; ++y)
        for (int c = 0; c < some; ++c) spectrum_row(z, y)[first + c] = t.out[std::size_t(c) * size_[1] + y];
    }
  }

  void correlate_columns(int y, Transform& t) {
    const int nz = image_.size[2];
    for (int first = 0; first < columns_; first += columns_at_once) {
      const int some = std::min(columns_at_once, columns_ - first);
      t.in.assign(std::size_t(columns_at_once) * size_[2], 0.0);
      t.out.resize(t.in.size());
      for (int z = 0; z < nz; ++z)
        for (int c = 0; c < some; ++c) t.in[std::size_t(c) * size_[2] + z] = spectrum_row(z, y)[first + c];
      for (int c = 0; c < some; ++c) {
        Complex* in = &t.in[std::size_t(c) * size_[2]];
        Complex* out = &t.out[std::size_t(c) * size_[2]];
        t.fft.fwd(out, in, size_[2]);
        for (int z = 0; z < size_[2]; ++z) out[z] = std::norm(out[z]);
        t.fft.inv(in, out, size_[2]);
        fold(in, 2);
      }
      for (int z = 0; z < lags_; ++z)
        for (int c = 0; c < some; ++c) spectrum_row(z, y)[first + c] = t.in[std::size_t(c) * size_[2] + z];
    }
  }

  void transform_plane_back(int z, Transform& t, std::vector<std::uint64_t>& counts) {
    const int width = 2 * lags_ - 1;
    t.plane.resize(std::size_t(width) * columns_);
    for (int first = 0; first < columns_; first += columns_at_once) {
      const int some = std::min(columns_at_once, columns_ - first);
      t.in.resize(std::size_t(columns_at_once) * size_[1]);
      t.out.resize(t.in.size());
      for (int y = 0; y < size_[1]; ++y)
        for (int c = 0; c < some; ++c) t.in[std::size_t(c) * size_[1] + y] = spectrum_row(z, y)[first + c];
      for (int c = 0; c < some; ++c) {
        Complex* out = &t.out[std::size_t(c) * size_[1]];
        t.fft.inv(out, &t.in[std::size_t(c) * size_[1]], size_[1]);
        fold(out, 1);
        for (int lag = 1 - lags_; lag < lags_; ++lag)
          t.plane[std::size_t(lag + lags_ - 1) * columns_ + first + c] = out[lag < 0 ? lag + size_[1] : lag];
      }
    }
    counts.resize(std::size_t(width) * width);
    t.row.resize(size_[0]);
    const double points = double(size_[0]) * double(size_[1]) * double(size_[2]);
    for (int row = 0; row < width; ++row) {
      t.fft.inv(t.row.data(), &t.plane[std::size_t(row) * columns_], size_[0]);
      fold(t.row.data(), 0);
      for (int lag = 1 - lags_; lag < lags_; ++lag)
        counts[std::size_t(row) * width + lag + lags_ - 1] =
            std::uint64_t(std::llround(t.row[lag < 0 ? lag + size_[0] : lag] / points));
    }
  }

  const PhaseImage& image_;
  PairRule rule_;
  int lags_;
  Index3 size_{};
  int columns_ = 0;
  std::vector<Complex> spectrum_;  // [z][y][x]: transformed along x and y
  tbb::enumerable_thread_specific<Transform> threads_;
};

std::uint64_t all_pairs(const PhaseImage& image, PairRule rule, int x, int y, int z) {
  if (rule == PairRule::periodic) return image.count();
  return std::uint64_t(image.size[0] - std::abs(x)) * std::uint64_t(image.size[1] - std::abs(y)) *
         std::uint64_t(image.size[2] - z);
}

struct BinSum {
  double length = 0;
  std::uint64_t pairs = 0, solid_pairs = 0;
};

// Solid voxels of each slab across an axis.
std::array<std::vector<std::uint64_t>, 3> solid_by_slab(const PhaseImage& image) {
  std::array<std::vector<std::uint64_t>, 3> slabs;
  for (int axis = 0; axis < 3; ++axis) slabs[axis].assign(image.size[axis], 0);
  for (int k = 0; k < image.size[2]; ++k)
    for (int j = 0; j < image.size[1]; ++j) {
      std::uint64_t row = 0;
      for (int i = 0; i < image.size[0]; ++i) {
        const std::uint8_t solid = image.solid[image.offset(i, j, k)];
        slabs[0][i] += solid;
        row += solid;
      }
      slabs[1][j] += row;
      slabs[2][k] += row;
    }
  return slabs;
}

// Of all pairs at a lag, solid ends less those of solid pairs.
void count_mixed_pairs(AxisCorrelation& axis, const std::vector<std::uint64_t>& slabs, PairRule rule) {
  const std::size_t n = slabs.size();
  std::uint64_t solid = 0;
  for (std::uint64_t slab : slabs) solid += slab;
  std::uint64_t ends = 2 * solid;
  for (std::size_t lag = 0; lag < axis.solid_pairs.size(); ++lag) {
    if (lag > 0 && rule == PairRule::inside_box) ends -= slabs[lag - 1] + slabs[n - lag];
    axis.mixed_pairs.push_back(ends - 2 * axis.solid_pairs[lag]);
  }
}

void require_valid(const PhaseImage& image, PairRule rule, int largest_lag, int bins_per_voxel) {
  const int shortest = *std::ranges::min_element(image.size);
  const int most = rule == PairRule::periodic ? shortest / 2 : shortest - 1;
  if (largest_lag < 1 || largest_lag > most)
    throw InputError(
        fmt::format("two-point correlation: largest lag = {} voxels; expected 1 to {} in an image of "
                    "{} x {} x {} voxels",
                    largest_lag, most, image.size[0], image.size[1], image.size[2]));
  if (bins_per_voxel < 1)
    throw InputError(fmt::format("two-point correlation: {} bins a voxel; expected >= 1", bins_per_voxel));
}

}  // namespace

double TwoPointCorrelation::normalized(double g) const {
  const double phi = solid_fraction;
  return (g - phi * phi) / (phi - phi * phi);
}

int default_largest_lag(const PhaseImage& image) {
  return std::max(1, *std::ranges::min_element(image.size) / 2);
}

TwoPointCorrelation correlate_solid(const PhaseImage& image, PairRule rule, int largest_lag,
                                    int bins_per_voxel) {
  require_valid(image, rule, largest_lag, bins_per_voxel);
  const int lags = largest_lag + 1, width = 2 * largest_lag + 1;
  const int bins = largest_lag * bins_per_voxel + 1;
  TwoPointCorrelation result{
      .rule = rule, .voxel_size = image.voxel_size, .solid_fraction = 0, .axes = {}, .radial = {}};
  for (AxisCorrelation& axis : result.axes) {
    axis.pairs.resize(lags);
    axis.solid_pairs.resize(lags);
  }

  std::vector<std::vector<BinSum>> planes(lags, std::vector<BinSum>(bins));
  Autocorrelation(image, rule, largest_lag).run([&](int z, const std::vector<std::uint64_t>& counts) {
    for (int y = -largest_lag; y <= largest_lag; ++y)
      for (int x = -largest_lag; x <= largest_lag; ++x) {
        // Half of all vectors: the others are the same pairs.
        if (z == 0 && (y < 0 || (y == 0 && x < 0))) continue;
        const double length = std::sqrt(double(x * x + y * y + z * z));
        const auto bin = int(std::floor(length * bins_per_voxel + 0.5));
        if (bin >= bins) continue;
        const std::uint64_t pairs = all_pairs(image, rule, x, y, z);
        const std::uint64_t solid = counts[std::size_t(y + largest_lag) * width + x + largest_lag];
        BinSum& sum = planes[z][bin];
        sum.length += length * double(pairs);
        sum.pairs += pairs;
        sum.solid_pairs += solid;
        for (int axis = 0; axis < 3; ++axis) {
          const int along[] = {x, y, z};
          if (along[axis] != x + y + z || std::abs(x) + std::abs(y) + z != along[axis]) continue;
          result.axes[axis].pairs[along[axis]] = pairs;
          result.axes[axis].solid_pairs[along[axis]] = solid;
        }
      }
  });

  for (int bin = 0; bin < bins; ++bin) {
    BinSum sum;
    for (const auto& plane : planes) {
      sum.length += plane[bin].length;
      sum.pairs += plane[bin].pairs;
      sum.solid_pairs += plane[bin].solid_pairs;
    }
    if (sum.pairs > 0)
      result.radial.push_back(
          {image.voxel_size * sum.length / double(sum.pairs), sum.pairs, sum.solid_pairs});
  }
  result.solid_fraction = result.radial.front().g();
  const auto slabs = solid_by_slab(image);
  for (int axis = 0; axis < 3; ++axis) count_mixed_pairs(result.axes[axis], slabs[axis], rule);
  return result;
}

SlopeSurface surface_by_slope(const TwoPointCorrelation& correlation) {
  if (correlation.radial.size() < 2 || correlation.axes[0].pairs.size() < 3)
    throw InputError("surface by the slope of the correlation: expected lags up to 2 voxels at least");
  const double h = correlation.voxel_size;
  SlopeSurface result{};
  for (const AxisCorrelation& axis : correlation.axes) {
    const double v1 = 0.5 * double(axis.mixed_pairs[1]) / double(axis.pairs[1]);
    const double v2 = 0.5 * double(axis.mixed_pairs[2]) / double(axis.pairs[2]);
    result.axes_first_difference += 4 * v1 / h / 3;
    result.axes_extrapolated += 4 * (8 * v1 - v2) / (6 * h) / 3;
  }
  const RadialBin& first = correlation.radial[1];
  result.radial = 4 * (correlation.solid_fraction - first.g()) / first.r;
  return result;
}

}  // namespace anticrack
