// Hencky strain of h = b - I and back, on the lanes of a vector. Per-target include guard (Highway).
#if defined(ANTICRACK_HENCKY_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef ANTICRACK_HENCKY_INL_H
#undef ANTICRACK_HENCKY_INL_H
#else
#define ANTICRACK_HENCKY_INL_H
#endif

#include <hwy/contrib/math/math-inl.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace anticrack {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

/// Symmetric tensor, one particle a lane.
template <class V>
struct Symmetric {
  V xx, yy, zz, xy, xz, yz;
};

template <class V>
HWY_INLINE V trace(const Symmetric<V>& a) {
  return a.xx + a.yy + a.zz;
}

/// a : a
template <class D, class V = hn::Vec<D>>
HWY_INLINE V norm_squared(D d, const Symmetric<V>& a) {
  const V diagonal = hn::MulAdd(a.xx, a.xx, hn::MulAdd(a.yy, a.yy, a.zz * a.zz));
  const V off = hn::MulAdd(a.xy, a.xy, hn::MulAdd(a.xz, a.xz, a.yz * a.yz));
  return hn::MulAdd(hn::Set(d, 2.0), off, diagonal);
}

template <class V>
HWY_INLINE V determinant(const Symmetric<V>& a) {
  const V xx = hn::NegMulAdd(a.yz, a.yz, a.yy * a.zz);
  const V xy = hn::NegMulAdd(a.xy, a.zz, a.xz * a.yz);
  const V xz = hn::NegMulAdd(a.xz, a.yy, a.xy * a.yz);
  return hn::MulAdd(a.xx, xx, hn::MulAdd(a.xy, xy, a.xz * xz));
}

/// a a
template <class V>
HWY_INLINE Symmetric<V> square(const Symmetric<V>& a) {
  return {hn::MulAdd(a.xx, a.xx, hn::MulAdd(a.xy, a.xy, a.xz * a.xz)),
          hn::MulAdd(a.xy, a.xy, hn::MulAdd(a.yy, a.yy, a.yz * a.yz)),
          hn::MulAdd(a.xz, a.xz, hn::MulAdd(a.yz, a.yz, a.zz * a.zz)),
          hn::MulAdd(a.xx, a.xy, hn::MulAdd(a.xy, a.yy, a.xz * a.yz)),
          hn::MulAdd(a.xx, a.xz, hn::MulAdd(a.xy, a.yz, a.xz * a.zz)),
          hn::MulAdd(a.xy, a.xz, hn::MulAdd(a.yy, a.yz, a.yz * a.zz))};
}

/// r0 I + r1 a + r2 a^2
template <class V>
struct CayleyHamilton {
  V r0, r1, r2;

  HWY_INLINE Symmetric<V> apply(const Symmetric<V>& a, const Symmetric<V>& a2) const {
    return {hn::MulAdd(r2, a2.xx, hn::MulAdd(r1, a.xx, r0)),
            hn::MulAdd(r2, a2.yy, hn::MulAdd(r1, a.yy, r0)),
            hn::MulAdd(r2, a2.zz, hn::MulAdd(r1, a.zz, r0)),
            hn::MulAdd(r2, a2.xy, r1 * a.xy),
            hn::MulAdd(r2, a2.xz, r1 * a.xz),
            hn::MulAdd(r2, a2.yz, r1 * a.yz)};
  }
};

/// |a| up to which the series are full double precision: the first term of the tensor's logarithm left out is
/// 0.12^15 / 15.
constexpr double series_range = 0.12;
/// |a| up to which their first terms are: of the tensor's logarithm 0.005^8 / 8 is left out.
constexpr double short_range = 0.005;

/// Coefficients of a power series, and how many of them suffice within `short_range`.
template <std::size_t terms>
struct Series {
  std::size_t few;
  double coefficient[terms];
};

constexpr Series<15> log_series = {8,
                                   {0, 1., -1. / 2, 1. / 3, -1. / 4, 1. / 5, -1. / 6, 1. / 7, -1. / 8, 1. / 9,
                                    -1. / 10, 1. / 11, -1. / 12, 1. / 13, -1. / 14}};
/// e^x - 1
constexpr Series<13> exp_series = {7,
                                   {0, 1., 1. / 2, 1. / 6, 1. / 24, 1. / 120, 1. / 720, 1. / 5040, 1. / 40320,
                                    1. / 362880, 1. / 3628800, 1. / 39916800, 1. / 479001600}};
/// log(1 + a) = 2 atanh(z), z = a / (2 + a), in powers of z^2.
constexpr Series<7> atanh_series = {3, {2., 2. / 3, 2. / 5, 2. / 7, 2. / 9, 2. / 11, 2. / 13}};

/// sum_k coefficient[k] a^k for a trace-free `a`, by Horner's rule with a^3 = j2 a + j3 I; j2 = a:a / 2, j3 =
/// det a. Lanes `near` take the few terms whatever the others need: their bits do not depend on who else is
/// in the vector.
template <class D, std::size_t terms, class V = hn::Vec<D>, class M = hn::Mask<D>>
HWY_INLINE CayleyHamilton<V> power_series(D d, V j2, V j3, const Series<terms>& series, M near) {
  const auto coefficient = [&](std::size_t k) HWY_ATTR { return hn::Set(d, series.coefficient[k]); };
  CayleyHamilton<V> r{coefficient(series.few - 1), hn::Zero(d), hn::Zero(d)};
  const auto take_terms = [&](std::size_t from, std::size_t to) HWY_ATTR {
    for (std::size_t k = from; k-- > to;)
      r = {hn::MulAdd(j3, r.r2, coefficient(k)), hn::MulAdd(j2, r.r2, r.r0), r.r1};
  };
  if (HWY_UNLIKELY(!hn::AllTrue(d, near))) {
    const CayleyHamilton<V> start = r;
    r.r0 = coefficient(terms - 1);
    take_terms(terms - 1, series.few - 1);
    r = {hn::IfThenElse(near, start.r0, r.r0), hn::IfThenZeroElse(near, r.r1),
         hn::IfThenZeroElse(near, r.r2)};
  }
  take_terms(series.few - 1, 0);
  return r;
}

/// The same of numbers.
template <class D, std::size_t terms, class V = hn::Vec<D>, class M = hn::Mask<D>>
HWY_INLINE V power_series(D d, V x, const Series<terms>& series, M near) {
  const auto coefficient = [&](std::size_t k) HWY_ATTR { return hn::Set(d, series.coefficient[k]); };
  V sum = coefficient(series.few - 1);
  const auto take_terms = [&](std::size_t from, std::size_t to) HWY_ATTR {
    for (std::size_t k = from; k-- > to;) sum = hn::MulAdd(sum, x, coefficient(k));
  };
  if (HWY_UNLIKELY(!hn::AllTrue(d, near))) {
    const V start = sum;
    sum = coefficient(terms - 1);
    take_terms(terms - 1, series.few - 1);
    sum = hn::IfThenElse(near, start, sum);
  }
  take_terms(series.few - 1, 0);
  return sum;
}

/// Hencky strain of b = I + h split as the return mapping needs it.
template <class V>
struct HenckyStrain {
  V trace;                ///< tr eps
  Symmetric<V> deviator;  ///< dev eps
  V norm;                 ///< |dev eps|
};

template <class V>
struct Principal {
  V value[3];
  V axis[3][3];  ///< axis[i][a]: component a of the i-th eigenvector
};

/// Eigenvalues and eigenvectors by cyclic Jacobi sweeps: slow, accurate for any size of `a`, no branch per
/// lane.
template <class D, class V = hn::Vec<D>>
HWY_NOINLINE Principal<V> jacobi_eigen(D d, const Symmetric<V>& a) {
  const V zero = hn::Zero(d), one = hn::Set(d, 1.0);
  V m[3][3] = {{a.xx, a.xy, a.xz}, {a.xy, a.yy, a.yz}, {a.xz, a.yz, a.zz}};
  V q[3][3] = {{one, zero, zero}, {zero, one, zero}, {zero, zero, one}};
  for (int sweep = 0; sweep < 7;
       ++sweep)  // quadratic: five suffice for random tensors, seven for the worst of the tables
    for (int pair = 0; pair < 3; ++pair) {
      const int i = pair == 2 ? 1 : 0, j = pair == 0 ? 1 : 2, k = 3 - i - j;
      // t = tan of the rotation: smaller root of t^2 + 2 theta t - 1 = 0 (Golub & Van Loan, 8.5.2)
      const V difference = m[j][j] - m[i][i], twice = m[i][j] + m[i][j];
      const V length = hn::Sqrt(hn::MulAdd(difference, difference, twice * twice));
      const V denominator = hn::Abs(difference) + length;
      const V sign = hn::CopySign(one, difference);
      const V t = hn::IfThenElse(denominator > zero, sign * twice / denominator, zero);
      const V c = one / hn::Sqrt(hn::MulAdd(t, t, one)), s = t * c;
      m[i][i] = hn::NegMulAdd(t, m[i][j], m[i][i]);
      m[j][j] = hn::MulAdd(t, m[i][j], m[j][j]);
      m[i][j] = m[j][i] = zero;
      const V ki = m[k][i], kj = m[k][j];
      m[k][i] = m[i][k] = hn::NegMulAdd(s, kj, c * ki);
      m[k][j] = m[j][k] = hn::MulAdd(s, ki, c * kj);
      for (int r = 0; r < 3; ++r) {
        const V qi = q[r][i], qj = q[r][j];
        q[r][i] = hn::NegMulAdd(s, qj, c * qi);
        q[r][j] = hn::MulAdd(s, qi, c * qj);
      }
    }
  Principal<V> p;
  for (int i = 0; i < 3; ++i) {
    p.value[i] = m[i][i];
    for (int r = 0; r < 3; ++r) p.axis[i][r] = q[r][i];
  }
  return p;
}

/// sum_i value[i] n_i (x) n_i
template <class V>
HWY_INLINE Symmetric<V> assemble(const V (&value)[3], const V (&axis)[3][3]) {
  Symmetric<V> a;
  V* const out[6] = {&a.xx, &a.yy, &a.zz, &a.xy, &a.xz, &a.yz};
  constexpr int row[6] = {0, 1, 2, 0, 0, 1}, column[6] = {0, 1, 2, 1, 2, 2};
  for (int e = 0; e < 6; ++e)
    *out[e] = hn::MulAdd(value[0] * axis[0][row[e]], axis[0][column[e]],
                         hn::MulAdd(value[1] * axis[1][row[e]], axis[1][column[e]],
                                    value[2] * axis[2][row[e]] * axis[2][column[e]]));
  return a;
}

/// eps = 1/2 log(I + h), Eq. 5. b = (1 + a)(I + hbar) with a = tr h / 3 and hbar trace-free: a series in hbar
/// with its powers reduced by Cayley-Hamilton where |hbar| <= series_range, eigenvalues elsewhere. A lane
/// whose b is not positive definite gets NaN.
template <class D, class V = hn::Vec<D>>
HWY_INLINE HenckyStrain<V> hencky_strain(D d, const Symmetric<V>& h) {
  const V one = hn::Set(d, 1.0), half = hn::Set(d, 0.5), third = hn::Set(d, 1.0 / 3.0);
  const V a = trace(h) * third;
  const V scale = one / (one + a);
  const Symmetric<V> hbar{(h.xx - a) * scale, (h.yy - a) * scale, (h.zz - a) * scale,
                          h.xy * scale,       h.xz * scale,       h.yz * scale};
  const V j2 = half * norm_squared(d, hbar), j3 = determinant(hbar), size = hn::Abs(a);
  const auto within = [&](double range) HWY_ATTR {
    return hn::And(j2 <= hn::Set(d, 0.5 * range * range), size <= hn::Set(d, range));
  };
  const auto near = within(short_range);
  const CayleyHamilton<V> r = power_series(d, j2, j3, log_series, near);
  const V z = a / (hn::Set(d, 2.0) + a), log_a = z * power_series(d, z * z, atanh_series, near);

  HenckyStrain<V> strain;
  strain.trace = hn::MulAdd(r.r2, j2, hn::Set(d, 1.5) * (log_a + r.r0));
  // dev: 1/2 (r1 hbar + r2 (hbar^2 - 2/3 j2 I))
  strain.deviator = CayleyHamilton<V>{hn::Set(d, -1.0 / 3.0) * r.r2 * j2, half * r.r1, half * r.r2}.apply(
      hbar, square(hbar));

  const auto in_series = within(series_range);
  if (HWY_UNLIKELY(!hn::AllTrue(d, in_series))) {
    const Principal<V> p = jacobi_eigen(d, hbar);
    V log_value[3];
    const V nan = hn::NaN(d);
    for (int i = 0; i < 3; ++i)
      log_value[i] = hn::IfThenElse(p.value[i] > hn::Set(d, -1.0), hn::Log1p(d, p.value[i]), nan);
    const V mean = (log_value[0] + log_value[1] + log_value[2]) * third;
    V dev[3];
    for (int i = 0; i < 3; ++i) dev[i] = half * (log_value[i] - mean);
    const Symmetric<V> deviator = assemble(dev, p.axis);
    const V safe_log_a = hn::IfThenElse(one + a > hn::Zero(d), hn::Log1p(d, a), nan);
    strain.trace = hn::IfThenElse(in_series, strain.trace, hn::Set(d, 1.5) * (safe_log_a + mean));
    strain.deviator = {hn::IfThenElse(in_series, strain.deviator.xx, deviator.xx),
                       hn::IfThenElse(in_series, strain.deviator.yy, deviator.yy),
                       hn::IfThenElse(in_series, strain.deviator.zz, deviator.zz),
                       hn::IfThenElse(in_series, strain.deviator.xy, deviator.xy),
                       hn::IfThenElse(in_series, strain.deviator.xz, deviator.xz),
                       hn::IfThenElse(in_series, strain.deviator.yz, deviator.yz)};
  }
  strain.norm = hn::Sqrt(norm_squared(d, strain.deviator));
  return strain;
}

/// h = exp(2 eps) - I of eps = trace/3 I + deviator; the inverse of hencky_strain.
template <class D, class V = hn::Vec<D>>
HWY_INLINE Symmetric<V> left_cauchy_green_minus_identity(D d, V trace, const Symmetric<V>& deviator) {
  // exp(x) - I of the trace-free x = 2 dev / 2^k, then k squarings (I + y)^2 - I = 2 y + y^2 for lanes beyond
  // the series
  constexpr int squarings = 5;
  const V two = hn::Set(d, 2.0), zero = hn::Zero(d);
  const V size2 = hn::Set(d, 4.0) * norm_squared(d, deviator);
  const auto small = size2 <= hn::Set(d, 4 * series_range * series_range);
  const bool all_small = hn::AllTrue(d, small);
  const V factor = hn::IfThenElse(small, two, hn::Set(d, 2.0 / (1 << squarings)));
  const Symmetric<V> x{factor * deviator.xx, factor * deviator.yy, factor * deviator.zz,
                       factor * deviator.xy, factor * deviator.xz, factor * deviator.yz};
  const V j2 = hn::Set(d, 0.5) * norm_squared(d, x);
  const CayleyHamilton<V> r =
      power_series(d, j2, determinant(x), exp_series, j2 <= hn::Set(d, 0.5 * short_range * short_range));
  Symmetric<V> y = r.apply(x, square(x));
  if (HWY_UNLIKELY(!all_small))
    for (int k = 0; k < squarings; ++k) {
      const Symmetric<V> grown = CayleyHamilton<V>{zero, two, hn::Set(d, 1.0)}.apply(y, square(y));
      y = {hn::IfThenElse(small, y.xx, grown.xx), hn::IfThenElse(small, y.yy, grown.yy),
           hn::IfThenElse(small, y.zz, grown.zz), hn::IfThenElse(small, y.xy, grown.xy),
           hn::IfThenElse(small, y.xz, grown.xz), hn::IfThenElse(small, y.yz, grown.yz)};
    }
  // e^{2 trace/3} (I + y) - I = (e^{2 trace/3} - 1) I + e^{2 trace/3} y
  const V exponent = hn::Set(d, 2.0 / 3.0) * trace;
  V volume = power_series(d, exponent, exp_series, hn::Abs(exponent) <= hn::Set(d, short_range));
  const auto in_series = hn::Abs(exponent) <= hn::Set(d, 2 * series_range);
  if (HWY_UNLIKELY(!hn::AllTrue(d, in_series)))
    volume = hn::IfThenElse(in_series, volume, hn::Expm1(d, exponent));
  const V grow = volume + hn::Set(d, 1.0);
  return {hn::MulAdd(grow, y.xx, volume),
          hn::MulAdd(grow, y.yy, volume),
          hn::MulAdd(grow, y.zz, volume),
          grow * y.xy,
          grow * y.xz,
          grow * y.yz};
}

}  // namespace HWY_NAMESPACE
}  // namespace anticrack
HWY_AFTER_NAMESPACE();
#endif
