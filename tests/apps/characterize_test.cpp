#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "characterization.h"
#include "example_scene.h"
#include "figure_data.h"
#include "running_command.h"
#include "temporary_folder.h"

namespace anticrack {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

Json read_json(const fs::path& file) {
  std::ifstream stream(file);
  return Json::parse(stream);
}

std::string read_text(const fs::path& file) {
  std::ifstream stream(file);
  return {std::istreambuf_iterator<char>(stream), {}};
}

class Characterize : public testing::Test {
 protected:
  fs::path path(const std::string& name) const { return folder.path() / name; }
  Outcome characterize(const std::string& input, const std::string& report, const std::string& options = "") {
    return run("characterize " + path(input).string() + " -o " + path(report).string() + " --quiet " +
               options);
  }
  /// 24^3 points, so that every measure has something to see.
  const std::string finer = " --set sample.size=[1,1,1] --set sample.resolution=24";

  const TemporaryFolder folder;
  const fs::path scene = folder.write("scene.toml", example_scene);
};

TEST_F(Characterize, GivesEachMeasureAUnitAndADefinition) {
  const Outcome outcome = characterize("scene.toml", "report.json", finer);
  ASSERT_EQ(outcome.status, 0) << outcome.text;
  const Json report = read_json(path("report.json"));
  EXPECT_EQ(report["counts"]["voxels"], 24 * 24 * 24);
  EXPECT_EQ(report["counts"]["solid_voxels"].get<int>() + report["counts"]["pore_voxels"].get<int>(),
            24 * 24 * 24);
  EXPECT_GE(report["measures"].size(), 15u);
  for (const auto& [name, measure] : report["measures"].items()) {
    EXPECT_TRUE(measure["value"].is_number() || measure["value"].is_null()) << name;
    EXPECT_FALSE(measure["unit"].get<std::string>().empty()) << name;
    EXPECT_GT(measure["definition"].get<std::string>().size(), 10u) << name;
  }
  EXPECT_EQ(report["measures"]["solid_fraction"]["theory"], 0.34);

  // Every curve of the report is in the table, with as many points.
  std::istringstream csv(read_text(path("report.csv")));
  std::map<std::string, int> points;
  for (std::string line; std::getline(csv, line);) ++points[line.substr(0, line.find(','))];
  for (const auto& [name, curve] : report["curves"].items())
    EXPECT_EQ(points[name], curve["points"].get<int>()) << name;
  EXPECT_EQ(points["curve"], 1);
#if ANTICRACK_RENDER
  EXPECT_GT(fs::file_size(path("report.png")), 10000u);
#endif
}

TEST_F(Characterize, SeesTheSameVoxelsInASceneALevelSetAndAScan) {
  ASSERT_EQ(run("generate " + scene.string() + " -o " + path("s.vdb").string() + " --quiet" + finer).status,
            0);
  ASSERT_EQ(run("export " + path("s.vdb").string() + " -o " + path("s.tif").string() + " --quiet").status, 0);
  ASSERT_EQ(characterize("scene.toml", "scene.json", finer).status, 0);
  ASSERT_EQ(characterize("s.vdb", "vdb.json").status, 0);
  const Outcome scan = characterize("s.tif", "scan.json", "--voxel-size " + std::to_string(1.0) + "/24");
  EXPECT_EQ(scan.status, 2);  // no arithmetic
  ASSERT_EQ(characterize("s.tif", "scan.json", "--voxel-size 0.041666666666666664").status, 0);
  const Json a = read_json(path("scene.json")), b = read_json(path("vdb.json")),
             c = read_json(path("scan.json"));
  EXPECT_EQ(a["counts"], b["counts"]);
  EXPECT_EQ(a["measures"], b["measures"]);
  EXPECT_EQ(read_text(path("scene.csv")), read_text(path("vdb.csv")));
  for (const auto& [name, count] : a["counts"].items())
    EXPECT_TRUE(name == "surface_triangles" || c["counts"][name] == count) << name;
  for (const auto& [name, measure] : a["measures"].items())
    EXPECT_TRUE(name.ends_with("_mesh") || c["measures"][name]["value"] == measure["value"]) << name;
  EXPECT_FALSE(c["measures"]["ssa_mesh"].contains("theory"));
}

TEST_F(Characterize, MeasuresOnlyWhatIsAskedFor) {
  ASSERT_EQ(characterize("scene.toml", "report.json", finer + " --only fractions").status, 0);
  const Json report = read_json(path("report.json"));
  EXPECT_EQ(report["measures"].size(), 2u);
  EXPECT_TRUE(report["curves"].empty());
}

TEST_F(Characterize, OfABlockWithoutPoresLeavesOutWhatDoesNotExist) {
  const Outcome outcome =
      characterize("scene.toml", "report.json", finer + " --set microstructure.solid_fraction=1");
  ASSERT_EQ(outcome.status, 0) << outcome.text;
  const Json report = read_json(path("report.json"));
  EXPECT_EQ(report["measures"]["solid_fraction"]["value"], 1.0);
  EXPECT_FALSE(report["measures"].contains("pore_size_mean"));
}

TEST_F(Characterize, RefusesBeforeItWritesAnything) {
  const auto expect = [&](const std::string& input, const std::string& report, const std::string& options,
                          const std::string& message) {
    const Outcome outcome = characterize(input, report, options);
    EXPECT_EQ(outcome.status, 2);
    EXPECT_PRED_FORMAT2(testing::IsSubstring, message, outcome.text);
  };
  folder.write("scan.raw", std::string(1000, 'x'));
  expect("scene.toml", "report.txt", "",
         "report.txt: expected a name that ends in .json; .csv and .png go beside it.");
  expect("scene.toml", "report.json", "--only surface",
         "--only surface: no such group of measures; expected fractions, correlation");
  expect("scan.raw", "report.json", "--shape 10,10,10", "--voxel-size is missing");
  expect("scene.toml", "report.json", "--set microstructure.source=scan --set microstructure.file=scan.raw",
         "microstructure");
  folder.write("scan.toml",
               "[microstructure]\nsource = \"scan\"\nfile = \"scan.raw\"\nvoxel_size = 1\nsolid = [1]\n");
  expect("scan.toml", "report.json", "",
         "scan.toml: microstructure.source = \"scan\"; characterize its file itself: anticrack characterize "
         "FILE "
         "--voxel-size ...");
  for (const char* name : {"report.json", "report.csv", "report.png"}) EXPECT_FALSE(fs::exists(path(name)));
  folder.write("report.csv", "mine");
  expect("scene.toml", "report.json", "", "report.csv");
  EXPECT_EQ(read_text(path("report.csv")), "mine");
}

TEST(Figure, OfTheSpecificSurfaceShowsThatThePapersWayDependsOnTheLattice) {
  // The same sample on six lattices: the bins of the radial slope lose area where they are coarse, the slope
  // along the axes does not. 33 and 132 points a side are the second and the last.
  const auto parts = figure_b15({1, 88, 2000}, [](double) {});
  ASSERT_EQ(parts.size(), 2u);
  EXPECT_EQ(parts[1].name, "b15b");
  const auto& paper = parts[1].curves[0].mean;
  const auto& slope = parts[1].curves[2].mean;
  ASSERT_EQ(paper.size(), 6u);
  EXPECT_GT(paper[5] / paper[1], 1.08);
  EXPECT_NEAR(slope[5] / slope[1], 1, 0.02);
}

TEST_F(Characterize, FigureCommandWritesDataAndPlots) {
  const Outcome outcome = run("figure b14 -o " + path("b14").string() + " --realizations 1 --resolution 40");
  ASSERT_EQ(outcome.status, 0) << outcome.text;
  const std::string csv = read_text(path("b14/b14a.csv"));
  EXPECT_TRUE(csv.starts_with("curve,x,mean,deviation\n\"b = 5\",0,")) << csv.substr(0, 80);
  EXPECT_TRUE(fs::exists(path("b14/b14b.csv")));
#if ANTICRACK_RENDER
  EXPECT_TRUE(fs::exists(path("b14/b14a.png")) && fs::exists(path("b14/b14b.png")));
#endif
  const Outcome again = run("figure b14 -o " + path("b14").string() + " --realizations 1 --resolution 40");
  EXPECT_EQ(again.status, 2) << again.text;
  EXPECT_EQ(run("figure b13 -o " + path("b13").string()).status, 2);
}

}  // namespace
}  // namespace anticrack
