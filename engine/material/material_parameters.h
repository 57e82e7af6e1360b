#pragma once

#include <optional>

namespace anticrack {

/// Isotropic Hencky (logarithmic St. Venant-Kirchhoff) elasticity, Eqs. 5-7 of Blatny et al. (2021).
struct HenckyElasticity {
  double young_modulus;  ///< E [Pa], > 0; Table 1: 10 GPa
  double poisson_ratio;  ///< nu [-], -1 < nu < 0.5; Table 1: 0.3

  double lambda() const {
    return young_modulus * poisson_ratio / ((1 + poisson_ratio) * (1 - 2 * poisson_ratio));
  }
  double mu() const { return young_modulus / (2 * (1 + poisson_ratio)); }
  double bulk_modulus() const { return young_modulus / (3 * (1 - 2 * poisson_ratio)); }
};

/// Softening Drucker-Prager yield surface y = q - gamma (p + c exp(-xi kappa)), Eq. 8; deviatoric flow.
struct DruckerPragerSoftening {
  double friction;   ///< gamma [-], >= 0; Table 1: 1.2 (a friction angle of 30 degrees)
  double cohesion;   ///< c [Pa], >= 0; Table 1: 2.5 MPa; mesh dependent, section 4 of the paper
  double softening;  ///< xi [-], >= 0; Table 1: 1e6
};

/// The solid phase. Without `plasticity` it is elastic only, and nothing of kappa or the return mapping
/// exists.
struct Material {
  double density;  ///< rho [kg/m^3], > 0; Table 1: 1e4 (ten times ice: a time scaling, section 2.4)
  HenckyElasticity elasticity;
  std::optional<DruckerPragerSoftening> plasticity;
};

/// How a trial state is returned to the yield surface.
enum class ReturnMapping {
  implicit,  ///< backward Euler, closed to rounding
  paper,     ///< the one-pass predictor-corrector of Algorithm 2, with its slips repaired; leaves a yield
             ///< residual
};

}  // namespace anticrack
