#include "material/material_point.h"

#include <Eigen/Dense>
#include <cmath>

#include "kernels.h"

namespace anticrack {

namespace {

/// |dev eps| without under- or overflow of the squares.
double deviator_norm(const Vec3& strain) {
  return (strain - Vec3::Constant(strain.sum() / 3)).stableNorm();
}

}  // namespace

double mean_stress(const Material& material, const Vec3& strain) {
  return -material.elasticity.bulk_modulus() * strain.sum();
}

double von_mises(const Material& material, const Vec3& strain) {
  return std::sqrt(6.0) * material.elasticity.mu() * deviator_norm(strain);
}

PrincipalState return_principal(const Material& material, ReturnMapping mapping, const Vec3& trial,
                                double kappa) {
  const Model model = model_of(material, mapping);
  if (model == Model::hencky) return {trial, kappa, Branch::elastic};
  const double trace = trial.sum(), norm = deviator_norm(trial);
  std::array<double, 3> state{trace, norm, kappa};
  bool yielded = false;
  kernels().return_mapping(model, MaterialConstants(material), std::span(&state, 1), std::span(&yielded, 1));
  if (!yielded) return {trial, kappa, Branch::elastic};
  const auto [new_trace, new_norm, new_kappa] = state;
  Vec3 strain = Vec3::Constant(new_trace / 3);
  if (new_norm > 0) strain += new_norm / norm * (trial - Vec3::Constant(trace / 3));
  return {strain, new_kappa, new_norm > 0 ? Branch::cone : Branch::apex};
}

std::optional<HenckyState> hencky_state(const HenckyElasticity& elasticity, const Mat3& F) {
  if (!F.allFinite()) return std::nullopt;
  const Eigen::JacobiSVD<Mat3> svd(F, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Vec3 stretch = svd.singularValues();
  if (!(stretch.minCoeff() > 0) || svd.matrixU().determinant() * svd.matrixV().determinant() < 0)
    return std::nullopt;
  const Vec3 eps = stretch.array().log();
  const auto rotate = [&](const Vec3& principal) {
    const Mat3 a = svd.matrixU() * principal.asDiagonal() * svd.matrixU().transpose();
    return std::array<double, 6>{a(0, 0), a(1, 1), a(2, 2), a(0, 1), a(0, 2), a(1, 2)};
  };
  const Material material{0, elasticity, std::nullopt};
  const double trace = eps.sum(), norm = deviator_norm(eps);
  const Vec3 dev = eps - Vec3::Constant(trace / 3);
  const Vec3 tau = Vec3::Constant(elasticity.bulk_modulus() * trace) + 2 * elasticity.mu() * dev;
  return HenckyState{rotate(eps), rotate(tau), mean_stress(material, eps), von_mises(material, eps),
                     0.5 * elasticity.bulk_modulus() * trace * trace + elasticity.mu() * norm * norm};
}

}  // namespace anticrack
