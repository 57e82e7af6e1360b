#include "fields/wave_transform.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <numbers>

#include "fields/matrix_product.h"

namespace anticrack {
namespace {

using Complex = std::complex<double>;

// Modes a kernel reaches along an axis, the period of the modes over the extent of the lattice, and the
// kernel's exponent for that oversampling (Barnett et al. 2019, Eq. 4.5): largest error measured 1.3e-12.
constexpr int kernel_width = 14;
constexpr double oversampling = 2.0;
const double kernel_exponent = 0.98 * std::numbers::pi * kernel_width * (1.0 - 0.5 / oversampling);

double kernel(double distance) {
  const double u = distance * (2.0 / kernel_width);
  return std::exp(kernel_exponent * (std::sqrt(std::max(0.0, 1.0 - u * u)) - 1.0));
}

// Integral of kernel(u) cos(theta u). With u = (width/2) sin(angle) the integrand is smooth and the
// trapezoidal rule converges to rounding.
double kernel_transform(double theta) {
  constexpr int nodes = 128;
  double sum = 0.0;
  for (int node = 1; node < nodes; ++node) {
    const double angle = std::numbers::pi * (double(node) / nodes - 0.5);
    sum += std::exp(kernel_exponent * (std::cos(angle) - 1.0)) * std::cos(angle) *
           std::cos(theta * (0.5 * kernel_width) * std::sin(angle));
  }
  return sum * (std::numbers::pi / nodes) * (0.5 * kernel_width);
}

// The uniform modes m delta, |m| <= highest, along an axis, and the matrix that carries them to its lattice
// points.
struct AxisModes {
  AxisModes(int axis, std::span<const PlaneWave> waves, const SampleLattice& lattice, int padding)
      : points(lattice.points[axis] + 2 * padding), centre(0.5 * lattice.points[axis] * lattice.spacing) {
    const double half_extent = 0.5 * points * lattice.spacing;
    delta = std::numbers::pi / (oversampling * half_extent);
    double largest = 0.0;
    for (const PlaneWave& wave : waves) largest = std::max(largest, std::abs(wave.eta[axis]));
    highest = int(std::ceil(largest / delta + 0.5 * kernel_width));

    to_lattice.resize(points * coefficients());
    for (std::size_t point = 0; point < points; ++point) {
      const double theta = delta * lattice.spacing * (double(point) + 0.5 - 0.5 * double(points));
      const double scale = 1.0 / kernel_transform(theta);
      double* row = &to_lattice[point * coefficients()];
      row[0] = scale;
      for (int m = 1; m <= highest; ++m) {
        row[2 * m - 1] = scale * std::cos(m * theta);
        row[2 * m] = scale * std::sin(m * theta);
      }
    }
  }

  std::size_t modes() const { return std::size_t(2 * highest + 1); }
  std::size_t coefficients() const { return modes(); }  // of 1, cos m, sin m: one real number for each mode

  std::size_t points;  // lattice points, padding included
  double centre;       // [m] modes are even or odd about it
  double delta;        // [1/m]
  int highest;
  std::vector<double> to_lattice;  // points x coefficients: 1, cos 1, sin 1, cos 2, sin 2, ...
};

// Where a wave falls among the modes of the three axes, and how much of it each mode takes.
struct SpreadWave {
  Complex amplitude;
  std::array<int, 3> first;  // first mode reached, counted from -highest
  std::array<std::array<double, kernel_width>, 3> weight;
};

SpreadWave spread(const PlaneWave& wave, const std::array<AxisModes, 3>& axes) {
  SpreadWave result;
  double phase = wave.phase;
  for (int axis = 0; axis < 3; ++axis) {
    const AxisModes& modes = axes[axis];
    phase += wave.eta[axis] * modes.centre;
    const double position = wave.eta[axis] / modes.delta;
    const int first = int(std::ceil(position - 0.5 * kernel_width));
    for (int i = 0; i < kernel_width; ++i) result.weight[axis][i] = kernel(position - (first + i));
    result.first[axis] = first + modes.highest;
  }
  result.amplitude = std::polar(1.0, phase);
  return result;
}

// Waves in the order of the first z mode that they reach, otherwise in their own order.
struct SortedWaves {
  std::vector<SpreadWave> waves;
  std::vector<std::size_t> begin;  // of the waves whose first z mode is m; one more entry than modes

  SortedWaves(std::span<const PlaneWave> plane_waves, const std::array<AxisModes, 3>& axes)
      : waves(plane_waves.size()), begin(axes[2].modes() + 1) {
    std::vector<SpreadWave> unsorted(plane_waves.size());
    tbb::parallel_for(std::size_t(0), unsorted.size(),
                      [&](std::size_t n) { unsorted[n] = spread(plane_waves[n], axes); });
    for (const SpreadWave& wave : unsorted) ++begin[wave.first[2] + 1];
    for (std::size_t m = 1; m < begin.size(); ++m) begin[m] += begin[m - 1];
    std::vector<std::size_t> next = begin;
    for (const SpreadWave& wave : unsorted) waves[next[wave.first[2]]++] = wave;
  }
};

// Amplitudes of the modes with z index `m`, y slow and x fast.
std::vector<Complex> spread_plane(const SortedWaves& sorted, const std::array<AxisModes, 3>& axes, int m) {
  const std::size_t columns = axes[0].modes();
  std::vector<Complex> plane(columns * axes[1].modes());
  for (int first = std::max(0, m - kernel_width + 1); first <= m; ++first) {
    for (std::size_t n = sorted.begin[first]; n < sorted.begin[first + 1]; ++n) {
      const SpreadWave& wave = sorted.waves[n];
      for (int j = 0; j < kernel_width; ++j) {
        const Complex amplitude = wave.amplitude * (wave.weight[2][m - first] * wave.weight[1][j]);
        Complex* row = &plane[(wave.first[1] + j) * columns + wave.first[0]];
        for (int i = 0; i < kernel_width; ++i) row[i] += amplitude * wave.weight[0][i];
      }
    }
  }
  return plane;
}

// Coefficients of cos m and sin m: A_m e^{i m theta} + A_{-m} e^{-i m theta} = (A_m + A_{-m}) cos + i (A_m -
// A_{-m}) sin.
std::pair<Complex, Complex> fold(Complex plus, Complex minus) {
  const Complex difference = plus - minus;
  return {plus + minus, Complex(-difference.imag(), difference.real())};
}

// Real coefficients of the products of the y and x bases, y slow and x fast.
std::vector<double> fold_plane(const std::vector<Complex>& plane, const AxisModes& x, const AxisModes& y) {
  const auto fold_row = [&](const auto& mode, double* out) {
    out[0] = mode(0).real();
    for (int m = 1; m <= x.highest; ++m) {
      const auto [cosine, sine] = fold(mode(m), mode(-m));
      out[2 * m - 1] = cosine.real();
      out[2 * m] = sine.real();
    }
  };
  const std::size_t columns = x.modes();
  const auto row = [&](int m) { return &plane[(m + y.highest) * columns + x.highest]; };
  std::vector<double> result(columns * y.modes());
  fold_row([&](int i) { return row(0)[i]; }, result.data());
  for (int m = 1; m <= y.highest; ++m) {
    const Complex *plus = row(m), *minus = row(-m);
    fold_row([&](int i) { return fold(plus[i], minus[i]).first; }, &result[(2 * m - 1) * columns]);
    fold_row([&](int i) { return fold(plus[i], minus[i]).second; }, &result[2 * m * columns]);
  }
  return result;
}

// Carries one plane of coefficients to the lattice points of x and y.
void transform_plane(const std::vector<double>& plane, const AxisModes& x, const AxisModes& y,
                     const std::vector<double>& x_to_lattice_transposed, double* out) {
  std::vector<double> rows(y.points * x.coefficients());
  multiply({y.to_lattice.data(), y.points, y.coefficients(), y.coefficients()},
           {plane.data(), y.coefficients(), x.coefficients(), x.coefficients()},
           {rows.data(), y.points, x.coefficients(), x.coefficients()});
  multiply({rows.data(), y.points, x.coefficients(), x.coefficients()},
           {x_to_lattice_transposed.data(), x.coefficients(), x.points, x.points},
           {out, y.points, x.points, x.points});
}

}  // namespace

void sum_waves_on_lattice(std::span<const PlaneWave> waves, const SampleLattice& lattice, int padding,
                          const std::function<void(std::size_t, std::span<const double>)>& store) {
  const std::array<AxisModes, 3> axes = {AxisModes(0, waves, lattice, padding),
                                         AxisModes(1, waves, lattice, padding),
                                         AxisModes(2, waves, lattice, padding)};
  const auto& [x, y, z] = axes;
  const SortedWaves sorted(waves, axes);

  std::vector<double> x_to_lattice_transposed(x.to_lattice.size());
  for (std::size_t point = 0; point < x.points; ++point)
    for (std::size_t c = 0; c < x.coefficients(); ++c)
      x_to_lattice_transposed[c * x.points + point] = x.to_lattice[point * x.coefficients() + c];

  // One plane of lattice values for each z mode. A task owns its planes, so that no sum depends on the
  // threads.
  const std::size_t plane_points = x.points * y.points;
  std::vector<double> planes(z.coefficients() * plane_points);
  tbb::parallel_for(0, z.highest + 1, [&](int m) {
    std::vector<Complex> cosine = spread_plane(sorted, axes, z.highest + m);
    if (m == 0) {
      transform_plane(fold_plane(cosine, x, y), x, y, x_to_lattice_transposed, planes.data());
      return;
    }
    std::vector<Complex> sine = spread_plane(sorted, axes, z.highest - m);
    for (std::size_t i = 0; i < cosine.size(); ++i) std::tie(cosine[i], sine[i]) = fold(cosine[i], sine[i]);
    double* out = &planes[(2 * m - 1) * plane_points];
    transform_plane(fold_plane(cosine, x, y), x, y, x_to_lattice_transposed, out);
    transform_plane(fold_plane(sine, x, y), x, y, x_to_lattice_transposed, out + plane_points);
  });

  // The last axis, a short run of columns at a time: its modes stay in cache while all z are formed.
  constexpr std::size_t run = 256;
  tbb::parallel_for(std::size_t(0), (plane_points + run - 1) / run, [&](std::size_t task) {
    const std::size_t first = task * run, columns = std::min(run, plane_points - first);
    std::vector<double> sums(z.points * columns);
    multiply({z.to_lattice.data(), z.points, z.coefficients(), z.coefficients()},
             {&planes[first], z.coefficients(), columns, plane_points},
             {sums.data(), z.points, columns, columns});
    for (std::size_t k = 0; k < z.points; ++k)
      store(k * plane_points + first, std::span(&sums[k * columns], columns));
  });
}

}  // namespace anticrack
