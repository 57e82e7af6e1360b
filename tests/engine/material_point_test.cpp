#include "material/material_point.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "csv_table.h"

namespace anticrack {
namespace {

Material material_of(const CsvTable& table, std::size_t row) {
  return {
      1e4,
      {table.number(row, "E_Pa"), table.number(row, "nu")},
      DruckerPragerSoftening{table.number(row, "gamma"), table.number(row, "c_Pa"), table.number(row, "xi")}};
}

Vec3 triple(const CsvTable& table, std::size_t row, const std::string& prefix) {
  return {table.number(row, prefix + "1"), table.number(row, prefix + "2"), table.number(row, prefix + "3")};
}

double yield(const Material& m, const PrincipalState& s) {
  return von_mises(m, s.strain) -
         m.plasticity->friction * (mean_stress(m, s.strain) +
                                   m.plasticity->cohesion * std::exp(-m.plasticity->softening * s.kappa));
}

TEST(ReturnMapping, ImplicitAgreesWithTheHighPrecisionTable) {
  const CsvTable table(ANTICRACK_ASSETS "/reference/return_mapping_reference.csv");
  ASSERT_EQ(table.size(), 50u);
  for (std::size_t row = 0; row < table.size(); ++row) {
    const Material m = material_of(table, row);
    const PrincipalState s = return_principal(m, ReturnMapping::implicit, triple(table, row, "etr"),
                                              table.number(row, "epsS_old"));
    const double tolerance = table.number(row, "BE_abs_tol_strain");
    const Vec3 exact = triple(table, row, "BE_e");
    const std::string id = table.text(row, "id") + " " + table.text(row, "description");
    for (int i = 0; i < 3; ++i) EXPECT_NEAR(s.strain[i], exact[i], tolerance) << id;
    EXPECT_NEAR(s.kappa, table.number(row, "BE_epsS"), tolerance) << id;
    if (table.text(row, "branch_ambiguous") == "1") continue;
    const std::string branch = s.branch == Branch::elastic ? "elastic"
                               : s.branch == Branch::cone  ? "cone"
                                                           : "apex";
    EXPECT_EQ(branch, table.text(row, "BE_branch")) << id;
  }
}

TEST(ReturnMapping, PaperAgreesWithTheHighPrecisionTable) {
  const CsvTable table(ANTICRACK_ASSETS "/reference/return_mapping_reference.csv");
  for (std::size_t row = 0; row < table.size(); ++row) {
    const Material m = material_of(table, row);
    const Vec3 trial = triple(table, row, "etr");
    const PrincipalState s = return_principal(m, ReturnMapping::paper, trial, table.number(row, "epsS_old"));
    const Vec3 exact = triple(table, row, "PC_e");
    // The one pass takes the overstress, a difference with a rounding of |trial|, through the slope xi A C of
    // the softening.
    const double tolerance = table.number(row, "BE_abs_tol_strain") +
                             4e-16 * trial.norm() * (1 + table.number(row, "snapback_number_xi_A_C"));
    const std::string id = table.text(row, "id") + " " + table.text(row, "description");
    for (int i = 0; i < 3; ++i) EXPECT_NEAR(s.strain[i], exact[i], tolerance) << id;
    EXPECT_NEAR(s.kappa, table.number(row, "PC_epsS"), tolerance) << id;
  }
}

TEST(ReturnMapping, FollowsTheClosedFormOfProportionalPaths) {
  const CsvTable table(ANTICRACK_ASSETS "/reference/return_mapping_paths.csv");
  for (std::size_t row = 0; row < table.size(); ++row) {
    const Material m = material_of(table, row);
    const Vec3 total = table.number(row, "t_strain_amplitude") * triple(table, row, "dir");
    // Backward Euler in one step lands on the end point of a proportional path without history, if it yields
    // on the cone.
    const PrincipalState s = return_principal(m, ReturnMapping::implicit, total, 0);
    const double q = table.number(row, "q_Pa"), scale = std::max({std::abs(q), m.plasticity->cohesion, 1.0});
    EXPECT_NEAR(s.kappa, table.number(row, "epsS_exact"), 1e-13 * std::max(1.0, total.norm()))
        << table.text(row, "path");
    EXPECT_NEAR(mean_stress(m, s.strain), table.number(row, "p_Pa"), 1e-12 * scale)
        << table.text(row, "path");
    EXPECT_NEAR(von_mises(m, s.strain), q, 1e-9 * scale) << table.text(row, "path");
  }
}

Material ice(double xi = 1e3) {
  return {1e4, {10e9, 0.3}, DruckerPragerSoftening{1.2, 2.5e6, xi}};
}

TEST(ReturnMapping, ReturnedStateLiesOnYieldSurface) {
  const Material m = ice();
  for (const Vec3& trial : {Vec3(3e-4, -3e-4, 0), Vec3(-2e-3, 0, 1e-3), Vec3(-2e-4, 5e-4, -4e-4)}) {
    const PrincipalState s = return_principal(m, ReturnMapping::implicit, trial, 1e-5);
    ASSERT_EQ(s.branch, Branch::cone);
    EXPECT_NEAR(yield(m, s), 0, 1e-9 * m.plasticity->cohesion);
    EXPECT_NEAR(s.strain.sum(), trial.sum(), 1e-18) << "flow is deviatoric";
  }
}

/// Strength in a stress path: the largest |sigma_1| that a path of small steps reaches with xi = 0.
template <class Path>
double strength(Path direction) {
  const Material m = ice(0);
  const double E = m.elasticity.young_modulus, nu = m.elasticity.poisson_ratio;
  const Vec3 stress = direction;  // elastic strain of a stress state: uniaxial and shear need no iteration
  Vec3 strain;
  for (int i = 0; i < 3; ++i) strain[i] = ((1 + nu) * stress[i] - nu * stress.sum()) / E;
  double low = 0, high = 1e8;
  for (int n = 0; n < 200; ++n) {
    const double middle = 0.5 * (low + high);
    (return_principal(m, ReturnMapping::implicit, middle * strain, 0).branch == Branch::elastic ? low
                                                                                                : high) =
        middle;
  }
  return low;
}

TEST(DruckerPrager, HasTheStrengthsOfItsConstants) {
  const double gamma = 1.2, c = 2.5e6;
  EXPECT_NEAR(strength(Vec3(-1, 0, 0)), gamma * c / (1 - gamma / 3), 1e-8 * c);  // sigma_c
  EXPECT_NEAR(strength(Vec3(1, 0, 0)), gamma * c / (1 + gamma / 3), 1e-8 * c);   // sigma_t
  EXPECT_NEAR(strength(Vec3(1, -1, 0)), gamma * c / std::sqrt(3.0), 1e-8 * c);   // tau_y
}

TEST(HenckyElasticity, AgreesWithTheHighPrecisionTable) {
  const CsvTable table(ANTICRACK_ASSETS "/reference/hencky_reference.csv");
  int refused = 0;
  for (std::size_t row = 0; row < table.size(); ++row) {
    Mat3 F;
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j)
        F(i, j) =
            table.number(row, std::string("F").append(std::to_string(i + 1)).append(std::to_string(j + 1)));
    const HenckyElasticity elasticity{table.number(row, "E_Pa"), table.number(row, "nu")};
    const auto s = hencky_state(elasticity, F);
    const std::string id = table.text(row, "id") + " " + table.text(row, "description");
    if (table.text(row, "status") != "OK") {
      EXPECT_FALSE(s) << id;
      ++refused;
      continue;
    }
    ASSERT_TRUE(s) << id;
    const double strain_tolerance = table.number(row, "abs_tol_strain_SVD");
    const double tau_tolerance = strain_tolerance * 3 * (std::abs(elasticity.lambda()) + 2 * elasticity.mu());
    const char* component[6] = {"11", "22", "33", "12", "13", "23"};
    for (int e = 0; e < 6; ++e) {
      EXPECT_NEAR(s->strain[e], table.number(row, std::string("eps") + component[e]), strain_tolerance) << id;
      EXPECT_NEAR(s->tau[e], table.number(row, std::string("tau") + component[e] + "_Pa"), tau_tolerance)
          << id;
    }
    EXPECT_NEAR(s->p, table.number(row, "p_Pa"), tau_tolerance) << id;
    EXPECT_NEAR(s->q, table.number(row, "q_Pa"), 2 * tau_tolerance) << id;
  }
  EXPECT_GT(refused, 0);
}

TEST(HenckyElasticity, HasTheClosedFormsOfUniaxialConfinedAndSimpleShear) {
  const HenckyElasticity e{10e9, 0.3};
  const double lambda = e.lambda(), mu = e.mu();
  for (const double stretch : {0.5, 0.9, 1.0001, 2.0}) {
    const double log = std::log(stretch);
    const auto confined = hencky_state(e, Vec3(stretch, 1, 1).asDiagonal().toDenseMatrix());
    EXPECT_NEAR(confined->tau[0], (lambda + 2 * mu) * log, 1e-14 * 1e10);
    EXPECT_NEAR(confined->tau[1], lambda * log, 1e-14 * 1e10);
    const double lateral = std::pow(stretch, -0.3);  // uniaxial stress: eps_2 = -nu eps_1 in Hencky strain
    const auto uniaxial = hencky_state(e, Vec3(stretch, lateral, lateral).asDiagonal().toDenseMatrix());
    EXPECT_NEAR(uniaxial->tau[0], 10e9 * log, 1e-5);
    EXPECT_NEAR(uniaxial->tau[1], 0, 1e-5);
  }
  for (const double k :
       {1e-6, 0.1, 1.0, 3.0}) {  // simple shear: eps_1 = asinh(k/2), tau_12 = 2 mu eps_1 / sqrt(1 + k^2/4)
    Mat3 F = Mat3::Identity();
    F(0, 1) = k;
    const auto s = hencky_state(e, F);
    EXPECT_NEAR(s->tau[3], 2 * mu * std::asinh(k / 2) / std::sqrt(1 + k * k / 4), 1e-5);
    EXPECT_NEAR(s->tau[0], mu * k * std::asinh(k / 2) / std::sqrt(1 + k * k / 4), 1e-5);
    EXPECT_NEAR(s->p, 0, 1e-5);
  }
}

}  // namespace
}  // namespace anticrack
