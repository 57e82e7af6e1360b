#include "fields/padded_field.h"

#include <algorithm>
#include <array>

namespace anticrack {
namespace {

using Row = Eigen::Array4f;  // the four x neighbours of a stencil row

// Weights of the points -1, 0, 1, 2 at u in [0, 1], and their first and second derivatives in u.
struct CubicWeights {
  explicit CubicWeights(float u)
      : value(-u * (u - 1) * (u - 2) / 6, (u + 1) * (u - 1) * (u - 2) / 2, -(u + 1) * u * (u - 2) / 2,
              (u + 1) * u * (u - 1) / 6),
        first(-(3 * u * u - 6 * u + 2) / 6, (3 * u * u - 4 * u - 1) / 2, -(3 * u * u - 2 * u - 2) / 2,
              (3 * u * u - 1) / 6),
        second(1 - u, 3 * u - 2, 1 - 3 * u, u) {}

  Row value, first, second;
};

// Weights of the points -2 ... 3 at u in [0, 1].
std::array<float, 6> quintic_weights(float u) {
  const float a = u + 2, b = u + 1, c = u, d = u - 1, e = u - 2, f = u - 3;
  return {-b * c * d * e * f / 120, a * c * d * e * f / 24,  -a * b * d * e * f / 12,
          a * b * c * e * f / 12,   -a * b * c * d * f / 24, a * b * c * d * e / 120};
}

constexpr int septic_points = 8;
using LongRow = Eigen::Array<float, septic_points, 1>;

// Weights of the points 0 ... 7 at u, and their first and second derivatives in u.
struct SepticWeights {
  explicit SepticWeights(double u) {
    for (int n = 0; n < septic_points; ++n) {
      double product = 1, slope = 0, bend = 0;  // of the factors so far; bend: half the second derivative
      for (int m = 0; m < septic_points; ++m) {
        if (m == n) continue;
        const double factor = (u - m) / (n - m), rate = 1.0 / (n - m);
        bend = bend * factor + slope * rate;
        slope = slope * factor + product * rate;
        product *= factor;
      }
      value[n] = float(product), first[n] = float(slope), second[n] = float(2 * bend);
    }
  }

  LongRow value, first, second;
};

// Value and derivatives from a stencil of rows along x, the first at `corner`.
template <class Row, class Weights>
FieldJet contract(const Weights& wx, const Weights& wy, const Weights& wz, const float* corner,
                  const PaddedField& field) {
  // Contract z and y for the x columns together; the digits name the order of the derivative in y and z.
  Row f00 = Row::Zero(), f10 = f00, f01 = f00, f20 = f00, f11 = f00, f02 = f00;
  for (Eigen::Index k = 0; k < wz.value.size(); ++k) {
    Row g0 = Row::Zero(), g1 = g0, g2 = g0;
    for (Eigen::Index j = 0; j < wy.value.size(); ++j) {
      const Row row = Eigen::Map<const Row>(corner + k * std::ptrdiff_t(field.plane_stride()) +
                                            j * std::ptrdiff_t(field.row_stride()));
      g0 += wy.value[j] * row;
      g1 += wy.first[j] * row;
      g2 += wy.second[j] * row;
    }
    f00 += wz.value[k] * g0;
    f10 += wz.value[k] * g1;
    f20 += wz.value[k] * g2;
    f01 += wz.first[k] * g0;
    f11 += wz.first[k] * g1;
    f02 += wz.second[k] * g0;
  }
  const auto along_x = [](const Row& weights, const Row& row) { return double((weights * row).sum()); };
  FieldJet jet;
  jet.value = along_x(wx.value, f00);
  jet.gradient = {along_x(wx.first, f00), along_x(wx.value, f10), along_x(wx.value, f01)};
  const double xy = along_x(wx.first, f10), xz = along_x(wx.first, f01), yz = along_x(wx.value, f11);
  jet.hessian << along_x(wx.second, f00), xy, xz,  //
      xy, along_x(wx.value, f20), yz,              //
      xz, yz, along_x(wx.value, f02);
  return jet;
}

}  // namespace

FieldJet interpolate_jet(const PaddedField& field, const Vec3& x) {
  const Vec3 base = x.array().floor();
  const Eigen::Vector3f u = (x - base).cast<float>();
  const CubicWeights wx(u[0]), wy(u[1]), wz(u[2]);
  const float* corner = &field.values[field.offset(int(base[0]) - 1, int(base[1]) - 1, int(base[2]) - 1)];

  return contract<Row>(wx, wy, wz, corner, field);
}

double interpolate_value(const PaddedField& field, const Vec3& x) {
  const Vec3 base = x.array().floor();
  const Eigen::Vector3f u = (x - base).cast<float>();
  const auto wx = quintic_weights(u[0]), wy = quintic_weights(u[1]), wz = quintic_weights(u[2]);
  const float* corner = &field.values[field.offset(int(base[0]) - 2, int(base[1]) - 2, int(base[2]) - 2)];
  std::array<float, 6> columns{};
  for (int k = 0; k < 6; ++k) {
    for (int j = 0; j < 6; ++j) {
      const float* row = corner + k * field.plane_stride() + j * field.row_stride();
      const float weight = wz[k] * wy[j];
      for (int i = 0; i < 6; ++i) columns[i] += weight * row[i];
    }
  }
  double sum = 0.0;
  for (int i = 0; i < 6; ++i) sum += double(wx[i]) * double(columns[i]);
  return sum;
}

FieldJet interpolate_jet_finely(const PaddedField& field, const Vec3& x) {
  std::array<int, 3> first;
  for (int axis = 0; axis < 3; ++axis)
    first[axis] = std::clamp(int(std::floor(x[axis])) - 3, -PaddedField::padding,
                             field.points[axis] + PaddedField::padding - septic_points);
  const auto weights = [&](int axis) { return SepticWeights(x[axis] - first[axis]); };
  const float* corner = &field.values[field.offset(first[0], first[1], first[2])];
  return contract<LongRow>(weights(0), weights(1), weights(2), corner, field);
}

}  // namespace anticrack
