#include "measures/minkowski.h"

#include <gtest/gtest.h>

#include <numbers>

#include "errors.h"
#include "expect_error.h"
#include "measured_shapes.h"

namespace anticrack {
namespace {

constexpr double pi = std::numbers::pi;

std::int64_t eightfold(const PhaseImage& image, Connectivity connectivity) {
  return eightfold_euler_number(count_neighbourhoods(image, BoxBoundary::closed), connectivity);
}

void expect_euler(const PhaseImage& image, std::int64_t expected) {
  EXPECT_EQ(eightfold(image, Connectivity::faces), 8 * expected);
  EXPECT_EQ(eightfold(image, Connectivity::corners), 8 * expected);
}

TEST(EulerNumber, OfBodiesOfKnownTopologyIsExact) {
  const auto block = [](const auto& hole) {
    return make_image({9, 9, 9}, 1, [=](int i, int j, int k) {
      const auto in = [](int n) { return n >= 1 && n <= 7; };
      return in(i) && in(j) && in(k) && !hole(i, j, k);
    });
  };
  expect_euler(ball_image(21, 8.3, 1), 1);
  expect_euler(block([](int, int, int) { return false; }), 1);
  expect_euler(block([](int i, int j, int) { return i == 4 && j == 4; }), 0);               // a through hole
  expect_euler(block([](int i, int j, int) { return j == 4 && (i == 2 || i == 5); }), -1);  // two
  expect_euler(block([](int i, int j, int k) { return i == 4 && j == 4 && k == 4; }), 2);   // a cavity
  expect_euler(block([](int i, int, int) { return i == 4; }), 2);                           // two plates
  const double c = 15;
  expect_euler(make_image({31, 31, 31}, 1,
                          [&](int i, int j, int k) {  // torus
                            const double ring = std::hypot(i - c, j - c) - 9;
                            return ring * ring + (k - c) * (k - c) < 4.3 * 4.3;
                          }),
               0);
  expect_euler(make_image({31, 31, 31}, 1,
                          [&](int i, int j, int k) {  // shell
                            const double r = std::hypot(i - c, j - c, k - c);
                            return r < 13 && r > 9;
                          }),
               2);
  expect_euler(make_image({31, 31, 31}, 1, [](int, int, int) { return true; }), 1);  // full: the box itself
}

TEST(EulerNumber, TellsConnectivitiesApart) {
  const auto pair = [](int j, int k) {
    return make_image({4, 4, 4}, 1, [=](int a, int b, int c) {
      return (a == 1 && b == 1 && c == 1) || (a == 2 && b == 1 + j && c == 1 + k);
    });
  };
  EXPECT_EQ(eightfold(pair(0, 0), Connectivity::faces), 8);
  EXPECT_EQ(eightfold(pair(1, 0), Connectivity::faces), 16);
  EXPECT_EQ(eightfold(pair(1, 0), Connectivity::corners), 8);
  EXPECT_EQ(eightfold(pair(1, 1), Connectivity::faces), 16);
  EXPECT_EQ(eightfold(pair(1, 1), Connectivity::corners), 8);
}

TEST(EulerNumber, IsVerticesMinusEdgesPlusFacesMinusCellsOfTheClosedVoxels) {
  const PhaseImage image = cut_of_field(20, 4, theoretical_threshold(Morphology::single_cut, 0.4), 6);
  const auto solid = [&](int i, int j, int k) {
    return i >= 0 && j >= 0 && k >= 0 && i < 20 && j < 20 && k < 20 && image.solid[image.offset(i, j, k)];
  };
  // Twice the coordinates: an odd one lies within a cell along that axis, an even one on a boundary.
  std::int64_t number = 0;
  for (int z = 0; z <= 40; ++z)
    for (int y = 0; y <= 40; ++y)
      for (int x = 0; x <= 40; ++x) {
        bool present = false;
        for (int k = (z - 1) >> 1; k <= z / 2; ++k)
          for (int j = (y - 1) >> 1; j <= y / 2; ++j)
            for (int i = (x - 1) >> 1; i <= x / 2; ++i) present |= solid(i, j, k);
        const int dimension = x % 2 + y % 2 + z % 2;
        number += present ? (dimension % 2 ? -1 : 1) : 0;
      }
  EXPECT_EQ(eightfold(image, Connectivity::corners), 8 * number);
}

TEST(EulerNumber, OfThePoreHasTheOtherConnectivity) {
  const PhaseImage image = cut_of_field(33, 4, theoretical_threshold(Morphology::single_cut, 0.3), 2);
  const auto solid = count_neighbourhoods(image, BoxBoundary::open);
  const auto pore = count_neighbourhoods(complement(image), BoxBoundary::open);
  EXPECT_EQ(eightfold_euler_number(solid, Connectivity::faces),
            eightfold_euler_number(pore, Connectivity::corners));
  EXPECT_NE(eightfold_euler_number(solid, Connectivity::faces),
            eightfold_euler_number(solid, Connectivity::corners));
}

TEST(Neighbourhoods, AreAsManyAsTheBoxHolds) {
  const PhaseImage image = make_image({5, 6, 7}, 2, [](int, int, int) { return true; });
  EXPECT_EQ(count_neighbourhoods(image, BoxBoundary::open).counts[255], 4u * 5 * 6);
  EXPECT_EQ(count_neighbourhoods(image, BoxBoundary::closed).neighbourhoods, 6u * 7 * 8);
  EXPECT_DOUBLE_EQ(count_neighbourhoods(image, BoxBoundary::closed).solid_volume(), 5. * 6 * 7 * 8);
  const PhaseImage plane = make_image({5, 6, 1}, 2, [](int, int, int) { return true; });
  EXPECT_ERROR(count_neighbourhoods(plane, BoxBoundary::open), InputError, "at least 2 along each axis");
}

TEST(Crofton, MeasuresBallAndCylinder) {
  // Digital balls of this radius: the area converges from either side, within 1 %; mean curvature likewise.
  const double h = 1e-3, radius = 24.3;
  const auto ball = count_neighbourhoods(ball_image(61, radius, h), BoxBoundary::closed);
  const double area = 4 * pi * radius * radius * h * h;
  EXPECT_NEAR(surface_area(ball, CroftonDirections::three) / area, 1, 0.01);
  EXPECT_NEAR(surface_area(ball, CroftonDirections::thirteen) / area, 1, 0.01);
  EXPECT_NEAR(integral_of_mean_curvature(ball) / (4 * pi * radius * h), 1, 0.02);
  EXPECT_NEAR(specific_surface_area(ball) / (3 / (radius * h)), 1, 0.015);
  // A cylinder along z through an open box: the directions along it weigh less than by the sphere.
  const auto cylinder = count_neighbourhoods(
      make_image({61, 61, 21}, h, [=](int i, int j, int) { return std::hypot(i - 30, j - 30) < radius; }),
      BoxBoundary::open);
  const double lateral = 2 * pi * radius * 20 * h * h;
  EXPECT_NEAR(surface_area(cylinder, CroftonDirections::thirteen) / lateral, 1, 0.02);
  EXPECT_EQ(eightfold_euler_number(cylinder, Connectivity::faces), 0);  // per length it has none
}

TEST(Crofton, OfNoSolidHasNoSpecificSurface) {
  const PhaseImage pores = make_image({3, 3, 3}, 1, [](int, int, int) { return false; });
  EXPECT_ERROR(specific_surface_area(count_neighbourhoods(pores, BoxBoundary::closed)), InputError,
               "specific surface area of an image without solid; expected a solid voxel");
}

TEST(Crofton, SeesOfAPlaneWhatItsDirectionsSay) {
  // Shares of the sphere by Lang, Ohser and Hilfer: 0.0915558, 0.0739613 and 0.0703913 a line.
  const auto slab = count_neighbourhoods(make_image({20, 20, 20}, 1, [](int, int, int k) { return k < 7; }),
                                         BoxBoundary::open);
  EXPECT_NEAR(surface_area(slab, CroftonDirections::three), 19 * 19 * 2.0 / 3, 1e-9);
  const double seen = 2 * (0.0915558 + 4 * 0.0739613 / std::sqrt(2.0) + 4 * 0.0703913 / std::sqrt(3.0));
  EXPECT_NEAR(surface_area(slab, CroftonDirections::thirteen), 19 * 19 * seen, 1e-3);
  EXPECT_NEAR(seen, 0.927, 5e-4);
  EXPECT_NEAR(integral_of_mean_curvature(slab), 0, 1e-12);  // rounding of sums of some hundreds
}

TEST(Crofton, WeighsEachDirectionByItsShareOfTheSphere) {
  // A voxel alone has 2 changes on each line: 2 * (3 w1 h^2 + 6 w2 / sqrt 2 + 4 w3 / sqrt 3) * 2. The shares
  // by counting the nearest direction on a fine grid of the sphere.
  double shares[4] = {0, 0, 0, 0};
  constexpr int n = 400;
  for (int a = 0; a < n; ++a)
    for (int b = 0; b < n; ++b) {
      const double z = (a + 0.5) / n, angle = pi / 2 * (b + 0.5) / n, r = std::sqrt(1 - z * z);
      double best = 0;
      int dimension = 0;
      for (int d = 1; d < 8; ++d) {
        const int length = (d & 1) + (d >> 1 & 1) + (d >> 2);
        const double cosine =
            ((d & 1) * r * std::cos(angle) + (d >> 1 & 1) * r * std::sin(angle) + (d >> 2) * z) /
            std::sqrt(length);
        if (cosine > best) best = cosine, dimension = length;
      }
      shares[dimension] += 1.0 / n / n;
    }
  const PhaseImage voxel =
      make_image({3, 3, 3}, 1, [](int i, int j, int k) { return i == 1 && j == 1 && k == 1; });
  EXPECT_NEAR(surface_area(count_neighbourhoods(voxel, BoxBoundary::closed), CroftonDirections::thirteen),
              4 * (shares[1] + shares[2] / std::sqrt(2.0) + shares[3] / std::sqrt(3.0)), 2e-3);
}

TEST(MeanCurvature, ChangesSignWithThePhase) {
  const PhaseImage image = cut_of_field(33, 4, theoretical_threshold(Morphology::single_cut, 0.3), 2);
  const double solid = integral_of_mean_curvature(count_neighbourhoods(image, BoxBoundary::open));
  const double pore = integral_of_mean_curvature(count_neighbourhoods(complement(image), BoxBoundary::open));
  EXPECT_GT(solid, 0);
  EXPECT_NEAR(solid, -pore, 1e-9 * solid);
}

}  // namespace
}  // namespace anticrack
