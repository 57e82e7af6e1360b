#include <cmath>
#include <nlohmann/json.hpp>

#include "io/provenance.h"
#include "io/run_result.h"
#include "io_test_folder.h"

namespace anticrack {
namespace {

class Report : public IoTest {};

RunResult some_result() {
  RunResult result;
  result.loading = "triaxial";
  result.walls = "affine";
  result.wall_rule = "ghost";
  result.stopped_by = "failure";
  result.K = 1.25e9;
  result.failure = FailurePoint{-1e-3, 2e6, 3e6, 8123, 0.1};
  result.particles = 1000000;
  result.steps = 10000;
  result.solid_fraction_asked = 0.34;
  result.solid_fraction_achieved = 0.34000012;
  result.quasi_static = {1e-4, 1.001, 1e-9, 200, true, "quasi-static"};
  return result;
}

TEST_F(Report, ResultNamesItsWallsAndHoldsItsNumbers) {
  write_run_result(some_result(), folder / "result.json");
  const auto json = nlohmann::json::parse(file_content(folder / "result.json"));
  EXPECT_EQ(json["loading"], "triaxial");
  EXPECT_EQ(json["walls"], "affine");
  EXPECT_EQ(json["wall_rule"], "ghost");
  EXPECT_EQ(json["stopped_by"], "failure");
  EXPECT_EQ(json["K"], 1.25e9);
  EXPECT_EQ(json["failure"]["strain"], -1e-3);
  EXPECT_EQ(json["failure"]["step"], 8123);
  EXPECT_EQ(json["particles"], 1000000);
  EXPECT_EQ(json["solid_fraction"]["asked"], 0.34);
  EXPECT_EQ(json["solid_fraction"]["achieved"], 0.34000012);
  EXPECT_EQ(json["quasi_static"]["kinetic_over_internal"], 1e-4);
  EXPECT_EQ(json["quasi_static"]["wave_passages"], 200);
  EXPECT_EQ(json["quasi_static"]["verdict"], "quasi-static");
}

TEST_F(Report, WhatARunCannotGiveIsNull) {
  RunResult result = some_result();
  result.failure.reset();
  result.solid_fraction_asked.reset();
  result.K = std::nan("");
  result.quasi_static.energy_residual = INFINITY;
  write_run_result(result, folder / "result.json");
  const auto json = nlohmann::json::parse(file_content(folder / "result.json"));
  EXPECT_TRUE(json["K"].is_null());
  EXPECT_TRUE(json["G"].is_null());
  EXPECT_TRUE(json["failure"].is_null());
  EXPECT_TRUE(json["solid_fraction"]["asked"].is_null());
  EXPECT_TRUE(json["quasi_static"]["energy_residual"].is_null());
}

TEST_F(Report, LabelThatIsNotUtf8DoesNotCostTheResult) {
  RunResult result = some_result();
  result.quasi_static.verdict = "caf\xe9";
  write_run_result(result, folder / "result.json");
  EXPECT_EQ(nlohmann::json::parse(file_content(folder / "result.json"))["steps"], 10000);
}

TEST_F(Report, ProvenanceSaysWhatRan) {
  write_provenance(folder / "provenance.json", "AVX3", 2);
  const auto json = nlohmann::json::parse(file_content(folder / "provenance.json"));
  EXPECT_EQ(json["program"], "anticrack");
  EXPECT_EQ(json["version"], program_version());
  EXPECT_EQ(json["commit"], program_commit());
  EXPECT_EQ(json["simd"], "AVX3");
  EXPECT_EQ(json["threads"], 2);
  for (const char* key : {"compiler", "flags", "cpu", "started_utc"}) EXPECT_NE(json[key], "") << key;
  // 2021-11-01T12:00:00Z
  EXPECT_EQ(json["started_utc"].get<std::string>().size(), 20u);
}

TEST_F(Report, UnwritableFolderIsAnErrorWithTheFile) {
  std::string message;
  {
    const UnwritableFolder unwritable(folder);
    message = file_error_of([&] { write_run_result(some_result(), folder / "result.json"); });
  }
  EXPECT_PRED_FORMAT2(testing::IsSubstring, "result.json", message);
  EXPECT_PRED_FORMAT2(testing::IsSubstring, "Permission denied", message);
}

}  // namespace
}  // namespace anticrack
