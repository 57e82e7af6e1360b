// Particle to grid: mass, momentum and force of particles into the 27 nodes of their dual cell. Per-target
// include guard.
#if defined(ANTICRACK_PARTICLES_TO_GRID_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef ANTICRACK_PARTICLES_TO_GRID_INL_H
#undef ANTICRACK_PARTICLES_TO_GRID_INL_H
#else
#define ANTICRACK_PARTICLES_TO_GRID_INL_H
#endif

#include <type_traits>

#include "material/hencky-inl.h"
#include "transfer/grid_to_particles-inl.h"

HWY_BEFORE_NAMESPACE();
namespace anticrack {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

/// The affine part of APIC: a node at y cells from the particle gets the momentum w m (v + dx C y).
template <int size>
struct AffineContributions {
  double moment[3][2][size];              ///< w y of the outer nodes; those of an axis add up to 0
  alignas(32) double affine[3][size][4];  ///< columns x, y, z of m dx C, fourth number 0
};
struct NoAffineContributions {};

/// What `size` particles contribute to the grid: momentum, mass and tractions turned so that a particle's
/// numbers lie as a node's do. Weights and their slopes by s only of the outer nodes, 0 and 2: those of the
/// three nodes of an axis add up to 1 and to 0.
template <int size, bool with_affine>
struct alignas(64) Contributions
    : std::conditional_t<with_affine, AffineContributions<size>, NoAffineContributions> {
  double w[3][2][size], dw[3][2][size];     ///< [axis][lower, upper node] of each particle
  alignas(32) double carried[size][4];      ///< momentum, mass
  alignas(32) double traction[3][size][4];  ///< columns x, y, z of -V0 tau / dx, fourth number 0
};

/// Stores what the lanes of a batch contribute, as particles `first`, `first` + 1, ... Lanes that take no
/// part have s, momentum, mass and t zero.
template <class D, int size, bool with_affine, class V = hn::Vec<D>>
HWY_INLINE void store_contributions(D d, const V (&s)[3], const V (&momentum)[3], V mass,
                                    const Symmetric<V>& t, int first, Contributions<size, with_affine>& g) {
  const V one = hn::Set(d, 1.0), half = hn::Set(d, 0.5), zero = hn::Zero(d);
  for (int a = 0; a < 3; ++a) {  // QuadraticBSpline
    const V rest = one - s[a];
    hn::StoreU(half * rest * rest, d, g.w[a][0] + first);
    hn::StoreU(half * s[a] * s[a], d, g.w[a][1] + first);
    hn::StoreU(hn::Neg(rest), d, g.dw[a][0] + first);
    hn::StoreU(s[a], d, g.dw[a][1] + first);
  }
  hn::StoreInterleaved4(momentum[0], momentum[1], momentum[2], mass, d, g.carried[first]);
  hn::StoreInterleaved4(t.xx, t.xy, t.xz, zero, d, g.traction[0][first]);
  hn::StoreInterleaved4(t.xy, t.yy, t.yz, zero, d, g.traction[1][first]);
  hn::StoreInterleaved4(t.xz, t.yz, t.zz, zero, d, g.traction[2][first]);
}

/// The affine part, `affine` = m dx C. The moments of the outer nodes as products: nothing cancels.
template <class D, int size, class V = hn::Vec<D>>
HWY_INLINE void store_affine(D d, const V (&s)[3], const V (&affine)[9], int first,
                             AffineContributions<size>& g) {
  const V one = hn::Set(d, 1.0), half = hn::Set(d, 0.5), zero = hn::Zero(d);
  for (int a = 0; a < 3; ++a) {
    const V rest = one - s[a];
    hn::StoreU(hn::Neg(half * rest * rest) * (half + s[a]), d, g.moment[a][0] + first);
    hn::StoreU(half * s[a] * s[a] * (half + rest), d, g.moment[a][1] + first);
    hn::StoreInterleaved4(affine[a], affine[3 + a], affine[6 + a], zero, d, g.affine[a][first]);
  }
}

/// The nodes of an axis while particles are summed: the lower, all three together, the upper.
enum AxisNode { lower, all, upper };

/// From {lower, all, upper} to the three nodes. The middle weight is at least a half, so nothing cancels.
template <class V>
HWY_INLINE void split_middle(V low, V& middle, V high) {
  middle = middle - low - high;
}

/// The numbers of a node that are summed together: momentum and mass, the force, or all.
enum class NodePart { momentum, force, all };

/// Four numbers and four zeros.
template <class D>
HWY_INLINE hn::Vec<D> in_lower_half(D d, const double* from) {
#if HWY_TARGET == HWY_SCALAR
  return hn::Zero(d);
#else
  return hn::ZeroExtendVector(d, hn::Load(hn::Half<D>(), from));
#endif
}
template <class D>
HWY_INLINE hn::Vec<D> in_upper_half(D d, const double* from) {
#if HWY_TARGET == HWY_SCALAR
  return hn::Zero(d);
#else
  return hn::Combine(d, hn::Load(hn::Half<D>(), from), hn::Zero(hn::Half<D>()));
#endif
}

/// Adds particles [begin, end) to the 27 nodes of their cell: to the numbers from `offset` on of a part of
/// each node, as many as a vector has lanes. Node (i, j, k) gets wz_k P_j + wz'_k Q_j with P_j = wy_j (wx_i
/// carried + wx'_i T_x) + wy'_j wx_i T_y, Q_j = wy_j wx_i T_z, of which momentum has `carried` and the force
/// the tractions T. The affine part has this form too: there w' are the moments, T the columns of m dx C.
template <NodePart part, int size, bool with_affine, class D>
HWY_INLINE void add_to_nodes(D d, const Contributions<size, with_affine>& g, int begin, int end, int offset,
                             Node* nodes, int stride_x, int stride_y) {
  using V = hn::Vec<D>;
  constexpr bool carries = part != NodePart::force, has_force = part != NodePart::momentum;
  constexpr bool whole = carries && has_force, has_slopes = has_force || with_affine;
  const auto carried = [&](int p) HWY_ATTR {
    if constexpr (whole)
      return in_lower_half(d, g.carried[p]);
    else
      return hn::Load(d, g.carried[p] + offset);
  };
  const auto column = [&](int axis, int p) HWY_ATTR {  // T
    if constexpr (whole)
      return in_upper_half(d, g.traction[axis][p]);
    else if constexpr (has_force)
      return hn::Load(d, g.traction[axis][p] + offset);
    else if constexpr (with_affine)
      return hn::Load(d, g.affine[axis][p] + offset);
  };
  const auto slope = [&](int axis, int side, int p) HWY_ATTR {  // w'
    if constexpr (has_force)
      return hn::Set(d, g.dw[axis][side][p]);
    else if constexpr (with_affine)
      return hn::Set(d, g.moment[axis][side][p]);
  };
  V sum[3][3][3];
  // P and Q of a j go to {lower, all, upper} along z.
  const auto add_particle = [&](auto node, int p) ANTICRACK_INLINE {
    constexpr int i = node;
    const V wz[2] = {hn::Set(d, g.w[2][0][p]), hn::Set(d, g.w[2][1][p])};
    V dz[2];
    if constexpr (has_slopes) dz[0] = slope(2, 0, p), dz[1] = slope(2, 1, p);
    V along_x, along_y, along_z;  // wx carried + wx' T_x, wx T_y, wx T_z
    if constexpr (i == all) {
      if constexpr (carries) along_x = carried(p);
      if constexpr (has_slopes) along_y = column(1, p);
      if constexpr (has_slopes) along_z = column(2, p);
    } else {
      const V wx = hn::Set(d, g.w[0][i / 2][p]);
      if constexpr (carries) along_x = wx * carried(p);
      if constexpr (has_slopes) {
        const V dx = slope(0, i / 2, p);
        along_x = carries ? hn::MulAdd(dx, column(0, p), along_x) : dx * column(0, p);
        along_y = wx * column(1, p);
        along_z = wx * column(2, p);
      }
    }
    constexpr bool has_x = carries || i != all;
    const auto add = [&](V(&to)[3], V P, V Q) ANTICRACK_INLINE {
      to[all] = to[all] + P;
      to[lower] = hn::MulAdd(wz[0], P, to[lower]);
      to[upper] = hn::MulAdd(wz[1], P, to[upper]);
      if constexpr (has_slopes) to[lower] = hn::MulAdd(dz[0], Q, to[lower]);
      if constexpr (has_slopes) to[upper] = hn::MulAdd(dz[1], Q, to[upper]);
    };
    for (const int j : {lower, upper}) {
      const V wy = hn::Set(d, g.w[1][j / 2][p]);
      V P, Q;
      if constexpr (has_x) P = wy * along_x;
      if constexpr (has_slopes) {
        const V dy = slope(1, j / 2, p);
        P = has_x ? hn::MulAdd(dy, along_y, P) : dy * along_y;
        Q = wy * along_z;
      }
      add(sum[i][j], P, Q);
    }
    if constexpr (has_x) {
      add(sum[i][all], along_x, along_z);
    } else {
      sum[i][all][lower] = hn::MulAdd(dz[0], along_z, sum[i][all][lower]);
      sum[i][all][upper] = hn::MulAdd(dz[1], along_z, sum[i][all][upper]);
    }
  };
  const auto clear = [&](int i) ANTICRACK_INLINE {
    for (int j = 0; j < 3; ++j)
      for (int k = 0; k < 3; ++k) sum[i][j][k] = hn::Zero(d);
  };
  const auto split_middles = [&](int i) ANTICRACK_INLINE {
    for (int j = 0; j < 3; ++j) split_middle(sum[i][j][lower], sum[i][j][all], sum[i][j][upper]);
    for (int k = 0; k < 3; ++k) split_middle(sum[i][lower][k], sum[i][all][k], sum[i][upper][k]);
  };
  const auto sum_particles = [&](auto... i) ANTICRACK_INLINE {
    (clear(i), ...);
    for (int p = begin; p < end; ++p) (add_particle(i, p), ...);
    (split_middles(i), ...);
  };
  constexpr std::integral_constant<int, lower> lower_x;
  constexpr std::integral_constant<int, all> all_x;
  constexpr std::integral_constant<int, upper> upper_x;
  if constexpr (whole) {  // AVX-512 has the registers for all sums
    sum_particles(lower_x, all_x, upper_x);
  } else {
    sum_particles(lower_x);
    sum_particles(all_x);
    sum_particles(upper_x);
  }
  for (int j = 0; j < 3; ++j)
    for (int k = 0; k < 3; ++k) split_middle(sum[lower][j][k], sum[all][j][k], sum[upper][j][k]);
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) {
      double* line =
          reinterpret_cast<double*>(nodes + i * stride_x + j * stride_y) + (carries ? 0 : 4) + offset;
      for (int k = 0; k < 3; ++k) hn::Store(hn::Load(d, line + 8 * k) + sum[i][j][k], d, line + 8 * k);
    }
}

/// Lines 2-4 of Algorithm 1 for particles [begin, end), all of one cell, whose lowest node is `nodes`. The
/// halves of a node apart, since momentum has no tractions, the force no momenta, unless eight lanes take no
/// longer than four.
template <int size, bool with_affine>
HWY_INLINE void add_to_cell(bool full_width, const Contributions<size, with_affine>& g, int begin, int end,
                            Node* nodes, int stride_x, int stride_y) {
  const NodeVector whole;
  const HalfNodeVector half;
  if constexpr (hn::MaxLanes(whole) == 8 && !with_affine)
    if (full_width) return add_to_nodes<NodePart::all>(whole, g, begin, end, 0, nodes, stride_x, stride_y);
  for (int offset = 0; offset < 4; offset += int(hn::MaxLanes(half)))
    add_to_nodes<NodePart::momentum>(half, g, begin, end, offset, nodes, stride_x, stride_y);
  for (int offset = 0; offset < 4; offset += int(hn::MaxLanes(half)))
    add_to_nodes<NodePart::force>(half, g, begin, end, offset, nodes, stride_x, stride_y);
}

}  // namespace HWY_NAMESPACE
}  // namespace anticrack
HWY_AFTER_NAMESPACE();
#endif
