// Compiled once for each vector instruction set; HWY_DYNAMIC_DISPATCH picks at run time.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "fields/matrix_product.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "fields/matrix_product.h"

HWY_BEFORE_NAMESPACE();
namespace anticrack::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

// Columns [column, column + 2 lanes) of c: four rows at a time keep eight sums in registers.
template <class Tag>
void multiply_strip(Tag tag, MatrixBlock<const double> a, MatrixBlock<const double> b, MatrixBlock<double> c,
                    std::size_t column) {
  const std::size_t lanes = hn::Lanes(tag);
  const double* strip = b.data + column;
  std::size_t row = 0;
  for (; row + 4 <= a.rows; row += 4) {
    const double* a0 = a.data + row * a.stride;
    const double *a1 = a0 + a.stride, *a2 = a1 + a.stride, *a3 = a2 + a.stride;
    auto c00 = hn::Zero(tag), c01 = c00, c10 = c00, c11 = c00, c20 = c00, c21 = c00, c30 = c00, c31 = c00;
    for (std::size_t m = 0; m < a.columns; ++m) {
      const auto b0 = hn::LoadU(tag, strip + m * b.stride), b1 = hn::LoadU(tag, strip + m * b.stride + lanes);
      const auto r0 = hn::Set(tag, a0[m]), r1 = hn::Set(tag, a1[m]);
      c00 = hn::MulAdd(r0, b0, c00), c01 = hn::MulAdd(r0, b1, c01);
      c10 = hn::MulAdd(r1, b0, c10), c11 = hn::MulAdd(r1, b1, c11);
      const auto r2 = hn::Set(tag, a2[m]), r3 = hn::Set(tag, a3[m]);
      c20 = hn::MulAdd(r2, b0, c20), c21 = hn::MulAdd(r2, b1, c21);
      c30 = hn::MulAdd(r3, b0, c30), c31 = hn::MulAdd(r3, b1, c31);
    }
    double* out = c.data + row * c.stride + column;
    hn::StoreU(c00, tag, out), hn::StoreU(c01, tag, out + lanes), out += c.stride;
    hn::StoreU(c10, tag, out), hn::StoreU(c11, tag, out + lanes), out += c.stride;
    hn::StoreU(c20, tag, out), hn::StoreU(c21, tag, out + lanes), out += c.stride;
    hn::StoreU(c30, tag, out), hn::StoreU(c31, tag, out + lanes);
  }
  for (; row < a.rows; ++row) {
    auto c0 = hn::Zero(tag), c1 = c0;
    for (std::size_t m = 0; m < a.columns; ++m) {
      const auto r = hn::Set(tag, a.data[row * a.stride + m]);
      c0 = hn::MulAdd(r, hn::LoadU(tag, strip + m * b.stride), c0);
      c1 = hn::MulAdd(r, hn::LoadU(tag, strip + m * b.stride + lanes), c1);
    }
    hn::StoreU(c0, tag, c.data + row * c.stride + column);
    hn::StoreU(c1, tag, c.data + row * c.stride + column + lanes);
  }
}

void multiply_target(MatrixBlock<const double> a, MatrixBlock<const double> b, MatrixBlock<double> c) {
  const hn::ScalableTag<double> full;
  const hn::CappedTag<double, 1> single;
  std::size_t column = 0;
  for (; column + 2 * hn::Lanes(full) <= b.columns; column += 2 * hn::Lanes(full))
    multiply_strip(full, a, b, c, column);
  for (; column + 2 <= b.columns; column += 2) multiply_strip(single, a, b, c, column);
  if (column < b.columns) {
    for (std::size_t row = 0; row < a.rows; ++row) {
      auto sum = hn::Zero(single);
      for (std::size_t m = 0; m < a.columns; ++m)
        sum = hn::MulAdd(hn::Set(single, a.data[row * a.stride + m]),
                         hn::LoadU(single, b.data + m * b.stride + column), sum);
      hn::StoreU(sum, single, c.data + row * c.stride + column);
    }
  }
}

}  // namespace anticrack::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace anticrack {

HWY_EXPORT(multiply_target);

void multiply(MatrixBlock<const double> a, MatrixBlock<const double> b, MatrixBlock<double> c) {
  HWY_DYNAMIC_DISPATCH(multiply_target)(a, b, c);
}

}  // namespace anticrack
#endif
