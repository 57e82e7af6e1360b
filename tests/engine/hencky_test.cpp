#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <cstring>
#include <vector>

#include "csv_table.h"
#include "kernels.h"
#include "vec3.h"

namespace anticrack {
namespace {

using Six = std::array<double, 6>;

Six strain_of(const Six& h) {
  Six eps;
  kernels().hencky(std::span(&h, 1), std::span(&eps, 1));
  return eps;
}

/// Eigenvalues by Eigen, in long double.
Six plain_strain(const Six& h) {
  Eigen::Matrix<long double, 3, 3> m;
  m << h[0], h[3], h[4], h[3], h[1], h[5], h[4], h[5], h[2];
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix<long double, 3, 3>> solver(m);
  Eigen::Matrix<long double, 3, 1> log;
  for (int i = 0; i < 3; ++i) log[i] = 0.5L * std::log1p(solver.eigenvalues()[i]);
  const Eigen::Matrix<long double, 3, 3> e =
      solver.eigenvectors() * log.asDiagonal() * solver.eigenvectors().transpose();
  return {double(e(0, 0)), double(e(1, 1)), double(e(2, 2)),
          double(e(0, 1)), double(e(0, 2)), double(e(1, 2))};
}

double difference(const Six& a, const Six& b) {
  double worst = 0;
  for (int e = 0; e < 6; ++e) worst = std::max(worst, std::abs(a[e] - b[e]));
  return worst;
}

Six random_h(double size) {
  Six h;
  for (double& x : h) x = size * (2 * drand48() - 1);
  return h;
}

TEST(HenckyStrain, IsExactForEverySizeAcrossTheSeamOfSeriesAndEigenvalues) {
  srand48(1);
  for (double size = 1e-14; size < 0.4; size *= 1.3)
    for (int n = 0; n < 50; ++n) {
      const Six h = random_h(size);
      // A dozen roundings of numbers of the size of h.
      EXPECT_LT(difference(strain_of(h), plain_strain(h)), 8e-16 * size * (size > 0.1 ? 8 : 3))
          << "size " << size;
    }
}

TEST(HenckyStrain, InverseReturnsToTheSameTensor) {
  srand48(2);
  for (double size = 1e-14; size < 0.4; size *= 1.7)
    for (int n = 0; n < 50; ++n) {
      const Six h = random_h(size), eps = strain_of(h);
      Six back;
      kernels().inverse_hencky(std::span(&eps, 1), std::span(&back, 1));
      EXPECT_LT(difference(back, h), 4e-15 * size) << "size " << size;
    }
}

/// How far a series is summed and whether eigenvalues are needed is decided for each tensor, not for the
/// vector that it shares with others.
TEST(HenckyStrain, HasBitsThatDoNotDependOnItsNeighbours) {
  srand48(3);
  std::vector<Six> all;
  for (int n = 0; n < 1000; ++n) all.push_back(random_h(0.4 * std::pow(10.0, -4 * drand48())));
  for (const auto kernel : {kernels().hencky, kernels().inverse_hencky}) {
    std::vector<Six> together(all.size());
    kernel(all, together);
    for (std::size_t n = 0; n < all.size(); ++n) {
      Six alone;
      kernel(std::span(&all[n], 1), std::span(&alone, 1));
      EXPECT_EQ(std::memcmp(&alone, &together[n], sizeof(Six)), 0) << "tensor " << n;
    }
  }
}

TEST(HenckyStrain, IsNotANumberWhereBIsNotPositiveDefinite) {
  EXPECT_TRUE(std::isnan(strain_of({-1.5, 0, 0, 0, 0, 0})[0]));
  EXPECT_TRUE(std::isnan(strain_of({0, 0, -1, 0, 0, 0})[2]));
  EXPECT_TRUE(std::isnan(strain_of({-2, -2, -2, 0, 0, 0})[0]));
}

TEST(HenckyStrain, AgreesWithTheHighPrecisionTable) {
  const CsvTable table(ANTICRACK_ASSETS "/reference/hencky_reference.csv");
  int beyond = 0;
  for (std::size_t row = 0; row < table.size(); ++row) {
    if (table.text(row, "status") != "OK") continue;
    Mat3 L;  // F - I: b - I = L + L^T + L L^T keeps the strain's digits
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j)
        L(i, j) =
            table.number(row, std::string("F").append(std::to_string(i + 1)).append(std::to_string(j + 1))) -
            (i == j);
    const Mat3 h = L + L.transpose() + L * L.transpose();
    const Six eps = strain_of({h(0, 0), h(1, 1), h(2, 2), h(0, 1), h(0, 2), h(1, 2)});
    // h = b - I holds an eigenvalue of b to 1e-16 only. Compression below a hundredth of the length is beyond
    // what the kernels are for; `anticrack material` takes the singular values of F there.
    const double smallest = table.number(row, "s3"), largest = table.number(row, "s1");
    if (smallest < 1e-2 || largest > 1e100) {
      ++beyond;
      continue;
    }
    const char* names[6] = {"eps11", "eps22", "eps33", "eps12", "eps13", "eps23"};
    for (int e = 0; e < 6; ++e)
      EXPECT_NEAR(eps[e], table.number(row, names[e]), table.number(row, "abs_tol_strain_FFT_route"))
          << table.text(row, "id") << " " << names[e];
  }
  EXPECT_EQ(beyond, 7) << "of the 37 rows: near-singular F and scales of 1e200 and 2^-30";
}

}  // namespace
}  // namespace anticrack
