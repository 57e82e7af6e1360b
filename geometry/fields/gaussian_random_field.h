#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "fields/wave_spectrum.h"
#include "sample_lattice.h"
#include "vec3.h"

namespace anticrack {

/// Parameters of a Gaussian random field made of plane waves; paper, section 2.1 and Table 1.
struct GaussianRandomFieldSpec {
  int waves;                    ///< N_c [-], >= 1; paper: 1e4
  double wavelengths_per_side;  ///< N_w [-], > 0: shortest side over 2 pi / <eta>; paper: 9
  double heterogeneity;         ///< b [-], > 0: width of the wave number's distribution; paper: 50
  std::uint64_t seed;           ///< names the realization

  /// Ratio of lengths along `anisotropy_axis` to lengths across it, > 0: above 1 prolate, below 1 oblate. The
  /// isotropic field is stretched by anisotropy^{2/3} along the axis and by anisotropy^{-1/3} across, which
  /// keeps volumes: wave vectors shrink by the same factors, and <eta^2> of each axis is exact.
  double anisotropy = 1.0;
  int anisotropy_axis = 2;
  /// Law of the wave number in place of `wavelengths_per_side` and `heterogeneity`.
  std::optional<WaveSpectrum> spectrum = {};
  /// Wavelength at the upper face of `gradient_axis` over that at the lower face, where the law above holds;
  /// see GradedField.
  double wavelength_gradient = 1.0;
  int gradient_axis = 2;
  /// Wave vectors on the reciprocal lattice of the box: the field goes on across opposite faces. Each
  /// component moves by at most pi / L, and <eta_i^2> grows by (2 pi / L_i)^2 / 12: for isotropic waves in a
  /// cube <eta^2> by 1 / (4 N_w^2), 0.3 % at nine wavelengths a side.
  bool periodic = false;

  /// <eta> [1/m] before stretching, at the lower face of the gradient.
  double mean_wave_number(double shortest_side) const;
};

/// One wave cos(eta . r + phase) of the sum.
struct PlaneWave {
  Vec3 eta;      ///< wave vector [1/m]
  double phase;  ///< [rad], in [0, 2 pi)
};

/// G(r) = N_c^{-1/2} sum_n cos(eta_n . r + phase_n), Eq. 1. The variance over realizations is 1/2.
class GaussianRandomField {
 public:
  /// Draws the waves. |eta| follows the gamma law of shape b+1 and scale <eta>/(b+1), <eta> = 2 pi N_w /
  /// shortest_side (Eq. 2 with the prefactor (b+1)^{b+1} / (<eta> Gamma(b+1)); the printed one is not
  /// normalized); directions are uniform on the sphere, phases uniform. Wave n depends on the seed and n
  /// alone.
  /// @param shortest_side  [m], > 0
  /// @throws InputError  if a parameter is out of range
  static GaussianRandomField sample(const GaussianRandomFieldSpec& spec, double shortest_side);

  /// The same with what else the spec asks but for the gradient.
  /// @param box     edges of the sample box [m]
  /// @param stream  fields of different streams are independent; stream 0 is the field above
  /// @param scale   of all wave numbers, > 0
  static GaussianRandomField sample(const GaussianRandomFieldSpec& spec, const Vec3& box, int stream,
                                    double scale = 1.0);

  /// A field of given waves. @throws InputError if there is none
  explicit GaussianRandomField(std::vector<PlaneWave> waves);

  const std::vector<PlaneWave>& waves() const { return waves_; }

  /// The plain sum at r [m].
  double evaluate(const Vec3& r) const;

  /// G on the lattice widened by `padding` points on each side, (n_x + 2 padding) (n_y + 2 padding) (n_z + 2
  /// padding) values, x fastest. Differs from `evaluate` by less than 1e-10; same bits on any number of
  /// threads.
  std::vector<double> evaluate_on_lattice(const SampleLattice& lattice, int padding) const;

  /// G - level, rounded to single precision after the subtraction (so that its sign is exact), in the same
  /// order.
  std::vector<float> evaluate_excess_on_lattice(const SampleLattice& lattice, int padding,
                                                double level) const;

 private:
  std::vector<PlaneWave> waves_;
};

}  // namespace anticrack
