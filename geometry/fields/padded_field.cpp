#include "fields/padded_field.h"

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

}  // namespace

FieldJet interpolate_jet(const PaddedField& field, const Vec3& x) {
  const Vec3 base = x.array().floor();
  const Eigen::Vector3f u = (x - base).cast<float>();
  const CubicWeights wx(u[0]), wy(u[1]), wz(u[2]);
  const float* corner = &field.values[field.offset(int(base[0]) - 1, int(base[1]) - 1, int(base[2]) - 1)];

  // Contract z and y for the four x columns together; the digits name the order of the derivative in y and z.
  Row f00 = Row::Zero(), f10 = f00, f01 = f00, f20 = f00, f11 = f00, f02 = f00;
  for (int k = 0; k < 4; ++k) {
    Row g0 = Row::Zero(), g1 = g0, g2 = g0;
    for (int j = 0; j < 4; ++j) {
      const Row row = Eigen::Map<const Row>(corner + k * field.plane_stride() + j * field.row_stride());
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

}  // namespace anticrack
