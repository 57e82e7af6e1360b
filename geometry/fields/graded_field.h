#pragma once

#include <vector>

#include "fields/gaussian_random_field.h"

namespace anticrack {

/// A Gaussian random field whose wavelength changes along an axis from face to face of the box.
///
/// G(r) = sum_m w_m(z) G_m(r): independent stationary fields G_m, wave numbers scaled by gradient^{-m/M}, m =
/// 0
/// ... M, nodes equally spaced along the axis, of which two neighbours blend at each height. Their weights
/// are the cosine and the sine of an angle that turns smoothly (two continuous derivatives) from 0 to pi/2,
/// so that sum w_m^2 = 1: the field is exactly Gaussian with the same variance at every height, and the solid
/// fraction of a cut through it the same. The local <eta^2> is sum w_m^2 <eta_m^2>; the turning angle a adds
/// (da/dz)^2 along the axis. Without gradient it is one field, the same to the last bit.
class GradedField {
 public:
  /// @throws InputError  if a parameter is out of range, or the gradient and `periodic` are both asked
  static GradedField sample(const GaussianRandomFieldSpec& spec, const SampleLattice& lattice, int number);

  double evaluate(const Vec3& r) const;  ///< r [m]

  /// G - level on the padded lattice, rounded to single precision once; x fastest.
  std::vector<float> evaluate_excess_on_lattice(const SampleLattice& lattice, int padding,
                                                double level) const;

 private:
  std::vector<double> weights(double height) const;  // of the fields, at a height [m] along the axis

  std::vector<GaussianRandomField> fields_;
  int axis_ = 2;
  double extent_ = 1;  // [m] of the box along the axis
};

}  // namespace anticrack
