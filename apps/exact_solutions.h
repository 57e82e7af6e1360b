#pragma once

#include <array>
#include <optional>

#include "material/material_parameters.h"
#include "vec3.h"

namespace anticrack {

/// Components xx yy zz xy xz yz.
using SymmetricTensor = std::array<double, 6>;

/// A manufactured motion of the unit cube between slip walls: u_i = A sin(2 pi X_i) sin(omega_i t), each axis
/// with a frequency of its own. Hencky elasticity; the walls at 0 and 1 see no motion along their normal and
/// no shear.
class ManufacturedWave {
 public:
  /// @param amplitude  A [m], below 1 / (2 pi), where the motion would fold
  ManufacturedWave(const Material& material, double amplitude);

  double amplitude() const { return amplitude_; }
  double end_time() const;                           ///< a wave has crossed the cube three times in two [s]
  Vec3 displacement(const Vec3& X, double t) const;  ///< [m]
  Vec3 velocity(const Vec3& X, double t) const;      ///< [m/s]
  Mat3 velocity_gradient(const Vec3& X, double t) const;            ///< in space [1/s]
  SymmetricTensor kirchhoff_stress(const Vec3& X, double t) const;  ///< [Pa]

  /// b_i = u_i'' - F_i' (lambda + 2 mu - tau_i) / (rho0 F_i^2) with F_i = 1 + 2 pi A cos(2 pi X_i)
  /// sin(omega_i t), from rho0 u_i'' = dP_i/dX_i + rho0 b_i and P_i = tau_i / F_i.
  /// @param x  place at time t [m]
  Vec3 body_acceleration(const Vec3& x, double t) const;  ///< [m/s^2]

 private:
  Vec3 stretch(const Vec3& X, double t) const;
  Vec3 principal_stress(const Vec3& F) const;

  Material material_;
  double amplitude_;
  Vec3 omega_;
};

/// The generalized vortex (Brannon, Kamojjala & Sadeghirad 2011): an annulus 0.75 <= R <= 1.25 about an axis
/// along z whose rings turn by alpha(R, t) = A h(R) (1 - cos(2 pi t / T)) / 2, h = (1 - 16 (R - 1)^2)^3; its
/// edges stay at rest and free of stress. Simple shear gamma = R dalpha/dR in a turning frame, which Hencky
/// elasticity answers up to gamma = 3.02; A <= 0.1 stays far below.
class GeneralizedVortex {
 public:
  static constexpr double inner_radius = 0.75, outer_radius = 1.25;  ///< [m]

  /// @param amplitude  A [rad]
  /// @param period     T [s]
  /// @param centre     where the axis goes through the plane [m]
  GeneralizedVortex(const Material& material, double amplitude, double period, const Vec3& centre);

  bool contains(const Vec3& X) const;
  double end_time() const { return period_; }
  Vec3 displacement(const Vec3& X, double t) const;
  Vec3 velocity(const Vec3& X, double t) const;
  Mat3 velocity_gradient(const Vec3& X, double t) const;
  SymmetricTensor kirchhoff_stress(const Vec3& X, double t) const;
  /// b = a - div sigma / rho with sigma of simple shear: sigma_rr = -sigma_tt = -2 mu a tanh a, sigma_rt = 2
  /// mu a / cosh a, gamma = 2 sinh a.
  Vec3 body_acceleration(const Vec3& x, double t) const;

 private:
  struct Ring;  // the radius, and what turns there
  Ring ring(const Vec3& from_axis, double t) const;

  double mu_, density_, amplitude_, period_;
  Vec3 centre_;
};

/// Stress of a material whose total strain moves along one ray, eps = strain * direction, from rest: the
/// plastic strain kappa is the only unknown. Once it yields, |dev eps| - kappa = A (C(kappa) - K tr eps) with
/// A = gamma / (sqrt6 mu), C = c e^{-xi kappa}, whatever steps lead there.
struct RadialPath {
  double pressure, q, kappa;  ///< [Pa], [Pa], [-]
};
/// @throws InputError  if the path reaches the tip of the yield surface, where it is no ray any more
RadialPath radial_path(const Material& material, const Vec3& principal_strain);

/// Effective bulk modulus over the solid's, nu = 0.3, of a cubic array of spherical voids: a centred void in
/// a cube between slip walls. Known to 1e-3 for the volume fractions .05 .1 .2 .3 .4 .5.
std::optional<double> void_array_bulk_modulus(double void_fraction);

}  // namespace anticrack
