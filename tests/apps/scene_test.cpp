#include "scene.h"

#include <gtest/gtest.h>

#include <cmath>

#include "example_scene.h"
#include "expect_error.h"
#include "temporary_folder.h"

namespace anticrack {
namespace {

Scene read(const std::string& text, const std::vector<std::string>& overrides = {}) {
  const TemporaryFolder folder;
  return read_scene(folder.write("scene.toml", text), overrides);
}

const std::string vdb_source = "source = \"vdb\"\nfile = \"data/a.vdb\"";
const std::string field_source =
    "source = \"gaussian_random_field\"\nsolid_fraction = 0.34\nwaves = 100\nwavelengths_per_side = 3\n"
    "heterogeneity = 50\nseed = 1";

TEST(Scene, HoldsEveryValueOfTheFileInSiUnits) {
  const Scene scene = read(example_scene);
  EXPECT_EQ(scene.lattice->points, (Index3{10, 20, 10}));
  EXPECT_EQ(scene.lattice->spacing, 0.1);
  const auto& source = std::get<GaussianRandomFieldSource>(scene.microstructure);
  EXPECT_EQ(source.solid_fraction, 0.34);
  EXPECT_EQ(source.field.waves, 100);
  EXPECT_EQ(source.field.wavelengths_per_side, 3);
  EXPECT_EQ(source.field.heterogeneity, 50);
  EXPECT_EQ(source.field.seed, 1u);
  EXPECT_EQ(source.threshold_rule, ThresholdRule::theory);
  EXPECT_EQ(scene.material.density, 1e4);
  EXPECT_EQ(scene.material.elasticity.young_modulus, 10e9);
  EXPECT_EQ(scene.material.elasticity.poisson_ratio, 0.3);
  EXPECT_EQ(scene.material.plasticity->friction, 1.2);
  EXPECT_EQ(scene.material.plasticity->cohesion, 2.5e6);
  EXPECT_EQ(scene.material.plasticity->softening, 1e6);
  const auto& loading = std::get<ConfinedCompression>(scene.loading);
  EXPECT_EQ(loading.axis, 1);
  EXPECT_TRUE(loading.both_platens);
  EXPECT_EQ(loading.speed, 2.0);
  EXPECT_EQ(loading.ramp_time, 0.0);
  EXPECT_EQ(std::get<UntilStrain>(scene.until).strain, 0.4);
  EXPECT_EQ(scene.numerics.transfer, TransferScheme::pic_flip);
  EXPECT_EQ(scene.numerics.flip, 0.99);
  EXPECT_EQ(scene.output.history_every, 20);
  EXPECT_EQ(scene.output.frames, 40);
}

TEST(Scene, ReadsUnits) {
  const Scene scene = read(example_with("young_modulus = 10e9", "young_modulus = \"9.5 GPa\""),
                           {"sample.size=[\"10 mm\", \"2 cm\", 0.01]", "loading.speed=20 mm/s"});
  EXPECT_EQ(scene.material.elasticity.young_modulus, 9.5e9);
  EXPECT_EQ(scene.lattice->spacing, 0.01 / 10);
  EXPECT_EQ(scene.lattice->points, (Index3{10, 20, 10}));
  EXPECT_EQ(std::get<ConfinedCompression>(scene.loading).speed, 0.02);
}

TEST(Scene, CountsLatticePointsAlongTheShortestSide) {
  const Scene scene = read(example_scene, {"sample.size=[0.3, 0.2, 0.1]", "sample.resolution=131"});
  EXPECT_EQ(scene.lattice->points, (Index3{393, 262, 131}));
  EXPECT_EQ(scene.lattice->spacing, 0.1 / 131);
}

TEST(SceneOverride, ReplacesAKeyOrAddsOne) {
  const Scene scene =
      read(example_scene, {"microstructure.seed=7", "output.frames=3", "loading.axis=x", "output.frames=4"});
  EXPECT_EQ(std::get<GaussianRandomFieldSource>(scene.microstructure).field.seed, 7u);
  EXPECT_EQ(scene.output.frames, 4);
  EXPECT_EQ(std::get<ConfinedCompression>(scene.loading).axis, 0);
}

TEST(SceneOverride, LiftsWhatItExcludes) {
  const Scene scene =
      read(example_scene, {"loading.until=failure", "numerics.flip_time=1 ms", "material.model=hencky"});
  EXPECT_TRUE(std::holds_alternative<UntilFailure>(scene.until));
  EXPECT_EQ(scene.numerics.flip_time, 1e-3);
  EXPECT_FALSE(scene.material.plasticity);
}

TEST(SceneOverride, SwitchesTheTransfer) {
  // The example has a flip: APIC lifts it.
  const Scene apic = read(example_scene, {"numerics.transfer=apic"});
  EXPECT_EQ(apic.numerics.transfer, TransferScheme::apic);
  const Scene blend = read(example_with("flip = 0.99", "transfer = \"apic\""),
                           {"numerics.transfer=pic_flip", "numerics.flip_time=1 ms"});
  EXPECT_EQ(blend.numerics.transfer, TransferScheme::pic_flip);
  EXPECT_EQ(blend.numerics.flip_time, 1e-3);
}

TEST(SceneOverride, SwitchesTheKindOfLoading) {
  const Scene scene =
      read(example_scene, {"loading.beta1=1", "loading.beta2=0", "loading.strain_rate=5e-4 1/s",
                           "loading.walls=affine", "loading.kind=triaxial"});
  const auto& loading = std::get<TriaxialLoading>(scene.loading);
  EXPECT_EQ(loading.beta1, 1);
  EXPECT_EQ(loading.strain_rate, 5e-4);
  EXPECT_EQ(loading.walls, WallKind::affine);
}

TEST(SceneFiles, AreRelativeToTheScene) {
  const TemporaryFolder folder;
  const auto data = folder.write("data/a.vdb", "");
  const auto file = folder.write("scene.toml", example_with(field_source, vdb_source));
  const Scene scene = read_scene(file);
  EXPECT_EQ(std::get<VdbSource>(scene.microstructure).file, data);
  EXPECT_TRUE(scene.lattice);  // given, so it overrules the file's own
}

TEST(SceneFiles, BringTheirOwnLattice) {
  const TemporaryFolder folder;
  folder.write("data/a.vdb", "");
  folder.write("scan.raw", "");
  std::string text = example_with("[sample]\nsize = [1.0, 2.0, 1.0]\nresolution = 10", "");
  text.replace(text.find(field_source), field_source.size(), vdb_source);
  EXPECT_FALSE(read_scene(folder.write("vdb.toml", text)).lattice);

  const std::string scan =
      "source = \"scan\"\nfile = \"scan.raw\"\nvoxel_size = \"5.345 um\"\nsolid = [255, 7]\nshape = [4, 5, "
      "6]";
  text.replace(text.find(vdb_source), vdb_source.size(), scan);
  const Scene scene = read_scene(folder.write("scan.toml", text));
  EXPECT_FALSE(scene.lattice);
  const auto& source = std::get<ScanSource>(scene.microstructure);
  EXPECT_EQ(source.voxel_size, 5.345e-6);
  EXPECT_EQ(source.solid, (std::vector<int>{255, 7}));
  EXPECT_EQ(source.shape, (Index3{4, 5, 6}));

  const std::vector<std::string> with_sample = {"sample.resolution=3"};
  EXPECT_ERROR(read_scene(folder.path() / "scan.toml", with_sample), SceneError,
               "must not be given with microstructure.source = \"scan\": the sample follows from the scan");
  const std::string again = to_toml(scene);
  EXPECT_EQ(to_toml(read_scene(folder.write("again.toml", again))), again);
}

TEST(SampleScene, NeedsNoOtherSections) {
  const TemporaryFolder folder;
  const std::string text = example_scene.substr(0, example_scene.find("[material]"));
  EXPECT_EQ(read_sample_scene(folder.write("scene.toml", text)).lattice->points[1], 20);
}

TEST(MaterialScene, NeedsNoOtherSections) {
  const TemporaryFolder folder;
  const std::size_t begin = example_scene.find("[material]");
  const std::string text = example_scene.substr(begin, example_scene.find("[loading]") - begin);
  const MaterialScene scene =
      read_material_scene(folder.write("scene.toml", text + "[numerics]\nreturn_mapping = \"paper\"\n"));
  EXPECT_EQ(scene.material.plasticity->cohesion, 2.5e6);
  EXPECT_EQ(scene.return_mapping, ReturnMapping::paper);
}

/// Reads what to_toml wrote; a scene's text holds every value, so equal texts are equal scenes.
void expect_round_trip(const Scene& scene) {
  const TemporaryFolder folder;
  const std::string text = to_toml(scene);
  const Scene again = read_scene(folder.write("scene.toml", text));
  EXPECT_EQ(to_toml(again), text);
  EXPECT_EQ(again.lattice.has_value(), scene.lattice.has_value());
  if (scene.lattice) {
    EXPECT_EQ(again.lattice->points, scene.lattice->points);
    EXPECT_EQ(again.lattice->spacing, scene.lattice->spacing) << text;
  }
}

TEST(ToToml, ReadsBackAsTheSameScene) {
  expect_round_trip(read(example_scene));
  expect_round_trip(read(
      example_scene,
      {"numerics.flip_time=0.0012345678901234567", "numerics.time_step=paper", "numerics.wall_rule=paper",
       "numerics.return_mapping=paper", "numerics.grid_offset=[0.1, -0.25, 1]", "output.paraview=false",
       "microstructure.threshold_rule=exact", "loading.ramp_time=0.1"}));
  expect_round_trip(read(example_scene, {"numerics.transfer=apic"}));
  expect_round_trip(
      read(example_scene, {"material.model=hencky", "microstructure.source=full", "loading.until=failure"}));
  expect_round_trip(read(example_scene, {"loading.kind=triaxial", "loading.beta1=0.3", "loading.beta2=-0.7",
                                         "loading.strain_rate=1e-3", "loading.walls=paper"}));
}

TEST(ToToml, KeepsTheSpacingToTheLastBit) {
  for (int resolution = 8; resolution < 400; resolution += 13) {
    for (const std::string side : {"1", "0.1", "0.3", "5.345e-6", "0.7123456789012345"}) {
      const std::string size = "sample.size=[" + side + ", " + side + ", " + side + "]";
      const Scene scene = read(example_scene, {size, "sample.resolution=" + std::to_string(resolution)});
      const TemporaryFolder folder;
      const Scene again = read_scene(folder.write("scene.toml", to_toml(scene)));
      ASSERT_EQ(again.lattice->spacing, scene.lattice->spacing) << size << " / " << resolution;
      ASSERT_EQ(again.lattice->points, scene.lattice->points);
    }
  }
}

TEST(ToToml, WritesEveryDefault) {
  const std::string text = to_toml(read(example_scene));
  for (const char* line :
       {"time_step_factor = 1\n", "wall_rule = \"ghost\"\n", "return_mapping = \"implicit\"\n",
        "frames = 40\n", "checkpoint_minutes = 10\n", "paraview = true\n", "ramp_time = 0\n",
        "threshold_rule = \"theory\"\n", "size = [1, 2, 1]\n"}) {
    EXPECT_NE(text.find(line), std::string::npos) << line;
  }
}

TEST(ToToml, WritesTheTransferWithItsOwnKeysOnly) {
  const auto has = [](const std::vector<std::string>& overrides, const std::string& lines) {
    return to_toml(read(example_scene, overrides)).find(lines) != std::string::npos;
  };
  EXPECT_TRUE(has({}, "transfer = \"pic_flip\"\nflip = 0.99\nwall_rule"));
  EXPECT_TRUE(has({"numerics.flip_time=1 ms"}, "transfer = \"pic_flip\"\nflip_time = 0.001\nwall_rule"));
  EXPECT_TRUE(has({"numerics.transfer=apic"}, "transfer = \"apic\"\nwall_rule"));
}

TEST(ShippedScenes, AreRead) {
  // One names a file that its script makes; any file that exists will do to read the scene.
  const TemporaryFolder folder;
  const std::string made = "microstructure.file=" + folder.write("sample.vdb", "").string();
  int count = 0;
  for (const auto& entry : std::filesystem::directory_iterator(ANTICRACK_ASSETS "/scenes")) {
    if (entry.path().extension() != ".toml") continue;
    ++count;
    SCOPED_TRACE(entry.path());
    const bool from_file = entry.path().filename() == "berea_sandstone.toml";
    EXPECT_NO_THROW(
        expect_round_trip(read_scene(entry.path(), std::span(&made, std::size_t(from_file ? 1 : 0)))));
  }
  EXPECT_GE(count, 7);
}

TEST(ShippedScenes, OfThePaperHaveItsLattice) {
  for (const std::string phi : {"024", "034", "044", "054", "070"}) {
    const Scene scene =
        read_scene(std::filesystem::path(ANTICRACK_ASSETS "/scenes") / ("paper_confined_" + phi + ".toml"));
    EXPECT_EQ(scene.lattice->points, (Index3{131, 262, 131}));
    EXPECT_EQ(scene.lattice->spacing, 1.0 / 131);
    EXPECT_EQ(std::get<GaussianRandomFieldSource>(scene.microstructure).solid_fraction, std::stod(phi) / 100);
  }
  EXPECT_EQ(read_scene(ANTICRACK_ASSETS "/scenes/paper_triaxial.toml").lattice->points,
            (Index3{131, 131, 131}));
}

TEST(ShippedScenes, QuickstartIsALargeTallSample) {
  const Scene scene = read_scene(ANTICRACK_ASSETS "/scenes/quickstart.toml");
  const auto& source = std::get<GaussianRandomFieldSource>(scene.microstructure);
  EXPECT_EQ(scene.lattice->points[1], 2 * scene.lattice->points[0]);
  EXPECT_GE(source.solid_fraction * double(scene.lattice->count()), 2e5);
  EXPECT_GE(std::get<UntilStrain>(scene.until).strain, 0.3);
}

}  // namespace
}  // namespace anticrack
