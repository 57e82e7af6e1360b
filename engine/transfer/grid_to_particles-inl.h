// Grid to particle, in two ways that agree to rounding: the nodal values of a dual cell as a tri-quadratic
// polynomial, evaluated for as many particles as a vector has lanes; or node by node for one particle, lanes
// being numbers of a node, where there are too few for the polynomial to pay. Per-target include guard.
#if defined(ANTICRACK_GRID_TO_PARTICLES_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef ANTICRACK_GRID_TO_PARTICLES_INL_H
#undef ANTICRACK_GRID_TO_PARTICLES_INL_H
#else
#define ANTICRACK_GRID_TO_PARTICLES_INL_H
#endif

#include <hwy/highway.h>

#include <type_traits>

#include "kernels.h"
#include "sparse_grid.h"

HWY_BEFORE_NAMESPACE();
namespace anticrack {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

/// For lambdas: the calling function's instruction set, and no call.
#undef ANTICRACK_INLINE
#define ANTICRACK_INLINE HWY_ATTR __attribute__((always_inline))

/// Vectors across the eight numbers of a node, and across half of them.
using NodeVector = hn::CappedTag<double, 8>;
using HalfNodeVector = hn::CappedTag<double, 4>;

/// Coefficients of sum_i N_i(s) f_i = sum_abc coefficient[abc] u_a(sx) u_b(sy) u_c(sz), u = {1, s, s^2/2};
/// eight channels, those of `Node`.
struct alignas(64) CellPolynomial {
  double coefficient[27][8];
};

/// Quadratic B-splines on one axis: f(s) = (f0 + f1)/2 + (f1 - f0) s + (f0 - 2 f1 + f2) s^2/2. Nodal values
/// in, coefficients out.
template <class V>
HWY_INLINE void to_polynomial(V half, V& f0, V& f1, V& f2) {
  const V slope = f1 - f0;
  f2 = (f2 - f1) - slope;
  f0 = hn::MulAdd(half, slope, f0);
  f1 = slope;
}

/// `nodes` points to the lowest node of the cell; strides in nodes, z contiguous. Only the first `channels`
/// of the eight, rounded up to vectors.
template <int channels>
HWY_INLINE void make_polynomial(const Node* nodes, int stride_x, int stride_y, CellPolynomial& out) {
  const NodeVector d;
  const auto half = hn::Set(d, 0.5);
  constexpr int lanes = int(hn::MaxLanes(d));
  for (int part = 0; part < channels; part += lanes) {
    hn::Vec<NodeVector> f[3][3][3];  // nodal values, then coefficients, along x, y, z
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) {
        const double* row = reinterpret_cast<const double*>(nodes + i * stride_x + j * stride_y) + part;
        for (int k = 0; k < 3; ++k) f[i][j][k] = hn::Load(d, row + 8 * k);
        to_polynomial(half, f[i][j][0], f[i][j][1], f[i][j][2]);
      }
    for (int i = 0; i < 3; ++i)
      for (int c = 0; c < 3; ++c) to_polynomial(half, f[i][0][c], f[i][1][c], f[i][2][c]);
    for (int b = 0; b < 3; ++b)
      for (int c = 0; c < 3; ++c) {
        to_polynomial(half, f[0][b][c], f[1][b][c], f[2][b][c]);
        for (int a = 0; a < 3; ++a) hn::Store(f[a][b][c], d, out.coefficient[9 * a + 3 * b + c] + part);
      }
  }
  // Else GCC forwards these stores to the broadcast loads that follow as shuffles.
  asm volatile("" ::: "memory");
}

/// Places of the lanes in their cell, and half their squares.
template <class V>
struct Place {
  V s[3], half_square[3];
};

template <class D, class V = hn::Vec<D>>
HWY_INLINE Place<V> place_of(D d, const V (&s)[3]) {
  const V half = hn::Set(d, 0.5);
  return {{s[0], s[1], s[2]}, {half * s[0] * s[0], half * s[1] * s[1], half * s[2] * s[2]}};
}

template <class V>
struct Sampled {
  V value;
  V gradient[3];   ///< d/ds
  V curvature[3];  ///< d^2/ds^2 along each axis
};

enum class Derivatives { none, first, second };

/// One of the eight channels at a place: along z, then y, then x.
template <Derivatives derivatives, class D, class V = hn::Vec<D>>
HWY_INLINE Sampled<V> sample(D d, const CellPolynomial& p, int channel, const Place<V>& at) {
  const V x = at.s[0], y = at.s[1], z = at.s[2];
  const V xx = at.half_square[0], yy = at.half_square[1], zz = at.half_square[2];
  constexpr bool with_gradient = derivatives != Derivatives::none;
  constexpr bool with_curvature = derivatives == Derivatives::second;
  Sampled<V> f;
  for (int a = 0; a < 3; ++a) {
    V g, g_y, g_z, g_yy, g_zz;
    for (int b = 0; b < 3; ++b) {
      const auto coefficient = [&](int c)
                                   HWY_ATTR { return hn::Set(d, p.coefficient[9 * a + 3 * b + c][channel]); };
      const V c1 = coefficient(1), c2 = coefficient(2);
      const V h = hn::MulAdd(zz, c2, hn::MulAdd(z, c1, coefficient(0)));
      g = b == 0 ? h : hn::MulAdd(b == 1 ? y : yy, h, g);
      if constexpr (with_gradient) {
        const V h_z = hn::MulAdd(z, c2, c1);
        g_z = b == 0 ? h_z : hn::MulAdd(b == 1 ? y : yy, h_z, g_z);
        if (b > 0) g_y = b == 1 ? h : hn::MulAdd(y, h, g_y);
      }
      if constexpr (with_curvature) {
        g_zz = b == 0 ? c2 : hn::MulAdd(b == 1 ? y : yy, c2, g_zz);
        if (b == 2) g_yy = h;
      }
    }
    const V power = a == 1 ? x : xx;
    f.value = a == 0 ? g : hn::MulAdd(power, g, f.value);
    if constexpr (with_gradient) {
      if (a > 0) f.gradient[0] = a == 1 ? g : hn::MulAdd(x, g, f.gradient[0]);
      f.gradient[1] = a == 0 ? g_y : hn::MulAdd(power, g_y, f.gradient[1]);
      f.gradient[2] = a == 0 ? g_z : hn::MulAdd(power, g_z, f.gradient[2]);
    }
    if constexpr (with_curvature) {
      if (a == 2) f.curvature[0] = g;
      f.curvature[1] = a == 0 ? g_yy : hn::MulAdd(power, g_yy, f.curvature[1]);
      f.curvature[2] = a == 0 ? g_zz : hn::MulAdd(power, g_zz, f.curvature[2]);
    }
  }
  return f;
}

/// A particle's place along one axis of its cell: s, and the weights of the outer two of the three nodes.
template <class V>
struct PlaceOnAxis {
  V s, lower, upper;
};

template <class D, class V = hn::Vec<D>>
HWY_INLINE PlaceOnAxis<V> place_on_axis(D d, double place) {
  const V s = hn::Set(d, place), half = hn::Set(d, 0.5), rest = hn::Set(d, 1.0) - s;
  return {s, half * rest * rest, half * s * s};
}

template <class V>
struct OnAxis {
  V value, slope, curvature;  ///< f, df/ds, d^2f/ds^2
};

/// Quadratic B-splines on one axis, by differences of the three nodal values.
template <class V>
HWY_INLINE OnAxis<V> interpolate(const PlaceOnAxis<V>& at, V f0, V f1, V f2) {
  const V back = f0 - f1, forth = f2 - f1, curvature = back + forth;
  return {hn::MulAdd(at.upper, forth, hn::MulAdd(at.lower, back, f1)), hn::MulSub(at.s, curvature, back),
          curvature};
}

/// Some of the numbers of the 27 nodes of a cell at a place: along z, then y, then x. `numbers` are those of
/// the lowest node; strides in nodes, z contiguous. What the caller does not use is not computed.
template <class D, class V = hn::Vec<D>>
HWY_INLINE Sampled<V> interpolate(D d, const double* numbers, int stride_x, int stride_y,
                                  const PlaceOnAxis<V> (&at)[3]) {
  V f[3], f_y[3], f_z[3], f_yy[3], f_zz[3];
  for (int i = 0; i < 3; ++i) {
    OnAxis<V> g[3];
    for (int j = 0; j < 3; ++j) {
      const double* line = numbers + 8 * (i * stride_x + j * stride_y);
      g[j] = interpolate(at[2], hn::Load(d, line), hn::Load(d, line + 8), hn::Load(d, line + 16));
    }
    const OnAxis<V> along_y = interpolate(at[1], g[0].value, g[1].value, g[2].value);
    f[i] = along_y.value;
    f_y[i] = along_y.slope;
    f_yy[i] = along_y.curvature;
    f_z[i] = interpolate(at[1], g[0].slope, g[1].slope, g[2].slope).value;
    f_zz[i] = interpolate(at[1], g[0].curvature, g[1].curvature, g[2].curvature).value;
  }
  const OnAxis<V> along_x = interpolate(at[0], f[0], f[1], f[2]);
  return {along_x.value,
          {along_x.slope, interpolate(at[0], f_y[0], f_y[1], f_y[2]).value,
           interpolate(at[0], f_z[0], f_z[1], f_z[2]).value},
          {along_x.curvature, interpolate(at[0], f_yy[0], f_yy[1], f_yy[2]).value,
           interpolate(at[0], f_zz[0], f_zz[1], f_zz[2]).value}};
}

/// A component of velocity and place after the step, and of the gradient that strains the particle.
template <class V>
struct Moved {
  V s, v;
  V L[3];       ///< dt grad v
  V affine[3];  ///< dx C, APIC only
};

/// Numbers of a node that a transfer reads: velocity and mass, and the increment.
template <Transfer transfer>
constexpr int channels = transfer == Transfer::flip ? 8 : 4;

/// Lines 12 and 13 of Algorithm 1, and dt grad v for line 7, of one component: `pic` and `dv` are read from
/// the grid at `place` in the cell that they come from, `s` is relative to the particle's own.
///
/// APIC (Jiang et al. 2015, quadratic splines): C = 4 / dx^2 sum_i N_i v_i (x_i - x)^T. On one axis, with k =
/// 0, 1, 2 the node, the moment of a weight is N_k (k - 1/2 - s) = N_k'/4 + N_k'' (2 s - 1) s (1 - s)/4, so
/// that C is the gradient and a share of the second derivative.
template <Transfer transfer, class D, class V = hn::Vec<D>>
HWY_INLINE Moved<V> move(D d, const StepConstants& c, const Sampled<V>& pic, V dv, const V (&place)[3], V s,
                         V v) {
  const V dt_over_dx = hn::Set(d, c.dt / c.cell_size), one = hn::Set(d, 1.0);
  Moved<V> moved;
  moved.s = hn::MulAdd(dt_over_dx, pic.value, s);  // line 13
  moved.v = pic.value;                             // line 12
  if constexpr (transfer == Transfer::flip)
    moved.v = hn::MulAdd(hn::Set(d, c.flip), v + dv - pic.value, pic.value);
  for (int e = 0; e < 3; ++e) moved.L[e] = dt_over_dx * pic.gradient[e];
  if constexpr (transfer == Transfer::apic)
    for (int e = 0; e < 3; ++e) {
      const V x = place[e], share = (x + x - one) * (x * (one - x));
      moved.affine[e] = hn::MulAdd(share, pic.curvature[e], pic.gradient[e]);
    }
  return moved;
}

/// The same from a cell's polynomial.
template <Transfer transfer, class D, class V = hn::Vec<D>>
HWY_INLINE Moved<V> move(D d, const StepConstants& c, const CellPolynomial& grid, const Place<V>& at,
                         int component, V s, V v) {
  constexpr bool affine = transfer == Transfer::apic;
  const Sampled<V> pic =
      sample < affine ? Derivatives::second : Derivatives::first > (d, grid, component, at);
  V dv = hn::Zero(d);
  if constexpr (transfer == Transfer::flip) dv = sample<Derivatives::none>(d, grid, component + 4, at).value;
  return move<transfer>(d, c, pic, dv, at.s, s, v);
}

using OneLane = hn::CappedTag<double, 1>;

/// The same, all components, of one particle at `place` in the cell whose lowest node is `nodes`.
template <Transfer transfer, class V = hn::Vec<OneLane>>
HWY_INLINE void move_alone(const StepConstants& c, const Node* nodes, int stride_x, int stride_y,
                           const V (&place)[3], const V (&s)[3], const V (&v)[3], Moved<V> (&moved)[3]) {
  alignas(64) double value[8] = {}, gradient[3][8], curvature[3][8] = {};  // of the numbers of a node
  const double* numbers = reinterpret_cast<const double*>(nodes);
  const auto interpolate_at = [&](auto across, int n) ANTICRACK_INLINE {
    PlaceOnAxis<hn::Vec<decltype(across)>> at[3];
    for (int a = 0; a < 3; ++a) at[a] = place_on_axis(across, hn::GetLane(place[a]));
    return interpolate(across, numbers + n, stride_x, stride_y, at);
  };
  const auto interpolate_velocity = [&](auto across, int n) ANTICRACK_INLINE {
    const auto pic = interpolate_at(across, n);
    hn::Store(pic.value, across, value + n);
    for (int e = 0; e < 3; ++e) hn::Store(pic.gradient[e], across, gradient[e] + n);
    if constexpr (transfer == Transfer::apic)
      for (int e = 0; e < 3; ++e) hn::Store(pic.curvature[e], across, curvature[e] + n);
  };
  const HalfNodeVector across;
  if (hn::MaxLanes(NodeVector()) == 8 && transfer == Transfer::flip && c.full_width) {
    interpolate_velocity(NodeVector(), 0);  // the increments come along
  } else {
    for (int n = 0; n < 4; n += int(hn::MaxLanes(across))) {
      interpolate_velocity(across, n);
      asm volatile("" ::: "memory");  // else GCC does both at once and runs out of registers
      if constexpr (transfer == Transfer::flip)
        hn::Store(interpolate_at(across, 4 + n).value, across, value + 4 + n);
    }
  }
  const OneLane d;
  for (int a = 0; a < 3; ++a) {
    const Sampled<V> pic{
        hn::Set(d, value[a]),
        {hn::Set(d, gradient[0][a]), hn::Set(d, gradient[1][a]), hn::Set(d, gradient[2][a])},
        {hn::Set(d, curvature[0][a]), hn::Set(d, curvature[1][a]), hn::Set(d, curvature[2][a])}};
    moved[a] = move<transfer>(d, c, pic, hn::Set(d, value[4 + a]), place, s[a], v[a]);
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace anticrack
HWY_AFTER_NAMESPACE();
#endif
