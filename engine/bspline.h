#pragma once

namespace anticrack {

/// Quadratic B-spline of Eq. 12 seen from a particle's dual cell.
///
/// A particle at grid coordinate X = x / dx reaches the nodes base, base + 1, base + 2 with base = floor(X -
/// 1/2). Its dual cell is named by `base`, and s = X - 1/2 - base in [0, 1] is its place there. Within a dual
/// cell the weights are plain polynomials in s; they and their first derivatives join continuously at s = 0
/// and s = 1.
template <class Real>
struct QuadraticBSpline {
  Real w[3];   ///< N at the three nodes
  Real dw[3];  ///< dN/ds at the three nodes; dN/dx = dw / dx

  explicit QuadraticBSpline(Real s)
      : w{Real(0.5) * (Real(1) - s) * (Real(1) - s), Real(0.5) + s * (Real(1) - s), Real(0.5) * s * s},
        dw{s - Real(1), Real(1) - Real(2) * s, s} {}
};

}  // namespace anticrack
