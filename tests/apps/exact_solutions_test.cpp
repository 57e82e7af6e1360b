#include "exact_solutions.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>

#include "errors.h"
#include "material/material_point.h"

namespace anticrack {
namespace {

const Material material{1e4, {10e9, 0.3}, {}};

Vec3 unit(int a) {
  return Vec3::Unit(a);
}

/// F by central differences of the displacement.
template <class Motion>
Mat3 deformation_gradient(const Motion& motion, const Vec3& X, double t) {
  constexpr double e = 1e-5;
  Mat3 F = Mat3::Identity();
  for (int a = 0; a < 3; ++a)
    F.col(a) += (motion.displacement(X + e * unit(a), t) - motion.displacement(X - e * unit(a), t)) / (2 * e);
  return F;
}

Mat3 full(const SymmetricTensor& t) {
  Mat3 m;
  m << t[0], t[3], t[4], t[3], t[1], t[5], t[4], t[5], t[2];
  return m;
}

/// The motion's body force balances momentum: rho0 u'' = Div P + rho0 b, P = tau F^-T with its own stress, by
/// central differences.
template <class Motion>
void expect_balance_of_momentum(const Motion& motion, const Vec3& X, double t, double time_scale) {
  constexpr double e = 2e-4;
  const double et = 1e-3 * time_scale;
  const Vec3 acceleration =
      (motion.displacement(X, t + et) - 2 * motion.displacement(X, t) + motion.displacement(X, t - et)) /
      (et * et);
  const auto first_piola = [&](const Vec3& at) -> Mat3 {
    return full(motion.kirchhoff_stress(at, t)) * deformation_gradient(motion, at, t).inverse().transpose();
  };
  Vec3 divergence = Vec3::Zero();
  for (int a = 0; a < 3; ++a)
    divergence += (first_piola(X + e * unit(a)).col(a) - first_piola(X - e * unit(a)).col(a)) / (2 * e);
  const Vec3 b = motion.body_acceleration(X + motion.displacement(X, t), t);
  const double scale = acceleration.norm() + divergence.norm() / material.density;
  // Second-order differences of smooth functions.
  EXPECT_LT((acceleration - divergence / material.density - b).norm(), 2e-4 * scale)
      << X.transpose() << ", " << t;
}

/// The stress is that of Hencky elasticity for the motion's deformation gradient.
template <class Motion>
void expect_hencky_stress(const Motion& motion, const Vec3& X, double t) {
  const auto state = hencky_state(material.elasticity, deformation_gradient(motion, X, t));
  ASSERT_TRUE(state);
  const SymmetricTensor tau = motion.kirchhoff_stress(X, t);
  double scale = 0;
  for (const double component : state->tau) scale = std::max(scale, std::abs(component));
  for (int e = 0; e < 6; ++e) EXPECT_NEAR(tau[e], state->tau[e], 1e-6 * scale) << e;
}

template <class Motion>
void expect_velocity_and_its_gradient(const Motion& motion, const Vec3& X, double t, double time_scale) {
  const double et = 1e-5 * time_scale;
  const Vec3 v = (motion.displacement(X, t + et) - motion.displacement(X, t - et)) / (2 * et);
  EXPECT_LT((motion.velocity(X, t) - v).norm(), 1e-7 * v.norm());
  // dv/dX = grad v . F
  constexpr double e = 1e-5;
  Mat3 by_material;
  for (int a = 0; a < 3; ++a)
    by_material.col(a) =
        (motion.velocity(X + e * unit(a), t) - motion.velocity(X - e * unit(a), t)) / (2 * e);
  const Mat3 gradient = motion.velocity_gradient(X, t) * deformation_gradient(motion, X, t);
  EXPECT_LT((gradient - by_material).norm(), 1e-6 * by_material.norm());
}

TEST(ManufacturedWave, IsAMotionOfHenckyElasticityUnderItsBodyForce) {
  for (const double amplitude : {5e-4, 0.05}) {
    const ManufacturedWave wave(material, amplitude);
    for (const Vec3& X : {Vec3(0.13, 0.41, 0.77), Vec3(0.55, 0.9, 0.31)})
      for (const double share : {0.2, 0.7}) {
        const double t = share * wave.end_time();
        expect_hencky_stress(wave, X, t);
        expect_balance_of_momentum(wave, X, t, wave.end_time());
        expect_velocity_and_its_gradient(wave, X, t, wave.end_time());
      }
  }
}

TEST(ManufacturedWave, StandsStillAlongTheNormalOfTheWalls) {
  const ManufacturedWave wave(material, 0.05);
  for (int a = 0; a < 3; ++a) {
    Vec3 X(0.3, 0.4, 0.6);
    for (const double wall : {0.0, 1.0}) {
      X[a] = wall;
      EXPECT_NEAR(wave.displacement(X, 0.3 * wave.end_time())[a], 0, 1e-16);
    }
  }
}

TEST(GeneralizedVortex, IsAMotionOfHenckyElasticityUnderItsBodyForce) {
  const Vec3 centre(1.4, 1.5, 0);
  const double period = 1e-3;
  const GeneralizedVortex vortex(material, 0.1, period, centre);
  for (const double R : {0.8, 0.93, 1.03, 1.17})
    for (const double angle : {0.3, 2.9})
      for (const double share : {0.2, 0.45}) {
        const Vec3 X = centre + R * Vec3(std::cos(angle), std::sin(angle), 0);
        ASSERT_TRUE(vortex.contains(X));
        expect_hencky_stress(vortex, X, share * period);
        expect_balance_of_momentum(vortex, X, share * period, period);
        expect_velocity_and_its_gradient(vortex, X, share * period, period);
      }
}

TEST(GeneralizedVortex, EdgesAreAtRestAndFreeOfStress) {
  const GeneralizedVortex vortex(material, 0.1, 1e-3, Vec3::Zero());
  for (const double R : {GeneralizedVortex::inner_radius, GeneralizedVortex::outer_radius}) {
    EXPECT_LT(vortex.displacement({R, 0, 0}, 4e-4).norm(), 1e-15);
    for (const double t : vortex.kirchhoff_stress({R, 0, 0}, 4e-4)) EXPECT_EQ(t, 0);
  }
}

TEST(RadialPath, IsWhatManySmallImplicitStepsReach) {
  Material softening = material;
  softening.plasticity = DruckerPragerSoftening{0.5, 2.5e6, 1500};
  const Vec3 end(0, -2e-3, 0);
  PrincipalState state;
  constexpr int steps = 500;
  for (int n = 0; n < steps; ++n)
    state = return_principal(softening, ReturnMapping::implicit, state.strain + end / steps, state.kappa);
  const RadialPath path = radial_path(softening, end);
  // Exact in each step; roundings of the steps add up.
  EXPECT_NEAR(state.kappa / path.kappa, 1, 1e-10);
  EXPECT_NEAR(von_mises(softening, state.strain) / path.q, 1, 1e-10);
  EXPECT_NEAR(mean_stress(softening, state.strain) / path.pressure, 1, 1e-10);
  EXPECT_GT(path.kappa, 5e-4);  // it does soften
}

TEST(RadialPath, RefusesTheTip) {
  Material softening = material;
  softening.plasticity = DruckerPragerSoftening{0.5, 2.5e6, 1500};
  try {
    radial_path(softening, {2e-3, 1e-3, 2e-3});
    FAIL();
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("reaches the tip of the yield surface"), std::string::npos);
  }
}

}  // namespace
}  // namespace anticrack
