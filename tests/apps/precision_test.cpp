#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "errors.h"
#include "expect_error.h"
#include "precision_report.h"

namespace anticrack {
namespace {

/// The case of the full study with this name.
PrecisionCase case_named(const std::string& name) {
  for (const PrecisionCase& c : precision_cases(false))
    if (c.name() == name) return c;
  throw std::runtime_error("no case " + name);
}

PrecisionResult solved(const PrecisionCase& c) {
  return {c, solve(c), 1, {}};
}

PrecisionResult made_up(const std::string& problem, const std::string& variant, int cells, double seconds,
                        const std::string& measure, double value, double exact = 0) {
  PrecisionCase c{problem, variant, {}};
  c.knobs.cells = cells;
  Solution solution;
  solution.measures = {{measure, value, exact}};
  solution.seconds = seconds;
  return {c, solution, 1, {}};
}

TEST(PrecisionCases, HaveDistinctNames) {
  std::vector<std::string> names;
  for (const PrecisionCase& c : precision_cases(false)) names.push_back(c.name());
  std::sort(names.begin(), names.end());
  EXPECT_EQ(std::adjacent_find(names.begin(), names.end()), names.end());
}

TEST(PrecisionCases, OfAnotherProblemAreRefused) {
  EXPECT_ERROR(solve({"waves", "", {}}), InputError,
               "no problem waves; expected one of wave, large_wave, vortex");
}

// The bounds below are those that the engine promises.

TEST(Precision, ManufacturedWaveConvergesWithOrder1Point8) {
  std::vector<PrecisionResult> results;
  for (const char* name : {"wave, 12 cells", "wave, 16 cells", "wave, 24 cells"})
    results.push_back(solved(case_named(name)));
  for (const char* measure : {"displacement", "stress"})
    EXPECT_GE(observed_order(work_points(results, "wave", measure), "").value(), 1.8) << measure;
}

TEST(Precision, VortexConvergesWithOrder1Point4) {
  std::vector<PrecisionResult> results;
  for (const char* name : {"vortex, 16 cells", "vortex, 24 cells", "vortex, 32 cells"})
    results.push_back(solved(case_named(name)));
  for (const char* measure : {"displacement", "stress"})
    EXPECT_GE(observed_order(work_points(results, "vortex", measure), "").value(), 1.4) << measure;
}

TEST(Precision, BlockIsWithinHalfAPercentWhereverTheWallsLie) {
  for (const char* name :
       {"block, 16 cells, 6 transits", "block, 16 cells, 6 transits, walls 0.25 of a cell off",
        "block, 16 cells, 6 transits, walls 0.5 of a cell off",
        "block, 16 cells, 6 transits, walls 0.75 of a cell off"})
    EXPECT_LT(error_of(solve(case_named(name)).measures.at(0)), 5e-3) << name;
}

TEST(Precision, VoidCubeIsWithinTwoPercentAt48Cells) {
  PrecisionCase c = case_named("void_0.3, 48 cells, 6 transits");
  c.knobs.transits = 2;  // for the sake of time
  EXPECT_LT(error_of(solve(c).measures.at(0)), 0.02);
}

TEST(Precision, ImplicitReturnMappingFollowsTheClosedFormInAnyStep) {
  const PrecisionCase implicit = case_named("softening, 8 cells, 1 transits"),
                      paper = case_named("softening, 8 cells, the paper's return mapping, 1 transits");
  const double exactly = solve(implicit).measures.at(1).value, nearly = solve(paper).measures.at(1).value;
  // What is left is the quadrature at particles that have moved by up to 1e-2 cells.
  EXPECT_LT(exactly, 1e-4);
  EXPECT_GT(nearly, 2e-4);
}

TEST(PrecisionReport, FrontHoldsWhatNothingBeatsInTimeAndError) {
  const std::vector<PrecisionResult> results = {
      made_up("wave", "", 8, 1, "stress", 0.3), made_up("wave", "PIC", 8, 2, "stress", 0.4),
      made_up("wave", "", 16, 4, "stress", 0.1), made_up("wave", "FLIP 1", 16, 3, "stress", 7)};
  const auto points = work_points(results, "wave", "stress");
  ASSERT_EQ(points.size(), 4u);
  EXPECT_TRUE(points[0].on_front);
  EXPECT_FALSE(points[1].on_front);
  EXPECT_FALSE(points[2].on_front);
  EXPECT_TRUE(std::isinf(points[2].error));  // off by more than 100 %: failed
  EXPECT_TRUE(points[3].on_front);
}

TEST(PrecisionReport, OrderIsThatOfTheThreeFinestGrids) {
  std::vector<PrecisionResult> results = {made_up("wave", "", 4, 1, "stress", 0.9)};
  for (const int n : {8, 16, 32}) results.push_back(made_up("wave", "", n, n, "stress", 3.0 / (n * n)));
  EXPECT_NEAR(observed_order(work_points(results, "wave", "stress"), "").value(), 2, 1e-12);
  results.back().solution.measures[0].value = std::numeric_limits<double>::quiet_NaN();
  results.back().failure = "step 3: ...";
  EXPECT_FALSE(observed_order(work_points(results, "wave", "stress"), ""));
}

TEST(PrecisionReport, CostOfAnErrorLiesBetweenThePointsOfTheFront) {
  const std::vector<PrecisionResult> results = {made_up("wave", "", 8, 1, "stress", 0.1),
                                                made_up("wave", "", 16, 100, "stress", 0.001)};
  const auto points = work_points(results, "wave", "stress");
  EXPECT_NEAR(cost_for(points, 0.01).value(), 10, 1e-9);
  EXPECT_FALSE(cost_for(points, 1e-4));
}

TEST(PrecisionReport, PorousModulusIsExtrapolatedFromThreeGrids) {
  std::vector<PrecisionResult> results;
  for (const int n : {12, 24, 48})
    results.push_back(made_up("porous", "", n, n, "K", 0.2 + 10.0 / (n * n), NAN));
  results.push_back(made_up("porous", "PIC", 12, 3, "K", 0.25, NAN));
  extrapolate_references(results);
  for (const PrecisionResult& r : results) EXPECT_NEAR(r.solution.measures[0].exact, 0.2, 1e-12);
  // Grids that do not converge tell nothing.
  results[2].solution.measures[0].value = 0.5;
  for (PrecisionResult& r : results) r.solution.measures[0].exact = NAN;
  extrapolate_references(results);
  EXPECT_TRUE(std::isnan(results[0].solution.measures[0].exact));
}

TEST(PrecisionReport, ReadsBackWhatItWrote) {
  PrecisionResult good{case_named("wave, 8 cells"), {}, 5, {}},
      bad{case_named("wave, 8 cells, PIC"), {}, 0, "step 3"};
  good.solution = {{{"stress", 0.125, 0}}, 4096, 29, 0.25};
  const std::vector<PrecisionResult> results = {good, bad};
  bool quick = true;
  const auto back = from_json(to_json(results, false), "precision.json", quick);
  EXPECT_FALSE(quick);
  ASSERT_EQ(back.size(), 2u);
  EXPECT_EQ(to_json(back, false), to_json(results, false));
  EXPECT_EQ(to_csv(back), to_csv(results));
}

TEST(PrecisionReport, RefusesWhatIsNotItsOwn) {
  bool quick;
  EXPECT_ERROR(from_json("{}", "precision.json", quick), FileError,
               "precision.json: no results of this command:");
  EXPECT_ERROR(from_json("nonsense", "precision.json", quick), FileError,
               "precision.json: no results of this command:");
}

}  // namespace
}  // namespace anticrack
