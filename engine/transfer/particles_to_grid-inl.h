// Particle to grid: mass, momentum and force of the lanes of a vector into the 27 nodes of their dual cell.
#if defined(ANTICRACK_PARTICLES_TO_GRID_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef ANTICRACK_PARTICLES_TO_GRID_INL_H
#undef ANTICRACK_PARTICLES_TO_GRID_INL_H
#else
#define ANTICRACK_PARTICLES_TO_GRID_INL_H
#endif

#include "bspline.h"
#include "material/hencky-inl.h"
#include "transfer/grid_to_particles-inl.h"

HWY_BEFORE_NAMESPACE();
namespace anticrack {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

/// What the particles of a batch give to the grid, turned so that one particle's numbers lie as a node's do.
template <int lanes>
struct alignas(64) Scatter {
  double w[9][lanes], dx_w[9][lanes], dy_w[9][lanes];  ///< wx wy, wx' wy, wx wy' of the nodes (i, j)
  double wz[3][lanes], dz_w[3][lanes];
  double carried[lanes][4];      ///< momentum, mass
  double traction[3][lanes][4];  ///< columns x, y, z of -V0 tau / dx, fourth number 0
};

/// Adds the batch to one half of each node's line (4 numbers) in pieces of the vector's width, or to the
/// whole line. A node (i, j, k) gets wz[k] P_ij + wz'[k] Q_ij with P = w carried + (dx_w T_x + dy_w T_y), Q =
/// w T_z.
template <bool carries, bool pulls, int lanes, class D>
HWY_INLINE void add_to_nodes(D d, const Scatter<lanes>& b, int offset, Node* nodes, int stride_x,
                             int stride_y) {
  using V = hn::Vec<D>;
  V carried[lanes], tx[lanes], ty[lanes], tz[lanes];
  for (int l = 0; l < lanes; ++l) {
#if HWY_TARGET != HWY_SCALAR
    if constexpr (carries && pulls) {  // the whole line in one vector: {carried, 0} and {0, traction}
      const hn::Half<D> half;
      const auto zero = hn::Zero(half);
      carried[l] = hn::Combine(d, zero, hn::Load(half, b.carried[l]));
      tx[l] = hn::Combine(d, hn::Load(half, b.traction[0][l]), zero);
      ty[l] = hn::Combine(d, hn::Load(half, b.traction[1][l]), zero);
      tz[l] = hn::Combine(d, hn::Load(half, b.traction[2][l]), zero);
    } else
#endif
        if constexpr (carries) {
      carried[l] = hn::Load(d, b.carried[l] + offset);
    } else {
      tx[l] = hn::Load(d, b.traction[0][l] + offset - 4);
      ty[l] = hn::Load(d, b.traction[1][l] + offset - 4);
      tz[l] = hn::Load(d, b.traction[2][l] + offset - 4);
    }
  }
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) {
      V P[lanes], Q[lanes];
      for (int l = 0; l < lanes; ++l) {
        const V w = hn::Set(d, b.w[3 * i + j][l]);
        if constexpr (carries) P[l] = w * carried[l];
        if constexpr (pulls) {
          const V dx_w = hn::Set(d, b.dx_w[3 * i + j][l]), dy_w = hn::Set(d, b.dy_w[3 * i + j][l]);
          if constexpr (carries)
            P[l] = hn::MulAdd(dx_w, tx[l], hn::MulAdd(dy_w, ty[l], P[l]));
          else
            P[l] = hn::MulAdd(dx_w, tx[l], dy_w * ty[l]);
          Q[l] = w * tz[l];
        }
      }
      double* line = reinterpret_cast<double*>(nodes + i * stride_x + j * stride_y) + offset;
      for (int k = 0; k < 3; ++k) {
        V sum = hn::Load(d, line + 8 * k);
        for (int l = 0; l < lanes; ++l) {
          sum = hn::MulAdd(hn::Set(d, b.wz[k][l]), P[l], sum);
          if constexpr (pulls) sum = hn::MulAdd(hn::Set(d, b.dz_w[k][l]), Q[l], sum);
        }
        hn::Store(sum, d, line + 8 * k);
      }
    }
}

/// Lines 2-4 of Algorithm 1 for a batch. `t` is -V0 tau / dx; lanes that take no part have mass, momentum and
/// t zero.
template <class D, class V = hn::Vec<D>>
HWY_INLINE void add_to_cell(D d, const V (&s)[3], const V (&momentum)[3], V mass, const Symmetric<V>& t,
                            Node* nodes, int stride_x, int stride_y) {
  constexpr int lanes = int(hn::MaxLanes(d));
  const V one = hn::Set(d, 1.0), half = hn::Set(d, 0.5);
  V w[3][3], dw[3][3];
  for (int a = 0; a < 3; ++a) {  // QuadraticBSpline
    const V rest = one - s[a];
    w[a][0] = half * rest * rest;
    w[a][1] = hn::MulAdd(s[a], rest, half);
    w[a][2] = half * s[a] * s[a];
    dw[a][0] = hn::Neg(rest);
    dw[a][1] = rest - s[a];
    dw[a][2] = s[a];
  }
  Scatter<lanes> b;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) {
      hn::Store(w[0][i] * w[1][j], d, b.w[3 * i + j]);
      hn::Store(dw[0][i] * w[1][j], d, b.dx_w[3 * i + j]);
      hn::Store(w[0][i] * dw[1][j], d, b.dy_w[3 * i + j]);
    }
  for (int k = 0; k < 3; ++k) {
    hn::Store(w[2][k], d, b.wz[k]);
    hn::Store(dw[2][k], d, b.dz_w[k]);
  }
  const V zero = hn::Zero(d);
  hn::StoreInterleaved4(momentum[0], momentum[1], momentum[2], mass, d, b.carried[0]);
  hn::StoreInterleaved4(t.xx, t.xy, t.xz, zero, d, b.traction[0][0]);
  hn::StoreInterleaved4(t.xy, t.yy, t.yz, zero, d, b.traction[1][0]);
  hn::StoreInterleaved4(t.xz, t.yz, t.zz, zero, d, b.traction[2][0]);
  asm volatile("" ::: "memory");

  const NodeVector dn;
  constexpr int width = int(hn::MaxLanes(dn));
  if constexpr (width == 8) {
    add_to_nodes<true, true>(dn, b, 0, nodes, stride_x, stride_y);
  } else {
    for (int offset = 0; offset < 4; offset += width)
      add_to_nodes<true, false>(dn, b, offset, nodes, stride_x, stride_y);
    for (int offset = 4; offset < 8; offset += width)
      add_to_nodes<false, true>(dn, b, offset, nodes, stride_x, stride_y);
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace anticrack
HWY_AFTER_NAMESPACE();
#endif
