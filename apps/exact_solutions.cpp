#include "exact_solutions.h"

#include <cmath>
#include <numbers>
#include <string>

#include "errors.h"
#include "time_step.h"

namespace anticrack {

namespace {

constexpr double pi = std::numbers::pi;

}  // namespace

ManufacturedWave::ManufacturedWave(const Material& material, double amplitude)
    : material_(material), amplitude_(amplitude) {
  // Ratios that no symmetry relates.
  omega_ = pi * elastic_wave_speed(material) * Vec3(1.0, 0.8, 1.15);
}

double ManufacturedWave::end_time() const {
  return 1.5 / elastic_wave_speed(material_);
}

Vec3 ManufacturedWave::displacement(const Vec3& X, double t) const {
  Vec3 u;
  for (int i = 0; i < 3; ++i) u[i] = amplitude_ * std::sin(2 * pi * X[i]) * std::sin(omega_[i] * t);
  return u;
}

Vec3 ManufacturedWave::velocity(const Vec3& X, double t) const {
  Vec3 v;
  for (int i = 0; i < 3; ++i)
    v[i] = amplitude_ * std::sin(2 * pi * X[i]) * omega_[i] * std::cos(omega_[i] * t);
  return v;
}

Mat3 ManufacturedWave::velocity_gradient(const Vec3& X, double t) const {
  Vec3 slope;
  for (int i = 0; i < 3; ++i)
    slope[i] = 2 * pi * amplitude_ * std::cos(2 * pi * X[i]) * omega_[i] * std::cos(omega_[i] * t);
  return slope.cwiseQuotient(stretch(X, t)).asDiagonal();
}

Vec3 ManufacturedWave::stretch(const Vec3& X, double t) const {
  Vec3 F;
  for (int i = 0; i < 3; ++i)
    F[i] = 1 + 2 * pi * amplitude_ * std::cos(2 * pi * X[i]) * std::sin(omega_[i] * t);
  return F;
}

Vec3 ManufacturedWave::principal_stress(const Vec3& F) const {
  const Vec3 eps = F.array().log();
  return material_.elasticity.lambda() * eps.sum() * Vec3::Ones() + 2 * material_.elasticity.mu() * eps;
}

SymmetricTensor ManufacturedWave::kirchhoff_stress(const Vec3& X, double t) const {
  const Vec3 tau = principal_stress(stretch(X, t));
  return {tau[0], tau[1], tau[2], 0, 0, 0};
}

Vec3 ManufacturedWave::body_acceleration(const Vec3& x, double t) const {
  Vec3 u, F, dF_dX;
  for (int i = 0; i < 3; ++i) {
    // X of x = X + u(X, t), by Newton's method.
    const double a = amplitude_ * std::sin(omega_[i] * t);
    double X = x[i], sine = 0, cosine = 1;
    for (int n = 0; n < 50; ++n) {
      sine = std::sin(2 * pi * X), cosine = std::cos(2 * pi * X);
      const double change = (X + a * sine - x[i]) / (1 + 2 * pi * a * cosine);
      X -= change;
      if (std::abs(change) < 1e-13) break;
    }
    u[i] = a * sine;
    F[i] = 1 + 2 * pi * a * cosine;
    dF_dX[i] = -4 * pi * pi * u[i];
  }
  const Vec3 tau = principal_stress(F);
  const double modulus = material_.elasticity.lambda() + 2 * material_.elasticity.mu();
  Vec3 b;
  for (int i = 0; i < 3; ++i)
    b[i] = -omega_[i] * omega_[i] * u[i] - dF_dX[i] * (modulus - tau[i]) / (material_.density * F[i] * F[i]);
  return b;
}

struct GeneralizedVortex::Ring {
  double r;
  double alpha, alpha_dot, alpha_dot_dot, dalpha_dot_dr;
  double gamma, dgamma_dr;
  double cosine, sine;  ///< of the polar angle
};

GeneralizedVortex::GeneralizedVortex(const Material& material, double amplitude, double period,
                                     const Vec3& centre)
    : mu_(material.elasticity.mu()),
      density_(material.density),
      amplitude_(amplitude),
      period_(period),
      centre_(centre) {}

GeneralizedVortex::Ring GeneralizedVortex::ring(const Vec3& from_axis, double t) const {
  Ring ring{};
  ring.r = std::hypot(from_axis[0], from_axis[1]);
  ring.cosine = from_axis[0] / ring.r, ring.sine = from_axis[1] / ring.r;
  const double u = ring.r - 1, w = 1 - 16 * u * u;
  if (!(w > 0)) return ring;  // at rest outside the annulus
  const double h = w * w * w, dh = -96 * u * w * w, ddh = -96 * w * w + 6144 * u * u * w;
  const double omega = 2 * pi / period_;
  const double g = 0.5 * amplitude_ * (1 - std::cos(omega * t));
  ring.alpha = g * h;
  ring.alpha_dot = 0.5 * amplitude_ * omega * std::sin(omega * t) * h;
  ring.alpha_dot_dot = 0.5 * amplitude_ * omega * omega * std::cos(omega * t) * h;
  ring.dalpha_dot_dr = 0.5 * amplitude_ * omega * std::sin(omega * t) * dh;
  ring.gamma = ring.r * g * dh;
  ring.dgamma_dr = g * (dh + ring.r * ddh);
  return ring;
}

bool GeneralizedVortex::contains(const Vec3& X) const {
  const double R = std::hypot(X[0] - centre_[0], X[1] - centre_[1]);
  return R > inner_radius && R < outer_radius;
}

Vec3 GeneralizedVortex::displacement(const Vec3& X, double t) const {
  const Vec3 P = X - centre_;
  const double alpha = ring(P, t).alpha;
  const double c = std::cos(alpha) - 1, s = std::sin(alpha);
  return {c * P[0] - s * P[1], s * P[0] + c * P[1], 0};
}

Vec3 GeneralizedVortex::velocity(const Vec3& X, double t) const {
  const Vec3 P = X + displacement(X, t) - centre_;
  const double omega = ring(P, t).alpha_dot;
  return {-omega * P[1], omega * P[0], 0};
}

Mat3 GeneralizedVortex::velocity_gradient(const Vec3& X, double t) const {
  const Ring at = ring(X + displacement(X, t) - centre_, t);
  const Vec3 e_r(at.cosine, at.sine, 0), e_t(-at.sine, at.cosine, 0);
  return at.alpha_dot * (e_t * e_r.transpose() - e_r * e_t.transpose()) +
         at.r * at.dalpha_dot_dr * e_t * e_r.transpose();
}

SymmetricTensor GeneralizedVortex::kirchhoff_stress(const Vec3& X, double t) const {
  const Ring at = ring(X + displacement(X, t) - centre_, t);
  const double a = std::asinh(0.5 * at.gamma);
  const double rr = -2 * mu_ * a * std::tanh(a), rt = 2 * mu_ * a / std::cosh(a);  // tt = -rr
  const double cos2 = at.cosine * at.cosine - at.sine * at.sine, sin2 = 2 * at.cosine * at.sine;
  const double xx = rr * cos2 - rt * sin2, xy = rr * sin2 + rt * cos2;
  return {xx, -xx, 0, xy, 0, 0};
}

Vec3 GeneralizedVortex::body_acceleration(const Vec3& x, double t) const {
  const Ring at = ring(x - centre_, t);
  const double a = std::asinh(0.5 * at.gamma), da_dr = 0.5 * at.dgamma_dr / std::cosh(a);
  const double tanh = std::tanh(a), cosh = std::cosh(a);
  const double rr = -2 * mu_ * a * tanh, rt = 2 * mu_ * a / cosh;
  const double drr_dr = -2 * mu_ * (tanh + a / (cosh * cosh)) * da_dr;
  const double drt_dr = 2 * mu_ * (1 - a * tanh) / cosh * da_dr;
  const double b_r = -at.r * at.alpha_dot * at.alpha_dot - (drr_dr + 2 * rr / at.r) / density_;
  const double b_t = at.r * at.alpha_dot_dot - (drt_dr + 2 * rt / at.r) / density_;
  return {b_r * at.cosine - b_t * at.sine, b_r * at.sine + b_t * at.cosine, 0};
}

RadialPath radial_path(const Material& material, const Vec3& principal_strain) {
  const double K = material.elasticity.bulk_modulus(), mu = material.elasticity.mu();
  const double trace = principal_strain.sum();
  const double S = (principal_strain - trace / 3 * Vec3::Ones()).norm();
  const double sqrt6_mu = std::sqrt(6.0) * mu;
  if (!material.plasticity) return {-K * trace, sqrt6_mu * S, 0};
  const DruckerPragerSoftening& yield = *material.plasticity;
  const double A = yield.friction / sqrt6_mu;
  const auto cohesion = [&](double kappa) { return yield.cohesion * std::exp(-yield.softening * kappa); };
  // Excess of the elastic |dev eps| over the yield surface falls as kappa grows: one root, by bisection.
  const auto excess = [&](double kappa) { return S - kappa - A * (cohesion(kappa) - K * trace); };
  if (excess(0) <= 0) return {-K * trace, sqrt6_mu * S, 0};
  if (K * trace >= cohesion(S))
    throw InputError("radial path of volume strain " + std::to_string(trace) +
                     ": reaches the tip of the yield surface; expected one that stays on its cone");
  double low = 0, high = S;
  for (int n = 0; n < 200 && low < high; ++n) {
    const double middle = 0.5 * (low + high);
    (excess(middle) > 0 ? low : high) = middle;
  }
  const double kappa = 0.5 * (low + high);
  return {-K * trace, yield.friction * (cohesion(kappa) - K * trace), kappa};
}

std::optional<double> void_array_bulk_modulus(double void_fraction) {
  constexpr std::array<std::array<double, 2>, 6> known{
      {{.05, .8784}, {.1, .7739}, {.2, .6020}, {.3, .4644}, {.4, .3481}, {.5, .2413}}};
  for (const auto& [fraction, ratio] : known)
    if (std::abs(fraction - void_fraction) < 1e-12) return ratio;
  return {};
}

}  // namespace anticrack
