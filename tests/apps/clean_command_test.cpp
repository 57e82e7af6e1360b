#include <gtest/gtest.h>

#include "example_scene.h"
#include "microstructure_io.h"
#include "running_command.h"
#include "temporary_folder.h"

namespace anticrack {
namespace {

namespace fs = std::filesystem;

TEST(CleanCommand, WritesTheConnectedSolidAndRefusesWhatDoesNotPercolate) {
  const TemporaryFolder folder;
  const std::string scene = folder.write("scene.toml", example_scene).string();
  const std::string sample = (folder.path() / "sample.vdb").string();
  const fs::path output = folder.path() / "new/clean.vdb";
  const std::string clean = "clean " + sample + " -o " + output.string();

  // 0.5 % of 10 x 20 x 10 lattice points cannot span.
  ASSERT_EQ(run("generate " + scene + " -o " + sample +
                " --set microstructure.solid_fraction=0.005 --set microstructure.threshold_rule=exact")
                .status,
            0);
  const Outcome refused = run(clean + " --spanning six_faces");
  EXPECT_EQ(refused.status, 2) << refused.text;
  EXPECT_NE(refused.text.find(sample + ": no cluster of the solid spans the sample (six_faces)"),
            std::string::npos)
      << refused.text;
  EXPECT_FALSE(fs::exists(output.parent_path()));

  ASSERT_EQ(
      run("generate " + scene + " -o " + sample + " --force --set microstructure.solid_fraction=0.6").status,
      0);
  const Outcome cleaned = run(clean + " --spanning six_faces --connectivity 6");
  ASSERT_EQ(cleaned.status, 0) << cleaned.text;
  EXPECT_NE(cleaned.text.find("phi_p"), std::string::npos) << cleaned.text;
  EXPECT_LE(read_microstructure(output).solid_points, read_microstructure(sample).solid_points);
  EXPECT_EQ(run(clean + " --spanning six_faces").status, 2) << "an existing file";
  EXPECT_EQ(run(clean + " --force --spanning sideways").status, 2);
  EXPECT_EQ(run(clean + " --force --spanning x --connectivity 18").status, 2);
}

}  // namespace
}  // namespace anticrack
