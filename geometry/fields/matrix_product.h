#pragma once

#include <cstddef>

namespace anticrack {

/// A block of a row-major matrix: row r begins at data + r * stride.
template <class T>
struct MatrixBlock {
  T* data;
  std::size_t rows, columns, stride;
};

/// c = a b for small dense matrices, with the widest vectors this processor has. Each entry is one sum in the
/// order of a's columns, so it does not depend on how a caller cuts the product into blocks of rows.
void multiply(MatrixBlock<const double> a, MatrixBlock<const double> b, MatrixBlock<double> c);

}  // namespace anticrack
