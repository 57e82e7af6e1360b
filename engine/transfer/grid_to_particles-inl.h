// Grid to particle: nodal values of a dual cell as a tri-quadratic polynomial, evaluated for the lanes of a
// vector.
#if defined(ANTICRACK_GRID_TO_PARTICLES_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef ANTICRACK_GRID_TO_PARTICLES_INL_H
#undef ANTICRACK_GRID_TO_PARTICLES_INL_H
#else
#define ANTICRACK_GRID_TO_PARTICLES_INL_H
#endif

#include <hwy/highway.h>

#include "sparse_grid.h"

HWY_BEFORE_NAMESPACE();
namespace anticrack {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

/// Vectors across the eight numbers of a node.
using NodeVector = hn::CappedTag<double, 8>;

/// Coefficients of sum_i N_i(s) f_i = sum_abc coefficient[abc] sx^a sy^b sz^c; eight channels, those of
/// `Node`.
struct alignas(64) CellPolynomial {
  double coefficient[27][8];
};

/// Quadratic B-splines on one axis: f(s) = (f0 + f1)/2 + (f1 - f0) s + ((f0 + f2)/2 - f1) s^2.
template <class V>
HWY_INLINE void to_monomials(V half, V f0, V f1, V f2, V& a0, V& a1, V& a2) {
  a0 = half * (f0 + f1);
  a1 = f1 - f0;
  a2 = hn::MulSub(half, f0 + f2, f1);
}

/// `nodes` points to the lowest node of the cell; strides in nodes, z contiguous.
HWY_INLINE void make_polynomial(const Node* nodes, int stride_x, int stride_y, CellPolynomial& out) {
  const NodeVector d;
  const auto half = hn::Set(d, 0.5);
  constexpr int lanes = int(hn::MaxLanes(d));
  for (int part = 0; part < 8; part += lanes) {
    for (int i = 0; i < 3; ++i) {
      hn::Vec<NodeVector> f[3][3];  // along y, z; then monomials of z; then of y, z
      for (int j = 0; j < 3; ++j) {
        const double* row = reinterpret_cast<const double*>(nodes + i * stride_x + j * stride_y) + part;
        to_monomials(half, hn::Load(d, row), hn::Load(d, row + 8), hn::Load(d, row + 16), f[j][0], f[j][1],
                     f[j][2]);
      }
      for (int c = 0; c < 3; ++c) {
        hn::Vec<NodeVector> a0, a1, a2;
        to_monomials(half, f[0][c], f[1][c], f[2][c], a0, a1, a2);
        hn::Store(a0, d, out.coefficient[9 * i + c] + part);
        hn::Store(a1, d, out.coefficient[9 * i + 3 + c] + part);
        hn::Store(a2, d, out.coefficient[9 * i + 6 + c] + part);
      }
    }
    for (int bc = 0; bc < 9; ++bc) {
      hn::Vec<NodeVector> a0, a1, a2;
      to_monomials(half, hn::Load(d, out.coefficient[bc] + part), hn::Load(d, out.coefficient[9 + bc] + part),
                   hn::Load(d, out.coefficient[18 + bc] + part), a0, a1, a2);
      hn::Store(a0, d, out.coefficient[bc] + part);
      hn::Store(a1, d, out.coefficient[9 + bc] + part);
      hn::Store(a2, d, out.coefficient[18 + bc] + part);
    }
  }
  // Else GCC forwards these stores to the broadcast loads that follow as shuffles.
  asm volatile("" ::: "memory");
}

template <class V>
struct Sampled {
  V value;
  V gradient[3];  ///< d/ds
};

/// Channel `channel` at s, Horner in z, y, x.
template <bool with_gradient, class D, class V = hn::Vec<D>>
HWY_INLINE Sampled<V> sample(D d, const CellPolynomial& p, int channel, const V (&s)[3]) {
  const V two_z = s[2] + s[2], two_y = s[1] + s[1], two_x = s[0] + s[0];
  V fx[3], fy[3], fz[3];
  for (int a = 0; a < 3; ++a) {
    V g[3], gz[3];
    for (int b = 0; b < 3; ++b) {
      const V c0 = hn::Set(d, p.coefficient[9 * a + 3 * b][channel]);
      const V c1 = hn::Set(d, p.coefficient[9 * a + 3 * b + 1][channel]);
      const V c2 = hn::Set(d, p.coefficient[9 * a + 3 * b + 2][channel]);
      g[b] = hn::MulAdd(s[2], hn::MulAdd(s[2], c2, c1), c0);
      if constexpr (with_gradient) gz[b] = hn::MulAdd(two_z, c2, c1);
    }
    fx[a] = hn::MulAdd(s[1], hn::MulAdd(s[1], g[2], g[1]), g[0]);
    if constexpr (with_gradient) {
      fy[a] = hn::MulAdd(two_y, g[2], g[1]);
      fz[a] = hn::MulAdd(s[1], hn::MulAdd(s[1], gz[2], gz[1]), gz[0]);
    }
  }
  Sampled<V> out;
  out.value = hn::MulAdd(s[0], hn::MulAdd(s[0], fx[2], fx[1]), fx[0]);
  if constexpr (with_gradient) {
    out.gradient[0] = hn::MulAdd(two_x, fx[2], fx[1]);
    out.gradient[1] = hn::MulAdd(s[0], hn::MulAdd(s[0], fy[2], fy[1]), fy[0]);
    out.gradient[2] = hn::MulAdd(s[0], hn::MulAdd(s[0], fz[2], fz[1]), fz[0]);
  }
  return out;
}

}  // namespace HWY_NAMESPACE
}  // namespace anticrack
HWY_AFTER_NAMESPACE();
#endif
