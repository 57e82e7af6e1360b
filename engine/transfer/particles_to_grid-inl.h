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

/// The numbers of a node that are summed together.
enum class NodePart { momentum, force };  ///< momentum and mass; the force

/// Adds particles [begin, end) to the 27 nodes of their cell: to the numbers from `offset` on of a part of
/// each node, as many as a vector has lanes. Node (i, j, k) gets wz_k P_j + wz'_k Q_j with P_j = wy_j (wx_i
/// carried + wx'_i T_x) + wy'_j wx_i T_y, Q_j = wy_j wx_i T_z, of which momentum has `carried` and the force
/// the tractions T. The affine part has this form too: there w' are the moments, T the columns of m dx C.
template <NodePart part, int size, bool with_affine, class D>
HWY_INLINE void add_to_nodes(D d, const Contributions<size, with_affine>& g, int begin, int end, int offset,
                             Node* nodes, int stride_x, int stride_y) {
  using V = hn::Vec<D>;
  constexpr bool carries = part == NodePart::momentum, has_force = part == NodePart::force;
  constexpr bool has_slopes = has_force || with_affine;
  const auto column = [&](int axis, int p) HWY_ATTR {  // T
    if constexpr (has_force)
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
      if constexpr (carries) along_x = hn::Load(d, g.carried[p] + offset);
      if constexpr (has_slopes) along_y = column(1, p);
      if constexpr (has_slopes) along_z = column(2, p);
    } else {
      const V wx = hn::Set(d, g.w[0][i / 2][p]);
      if constexpr (carries) along_x = wx * hn::Load(d, g.carried[p] + offset);
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
  const auto sum_particles = [&](auto i) ANTICRACK_INLINE {
    clear(i);
    for (int p = begin; p < end; ++p) add_particle(i, p);
    split_middles(i);
  };
  constexpr std::integral_constant<int, lower> lower_x;
  constexpr std::integral_constant<int, all> all_x;
  constexpr std::integral_constant<int, upper> upper_x;
  sum_particles(lower_x);
  sum_particles(all_x);
  sum_particles(upper_x);
  for (int j = 0; j < 3; ++j)
    for (int k = 0; k < 3; ++k) split_middle(sum[lower][j][k], sum[all][j][k], sum[upper][j][k]);
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) {
      double* line =
          reinterpret_cast<double*>(nodes + i * stride_x + j * stride_y) + (carries ? 0 : 4) + offset;
      for (int k = 0; k < 3; ++k) hn::Store(hn::Load(d, line + 8 * k) + sum[i][j][k], d, line + 8 * k);
    }
}

#if HWY_TARGET <= HWY_AVX3
/// The same for all numbers of a node at once, where eight lanes take no longer than four. The outer nodes
/// along x are summed in pairs, momentum and force apart, since neither has what the other is made of; their
/// sum over x as whole nodes. All 27 sums stay in registers.
template <class D, int size>
HWY_INLINE void add_to_whole_nodes(D d, const Contributions<size, false>& g, int begin, int end, Node* nodes,
                                   int stride_x, int stride_y) {
  using V = hn::Vec<D>;
  const hn::Half<D> half;
  const auto lower_half = hn::FirstN(d, hn::MaxLanes(half));
  const auto halves = [&](double low, double high)
                          HWY_ATTR { return hn::IfThenElse(lower_half, hn::Set(d, low), hn::Set(d, high)); };
  const auto join = [&](const double* low, const double* high)
                        HWY_ATTR { return hn::Combine(d, hn::Load(half, high), hn::Load(half, low)); };
  const auto twice = [&](const double* from) HWY_ATTR { return join(from, from); };
  const auto in_lower_half = [&](const double* from)
                                 HWY_ATTR { return hn::ZeroExtendVector(d, hn::Load(half, from)); };
  const auto in_upper_half = [&](const double* from)
                                 HWY_ATTR { return hn::Combine(d, hn::Load(half, from), hn::Zero(half)); };
  V momentum[3][3], force[3][3];  // {lower node along x | upper node}
  V whole[3][3];                  // {momentum | force} of all nodes along x
  for (int j = 0; j < 3; ++j)
    for (int k = 0; k < 3; ++k) momentum[j][k] = force[j][k] = whole[j][k] = hn::Zero(d);
  for (int p = begin; p < end; ++p) {
    const auto add_momentum = [&](V(&to)[3], V P) ANTICRACK_INLINE {
      to[all] = to[all] + P;
      to[lower] = hn::MulAdd(hn::Set(d, g.w[2][0][p]), P, to[lower]);
      to[upper] = hn::MulAdd(hn::Set(d, g.w[2][1][p]), P, to[upper]);
    };
    const auto add_force = [&](V(&to)[3], V P, V Q) ANTICRACK_INLINE {
      add_momentum(to, P);
      to[lower] = hn::MulAdd(hn::Set(d, g.dw[2][0][p]), Q, to[lower]);
      to[upper] = hn::MulAdd(hn::Set(d, g.dw[2][1][p]), Q, to[upper]);
    };
    const V wx = halves(g.w[0][0][p], g.w[0][1][p]), dx = halves(g.dw[0][0][p], g.dw[0][1][p]);
    {
      const V along_x = wx * twice(g.carried[p]);
      for (const int j : {lower, upper}) add_momentum(momentum[j], hn::Set(d, g.w[1][j / 2][p]) * along_x);
      add_momentum(momentum[all], along_x);
    }
    {
      const V along_x = dx * twice(g.traction[0][p]), along_y = wx * twice(g.traction[1][p]),
              along_z = wx * twice(g.traction[2][p]);
      for (const int j : {lower, upper}) {
        const V wy = hn::Set(d, g.w[1][j / 2][p]), dy = hn::Set(d, g.dw[1][j / 2][p]);
        add_force(force[j], hn::MulAdd(dy, along_y, wy * along_x), wy * along_z);
      }
      add_force(force[all], along_x, along_z);
    }
    {
      const V along_z = in_upper_half(g.traction[2][p]);
      for (const int j : {lower, upper})
        add_force(whole[j],
                  halves(g.w[1][j / 2][p], g.dw[1][j / 2][p]) * join(g.carried[p], g.traction[1][p]),
                  hn::Set(d, g.w[1][j / 2][p]) * along_z);
      const V both = join(g.carried[p], g.traction[2][p]);
      whole[all][all] = whole[all][all] + in_lower_half(g.carried[p]);
      for (const int k : {lower, upper})
        whole[all][k] = hn::MulAdd(halves(g.w[2][k / 2][p], g.dw[2][k / 2][p]), both, whole[all][k]);
    }
  }
  const auto split_middles = [](V(&sum)[3][3]) ANTICRACK_INLINE {
    for (int j = 0; j < 3; ++j) split_middle(sum[j][lower], sum[j][all], sum[j][upper]);
    for (int k = 0; k < 3; ++k) split_middle(sum[lower][k], sum[all][k], sum[upper][k]);
  };
  split_middles(momentum);
  split_middles(force);
  split_middles(whole);
  for (int j = 0; j < 3; ++j)
    for (int k = 0; k < 3; ++k) {
      const V low = hn::ConcatLowerLower(d, force[j][k], momentum[j][k]),
              high = hn::ConcatUpperUpper(d, force[j][k], momentum[j][k]);
      split_middle(low, whole[j][k], high);
      const auto add_to = [&](Node& node, V sum) ANTICRACK_INLINE {
        double* numbers = reinterpret_cast<double*>(&node);
        hn::Store(hn::Load(d, numbers) + sum, d, numbers);
      };
      Node* const line = nodes + j * stride_y + k;
      add_to(line[0], low);
      add_to(line[stride_x], whole[j][k]);
      add_to(line[2 * stride_x], high);
    }
}
#endif

/// Lines 2-4 of Algorithm 1 for particles [begin, end), all of one cell, whose lowest node is `nodes`. The
/// halves of a node apart, since momentum has no tractions, the force no momenta, unless eight lanes take no
/// longer than four.
template <int size, bool with_affine>
HWY_INLINE void add_to_cell([[maybe_unused]] bool full_width, const Contributions<size, with_affine>& g,
                            int begin, int end, Node* nodes, int stride_x, int stride_y) {
#if HWY_TARGET <= HWY_AVX3
  if constexpr (!with_affine)
    if (full_width) return add_to_whole_nodes(NodeVector(), g, begin, end, nodes, stride_x, stride_y);
#endif
  const HalfNodeVector half;
  for (int offset = 0; offset < 4; offset += int(hn::MaxLanes(half)))
    add_to_nodes<NodePart::momentum>(half, g, begin, end, offset, nodes, stride_x, stride_y);
  for (int offset = 0; offset < 4; offset += int(hn::MaxLanes(half)))
    add_to_nodes<NodePart::force>(half, g, begin, end, offset, nodes, stride_x, stride_y);
}

}  // namespace HWY_NAMESPACE
}  // namespace anticrack
HWY_AFTER_NAMESPACE();
#endif
