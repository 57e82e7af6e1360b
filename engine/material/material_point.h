#pragma once

#include <array>
#include <optional>

#include "material/material_parameters.h"
#include "vec3.h"

namespace anticrack {

enum class Branch { elastic, cone, apex };

/// Elastic state of a material point in principal axes.
struct PrincipalState {
  Vec3 strain = Vec3::Zero();  ///< elastic Hencky strain [-]
  double kappa = 0;            ///< accumulated |dev eps^p| [-]
  Branch branch = Branch::elastic;
};

/// One step of the engine's own return mapping from the trial strain `trial` and kappa before it; without
/// plasticity the trial state itself.
PrincipalState return_principal(const Material& material, ReturnMapping mapping, const Vec3& trial,
                                double kappa);

double mean_stress(const Material& material, const Vec3& strain);  ///< p = -K tr eps, Kirchhoff [Pa]
double von_mises(const Material& material, const Vec3& strain);    ///< q = sqrt(3/2) |dev tau| [Pa]

/// Hencky strain, Kirchhoff stress and energy of a deformation gradient, by its singular values.
struct HenckyState {
  std::array<double, 6> strain;  ///< xx yy zz xy xz yz
  std::array<double, 6> tau;     ///< [Pa]
  double p, q;                   ///< [Pa]
  double psi;                    ///< Eq. 6 [J/m^3]
};

/// Nothing where det F <= 0 or F is not finite: no state of a solid.
std::optional<HenckyState> hencky_state(const HenckyElasticity& elasticity, const Mat3& F);

}  // namespace anticrack
