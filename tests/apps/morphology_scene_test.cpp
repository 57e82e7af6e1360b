#include <gtest/gtest.h>

#include "example_scene.h"
#include "expect_error.h"
#include "scene.h"
#include "temporary_folder.h"

namespace anticrack {
namespace {

class MorphologyScene : public testing::Test {
 protected:
  Scene read(const std::vector<std::string>& overrides) const { return read_scene(scene_, overrides); }
  static const GaussianRandomFieldSource& source_of(const Scene& scene) {
    return std::get<GaussianRandomFieldSource>(scene.microstructure);
  }
  std::string spectrum(const std::string& text) const {
    return "microstructure.spectrum=" + folder_.write("spectrum.csv", text).string();
  }

  TemporaryFolder folder_;
  std::filesystem::path scene_ = folder_.write("scene.toml", example_scene);
};

TEST_F(MorphologyScene, HoldsEveryKeyAndReadsBack) {
  const Scene scene = read({"microstructure.morphology=closed_cell", "microstructure.anisotropy=1.5",
                            "microstructure.anisotropy_axis=y", "microstructure.wavelength_gradient=0.8",
                            "microstructure.gradient_axis=x",
                            spectrum("# made up\nwave_number,weight\n10,0\n20, 1\n30,0\n")});
  const GaussianRandomFieldSource& source = source_of(scene);
  EXPECT_EQ(source.morphology, Morphology::closed_cell);
  EXPECT_EQ(source.field.anisotropy, 1.5);
  EXPECT_EQ(source.field.anisotropy_axis, 1);
  EXPECT_EQ(source.field.wavelength_gradient, 0.8);
  EXPECT_EQ(source.field.gradient_axis, 0);
  EXPECT_NEAR(source.field.spectrum->mean(), 20, 1e-12);
  EXPECT_EQ(to_toml(read_scene(folder_.write("again.toml", to_toml(scene)))), to_toml(scene));
  const Scene periodic = read({"microstructure.periodic=true"});
  EXPECT_TRUE(source_of(periodic).field.periodic);
  EXPECT_EQ(to_toml(read_scene(folder_.write("again.toml", to_toml(periodic)))), to_toml(periodic));
}

TEST_F(MorphologyScene, RefusesWhatIsOutOfRangeOrContradictory) {
  EXPECT_ERROR(read({"microstructure.morphology=foam"}), SceneError,
               "microstructure.morphology = foam; expected \"single_cut\", \"two_cut\", \"open_cell\" or "
               "\"closed_cell\".");
  EXPECT_ERROR(read({"microstructure.anisotropy=0"}), SceneError,
               "microstructure.anisotropy = 0; expected 0.1 <= anisotropy <= 10.");
  EXPECT_ERROR(read({"microstructure.wavelength_gradient=11"}), SceneError,
               "expected 0.1 <= wavelength_gradient <= 10.");
  EXPECT_ERROR(read({"microstructure.gradient_axis=x"}), SceneError,
               "expected wavelength_gradient as well, whose axis it is.");
  EXPECT_ERROR(read({"microstructure.wavelength_gradient=2", "microstructure.periodic=true"}), SceneError,
               "microstructure.periodic = true; expected no wavelength_gradient beside it");
  EXPECT_ERROR(read({"microstructure.source=full", "microstructure.morphology=two_cut"}), SceneError,
               "that key belongs to source = \"gaussian_random_field\"");
}

TEST_F(MorphologyScene, RefusesSpectraByFileAndLine) {
  EXPECT_ERROR(read({"microstructure.spectrum=missing.csv"}), SceneError, "there is no ");
  EXPECT_ERROR(read({spectrum("eta,p\n1,2\n")}), SceneError, "spectrum.csv:1: eta,p; expected the header");
  EXPECT_ERROR(read({spectrum("wave_number,weight\n1,2\n3;4\n")}), SceneError,
               "spectrum.csv:3: 3;4; expected two numbers");
  EXPECT_ERROR(read({spectrum("wave_number,weight\n1,2\n")}), SceneError, "1 rows; expected at least two");
  EXPECT_ERROR(read({spectrum("wave_number,weight\n2,1\n2,1\n")}), SceneError,
               "row 2: wave_number = 2; expected > 2");
  EXPECT_ERROR(read({spectrum("wave_number,weight\n2,1\n3,-1\n")}), SceneError,
               "row 2: weight = -1; expected >= 0");
  EXPECT_ERROR(read({spectrum("wave_number,weight\n2,0\n3,0\n")}), SceneError, "every weight is 0");
  const std::string both = example_with("seed = 1", "seed = 1\nspectrum = \"spectrum.csv\"");
  EXPECT_ERROR(read_scene(folder_.write("both.toml", both)), SceneError, "spectrum");
}

}  // namespace
}  // namespace anticrack
