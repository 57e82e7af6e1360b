#include "measures/distance_transform.h"

#include <fmt/format.h>
#include <tbb/blocked_range2d.h>
#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "errors.h"

namespace anticrack {
namespace {

// The lower envelope of the parabolas values[q] + (x - q)^2 at each x of a line.
class Envelope {
 public:
  explicit Envelope(int longest) : values_(longest), vertex_(longest), first_(longest) {}

  std::int32_t* values() { return values_.data(); }

  // Writes the envelope to out[x stride].
  void evaluate(int n, std::int32_t* out, std::size_t stride) {
    int top = -1;  // the parabola in front
    for (int q = 0; q < n; ++q) {
      if (values_[q] == no_distance) continue;
      std::int64_t from = 0;
      while (top >= 0) {
        from = overtakes(vertex_[top], q);
        if (from > first_[top]) break;
        --top;
      }
      if (top < 0) from = 0;
      if (from >= n) continue;
      ++top;
      vertex_[top] = q;
      first_[top] = int(from);
    }
    if (top < 0) {
      for (int x = 0; x < n; ++x) out[std::size_t(x) * stride] = no_distance;
      return;
    }
    for (int x = n - 1; x >= 0; --x) {
      while (first_[top] > x) --top;
      const int away = x - vertex_[top];
      out[std::size_t(x) * stride] = values_[vertex_[top]] + away * away;
    }
  }

 private:
  // First x at which the parabola of q lies below that of p < q; never negative.
  std::int64_t overtakes(int p, int q) const {
    const std::int64_t a = std::int64_t(values_[q]) + std::int64_t(q) * q;
    const std::int64_t b = std::int64_t(values_[p]) + std::int64_t(p) * p;
    return a < b ? 0 : (a - b) / (2 * std::int64_t(q - p)) + 1;
  }

  std::vector<std::int32_t> values_;
  std::vector<int> vertex_, first_;
};

// Distances along x, by the nearest other voxel on either side.
void scan_row(const std::uint8_t* solid, Phase phase, int n, std::int32_t* out) {
  int other = -1;
  for (int x = 0; x < n; ++x) {
    if (solid[x] != std::uint8_t(phase)) other = x;
    out[x] = other < 0 ? no_distance : (x - other) * (x - other);
  }
  other = -1;
  for (int x = n - 1; x >= 0; --x) {
    if (solid[x] != std::uint8_t(phase)) other = x;
    if (other >= 0) out[x] = std::min(out[x], (other - x) * (other - x));
  }
}

}  // namespace

std::vector<std::int32_t> squared_distances(const PhaseImage& image, Phase phase) {
  const auto [nx, ny, nz] = image.size;
  if (double(nx) * nx + double(ny) * ny + double(nz) * nz >= 46340.0 * 46340.0)
    throw InputError(fmt::format(
        "distances in an image of {} x {} x {} voxels; expected a diagonal below 46340 voxels", nx, ny, nz));
  std::vector<std::int32_t> squares(image.count());
  tbb::enumerable_thread_specific<Envelope> envelopes([&] { return Envelope(std::max(ny, nz)); });

  // Lines along y (or z) one after another: neighbours along x share cache lines.
  const auto along = [&](std::size_t line, int n, std::size_t stride) {
    Envelope& envelope = envelopes.local();
    for (int q = 0; q < n; ++q) envelope.values()[q] = squares[line + std::size_t(q) * stride];
    envelope.evaluate(n, &squares[line], stride);
  };
  tbb::parallel_for(0, nz, [&](int k) {
    for (int j = 0; j < ny; ++j) {
      const std::size_t row = image.offset(0, j, k);
      scan_row(&image.solid[row], phase, nx, &squares[row]);
    }
    for (int i = 0; i < nx; ++i) along(image.offset(i, 0, k), ny, std::size_t(nx));
  });
  tbb::parallel_for(0, ny, [&](int j) {
    for (int i = 0; i < nx; ++i) along(image.offset(i, j, 0), nz, std::size_t(nx) * std::size_t(ny));
  });
  return squares;
}

}  // namespace anticrack
