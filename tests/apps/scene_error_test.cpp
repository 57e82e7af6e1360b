#include <gtest/gtest.h>

#include "example_scene.h"
#include "scene.h"
#include "temporary_folder.h"

namespace anticrack {
namespace {

/// The message with which a scene is refused, its folder left out; "accepted" if it is not.
std::string refusal(const std::string& text, const std::vector<std::string>& overrides = {}) {
  const TemporaryFolder folder;
  try {
    read_scene(folder.write("scene.toml", text), overrides);
  } catch (const SceneError& error) {
    std::string message = error.what();
    const std::string prefix = folder.path().string() + "/";
    for (std::size_t at; (at = message.find(prefix)) != std::string::npos;) message.erase(at, prefix.size());
    return message;
  }
  return "accepted";
}

std::string refusal_of(const std::string& line, const std::string& replacement) {
  return refusal(example_with(line, replacement));
}

TEST(SceneReader, AcceptsTheExample) {
  EXPECT_EQ(refusal(example_scene), "accepted");
}

TEST(SceneReader, RefusesPoissonRatiosOutsideTheStableRange) {
  EXPECT_EQ(refusal_of("poisson_ratio = 0.3", "poisson_ratio = 0.5"),
            "scene.toml:17: material.poisson_ratio = 0.5; expected -1 < nu < 0.5. "
            "Use 0.49 for a nearly incompressible solid.");
  EXPECT_EQ(refusal_of("poisson_ratio = 0.3", "poisson_ratio = -1"),
            "scene.toml:17: material.poisson_ratio = -1; expected -1 < nu < 0.5. "
            "Use 0.49 for a nearly incompressible solid.");
}

TEST(SceneReader, RefusesSolidFractionsOutsideZeroToOne) {
  for (const std::string phi : {"0", "-0.1", "1.01", "nan", "inf"}) {
    EXPECT_EQ(refusal_of("solid_fraction = 0.34", "solid_fraction = " + phi),
              "scene.toml:7: microstructure.solid_fraction = " + phi + "; expected 0 < phi <= 1.");
  }
  EXPECT_EQ(refusal_of("solid_fraction = 0.34", "solid_fraction = 1"), "accepted");
}

TEST(SceneReader, RefusesSizesThatAreNotPositive) {
  EXPECT_EQ(refusal_of("size = [1.0, 2.0, 1.0]", "size = [1.0, 0, 1.0]"),
            "scene.toml:2: sample.size[1] = 0; expected size > 0 [m].");
  EXPECT_EQ(refusal_of("size = [1.0, 2.0, 1.0]", "size = [1.0, 2.0, -1.0]"),
            "scene.toml:2: sample.size[2] = -1; expected size > 0 [m].");
  EXPECT_EQ(refusal_of("resolution = 10", "resolution = 0"),
            "scene.toml:3: sample.resolution = 0; expected a whole number from 1 to 10000.");
}

TEST(SceneReader, RefusesNumbersThatAreNotFinite) {
  EXPECT_EQ(refusal_of("density = 1e4", "density = nan"),
            "scene.toml:15: material.density = nan; expected rho > 0 [kg/m^3].");
  EXPECT_EQ(refusal_of("softening = 1e6", "softening = inf"),
            "scene.toml:20: material.softening = inf; expected xi >= 0.");
}

TEST(SceneReader, RefusesNumbersThatADoubleCannotHold) {
  EXPECT_EQ(refusal_of("density = 1e4", "density = 1e400  # heavy"),
            "scene.toml:15: material.density = 1e400; expected rho > 0 [kg/m^3].");
  EXPECT_EQ(refusal_of("size = [1.0, 2.0, 1.0]", "size = [1.0, 2.0, 1_0.0e400]"),
            "scene.toml:2: sample.size[2] = 1_0.0e400; expected size > 0 [m].");
  EXPECT_EQ(refusal_of("seed = 1", "seed = 99999999999999999999"),
            "scene.toml:11: microstructure.seed = 99999999999999999999; expected a whole number from 0 to "
            "9223372036854775807.");
  EXPECT_EQ(
      refusal_of("density = 1e4", "density = \"1e400 kg/m^3\""),
      "scene.toml:15: material.density = \"1e400 kg/m^3\"; that is outside the range of a double precision "
      "number, 2.3e-308 to 1.7e308; expected rho > 0 [kg/m^3].");
}

TEST(SceneReader, NamesTheNearestKeyForAnUnknownOne) {
  EXPECT_EQ(refusal_of("friction = 1.2", "frction = 1.2"),
            "scene.toml:18: material.frction = 1.2; unknown key; did you mean friction?");
  EXPECT_EQ(refusal_of("speed = 2.0", "sepeds = 2.0"),
            "scene.toml:26: loading.sepeds = 2; unknown key; did you mean speed?");
  EXPECT_EQ(refusal_of("resolution = 10", "resolution = 10\nzzzzzz = 1"),
            "scene.toml:4: sample.zzzzzz = 1; unknown key; keys of [sample]: size, resolution.");
}

TEST(SceneReader, NamesTheNearestSectionForAnUnknownOne) {
  EXPECT_EQ(refusal_of("[numerics]", "[numeric]"),
            "scene.toml:29: [numeric] is no section; did you mean [numerics]?");
  EXPECT_EQ(
      refusal_of("[output]", "[gravitational]"),
      "scene.toml:34: [gravitational] is no section; expected one of: sample, microstructure, material, "
      "loading, numerics, output.");
}

TEST(SceneReader, RefusesMissingKeysAndSections) {
  EXPECT_EQ(refusal_of("density = 1e4\n", "\n"),
            "scene.toml:13: [material] has no key density; expected rho > 0 [kg/m^3].");
  EXPECT_EQ(refusal_of("kind = \"confined_compression\"\n", ""),
            "scene.toml:22: [loading] has no key kind; expected \"triaxial\" or \"confined_compression\".");
  EXPECT_EQ(refusal_of("until_strain = 0.4", ""),
            "scene.toml:22: [loading] has no end; expected until_strain = <number> or until = \"failure\".");
  EXPECT_EQ(refusal_of("[sample]\nsize = [1.0, 2.0, 1.0]\nresolution = 10", ""),
            "scene.toml: section [sample] is missing.");
  EXPECT_EQ(refusal(""), "scene.toml: section [microstructure] is missing.");
}

TEST(SceneReader, RefusesValuesOfAWrongType) {
  EXPECT_EQ(refusal_of("density = 1e4", "density = true"),
            "scene.toml:15: material.density = true; that is no number; expected rho > 0 [kg/m^3].");
  EXPECT_EQ(refusal_of("density = 1e4", "density = \"heavy\""),
            "scene.toml:15: material.density = \"heavy\"; that does not begin with a finite decimal number "
            "(units of "
            "density: kg/m^3, kg/m3, g/cm^3, g/cm3, t/m^3); expected rho > 0 [kg/m^3].");
  EXPECT_EQ(refusal_of("axis = \"y\"", "axis = 1"),
            "scene.toml:24: loading.axis = 1; expected \"x\", \"y\" or \"z\".");
  EXPECT_EQ(refusal_of("size = [1.0, 2.0, 1.0]", "size = 1"),
            "scene.toml:2: sample.size = 1; expected [x, y, z], three numbers; each: expected size > 0 [m].");
  EXPECT_EQ(
      refusal_of("size = [1.0, 2.0, 1.0]", "size = [1.0, 2.0]"),
      "scene.toml:2: sample.size = [1, 2]; expected [x, y, z], three numbers; each: expected size > 0 [m].");
  EXPECT_EQ(refusal_of("waves = 100", "waves = 100.5"),
            "scene.toml:8: microstructure.waves = 100.5; expected a whole number from 1 to 2147483647.");
  EXPECT_EQ(refusal_of("history_every = 20", "paraview = 1"),
            "scene.toml:35: output.paraview = 1; expected true or false.");
  EXPECT_EQ(refusal_of("density = 1e4", "density = 1979-05-27"),
            "scene.toml:15: material.density: expected a number, a text, true or false, or a list of these.");
}

TEST(SceneReader, RefusesUnitsOfAnotherDimension) {
  EXPECT_EQ(refusal_of("cohesion = 2.5e6", "cohesion = \"2.5 mm\""),
            "scene.toml:19: material.cohesion = \"2.5 mm\"; \"mm\" is no unit of stress; allowed units: Pa, "
            "kPa, MPa, "
            "GPa; expected c >= 0 [Pa].");
}

TEST(SceneReader, RefusesAnUnknownChoice) {
  EXPECT_EQ(refusal_of("platen = \"both\"", "platen = \"bottom\""),
            "scene.toml:25: loading.platen = \"bottom\"; expected \"top\" or \"both\".");
  EXPECT_EQ(refusal_of("source = \"gaussian_random_field\"", "source = \"noise\""),
            "scene.toml:6: microstructure.source = \"noise\"; expected \"gaussian_random_field\", \"vdb\", "
            "\"scan\" or "
            "\"full\".");
}

TEST(SceneReader, NamesTheNearestSizeThatTheLatticeAllows) {
  EXPECT_EQ(refusal_of("size = [1.0, 2.0, 1.0]", "size = [1.0, 2.04, 1.0]"),
            "scene.toml:2: sample.size = [1, 2.04, 1]; expected whole multiples of the lattice spacing 0.1 m "
            "(shortest "
            "side / resolution), but 2.04 is 20.400000 of them along y; nearest size: 2 m.");
}

TEST(SceneReader, RefusesDuplicateKeys) {
  EXPECT_EQ(
      refusal_of("resolution = 10", "resolution = 10\nresolution = 11"),
      "scene.toml:4: Error while parsing key-value pair: cannot redefine existing integer 'resolution'.");
}

TEST(SceneReader, RefusesWhatIsNoToml) {
  EXPECT_EQ(refusal_of("density = 1e4", "density = "),
            "scene.toml:15: Error while parsing key-value pair: expected value, saw '\\n'.");
  EXPECT_EQ(refusal("resolution = 10\n"),
            "scene.toml:1: key resolution stands outside a section; expected [section] above it.");
}

TEST(SceneReader, RefusesPlatensFasterThanTheElasticWave) {
  // sqrt((lambda + 2 mu) / rho) = sqrt(13.4615e9 / 1e4)
  EXPECT_EQ(refusal_of("speed = 2.0", "speed = 2000"),
            "scene.toml:26: loading.speed = 2000; expected walls slower than the elastic wave speed "
            "sqrt((lambda + 2 mu) / rho) = 1160.24 m/s, but the fastest moves at 2000 m/s.");
}

TEST(SceneReader, RefusesTriaxialWallsFasterThanTheElasticWave) {
  const std::string triaxial =
      "kind = \"triaxial\"\nbeta1 = 0\nbeta2 = -1\nwalls = \"slip\"\nstrain_rate = 600\nuntil_strain = 0.4";
  std::string scene = example_scene;
  const std::size_t begin = scene.find("kind ="), end = scene.find("until_strain = 0.4") + 18;
  scene.replace(begin, end - begin, triaxial);
  // The wall at the end of the 2 m side is the fastest.
  EXPECT_EQ(refusal(scene),
            "scene.toml:27: loading.strain_rate = 600; expected walls slower than the elastic wave speed "
            "sqrt((lambda + 2 mu) / rho) = 1160.24 m/s, but the fastest moves at 1200 m/s.");
  EXPECT_EQ(refusal(scene, {"loading.strain_rate=5e-4"}), "accepted");
  EXPECT_EQ(refusal(scene, {"loading.beta2=0"}),
            "--set loading.beta2=0: loading.beta2 = 0; beta1 is 0 as well, so that no wall moves; expected "
            "at least one "
            "that is not 0.");
}

TEST(SceneReader, RefusesStrainsThatNoRunReaches) {
  for (const std::string strain : {"0", "-0.1", "0.96"}) {
    EXPECT_EQ(refusal_of("until_strain = 0.4", "until_strain = " + strain),
              "scene.toml:27: loading.until_strain = " + strain + "; expected 0 < until_strain <= 0.95.");
  }
}

TEST(SceneReader, RefusesKeysThatExcludeEachOther) {
  EXPECT_EQ(
      refusal_of("flip = 0.99", "flip = 0.99\nflip_time = 1e-3"),
      "scene.toml:32: numerics.flip_time = 0.001; numerics.flip is given as well; expected one of the two.");
  EXPECT_EQ(refusal_of("until_strain = 0.4", "until_strain = 0.4\nuntil = \"failure\""),
            "scene.toml:28: loading.until = \"failure\"; loading.until_strain is given as well; expected one "
            "of the two.");
}

TEST(SceneReader, RefusesKeysOfAnotherChoice) {
  EXPECT_EQ(refusal_of("platen = \"both\"", "platen = \"both\"\nbeta1 = 1"),
            "scene.toml:26: loading.beta1 = 1; that key belongs to kind = \"triaxial\", but kind = "
            "\"confined_compression\" here.");
  EXPECT_EQ(
      refusal_of("seed = 1", "seed = 1\nfile = \"a.vdb\""),
      "scene.toml:12: microstructure.file = \"a.vdb\"; that key belongs to source = \"vdb\" or \"scan\", but "
      "source = \"gaussian_random_field\" here.");
  EXPECT_EQ(refusal_of("model = \"drucker_prager_softening\"", "model = \"hencky\""),
            "scene.toml:19: material.cohesion = 2500000; that key belongs to model = "
            "\"drucker_prager_softening\", but "
            "model = \"hencky\" here.");
  EXPECT_EQ(refusal(example_with("flip = 0.99", "return_mapping = \"paper\""), {"material.model=hencky"}),
            "scene.toml:31: numerics.return_mapping = \"paper\"; that key belongs to material.model = "
            "\"drucker_prager_softening\", but the model is \"hencky\" here.");
}

TEST(SceneReader, RefusesAFlipWithApic) {
  for (const std::string key : {"flip = 0.99", "flip_time = 0.001"}) {
    EXPECT_EQ(refusal_of("flip = 0.99", key + "\ntransfer = \"apic\""),
              "scene.toml:31: numerics." + key +
                  "; that key belongs to transfer = \"pic_flip\", but transfer = \"apic\" here.");
  }
  EXPECT_EQ(refusal(example_scene, {"numerics.transfer=apic", "numerics.flip=1"}),
            "--set numerics.flip=1: numerics.flip = 1; that key belongs to transfer = \"pic_flip\", but "
            "transfer = \"apic\" here.");
  EXPECT_EQ(refusal_of("flip = 0.99", "transfer = \"flip\""),
            "scene.toml:31: numerics.transfer = \"flip\"; expected \"pic_flip\" or \"apic\".");
}

TEST(SceneReader, RefusesTooManyLatticePoints) {
  EXPECT_EQ(refusal_of("resolution = 10", "resolution = 2000"),
            "scene.toml:3: sample.resolution = 2000; expected at most 4294967295 lattice points in all.");
}

TEST(SceneReader, RefusesFilesThatAreNotThere) {
  const std::string scene = example_with(
      "source = \"gaussian_random_field\"\nsolid_fraction = 0.34\nwaves = 100\nwavelengths_per_side = 3\n"
      "heterogeneity = 50\nseed = 1",
      "source = \"vdb\"\nfile = \"missing.vdb\"");
  EXPECT_EQ(refusal(scene),
            "scene.toml:7: microstructure.file = \"missing.vdb\"; expected an existing file, but there is no "
            "missing.vdb.");
}

TEST(SceneReader, RefusesShapesAndLabelsThatNoScanHas) {
  const auto refusal_of_scan = [](const std::string& keys) {
    std::string scene = example_scene;
    const std::size_t end = scene.find("[material]");
    scene.replace(
        0, end, "[microstructure]\nsource = \"scan\"\nfile = \"/dev/null\"\nvoxel_size = 1\n" + keys + "\n");
    return refusal(scene);
  };
  EXPECT_EQ(refusal_of_scan("solid = [1]\nshape = [2, 3]"),
            "scene.toml:6: microstructure.shape = [2, 3]; expected [nx, ny, nz], three numbers of voxels.");
  EXPECT_EQ(refusal_of_scan("solid = [1]\nshape = [2, 3, 0]"),
            "scene.toml:6: microstructure.shape[2] = 0; expected a whole number from 1 to 100000.");
  EXPECT_EQ(refusal_of_scan("solid = [70000]"),
            "scene.toml:5: microstructure.solid[0] = 70000; expected a whole number from 0 to 65535.");
  EXPECT_EQ(refusal_of_scan("solid = [1]\nshape = [2, 3, 1]"), "accepted");
}

TEST(SceneReader, NamesTheOverrideAsThePlace) {
  EXPECT_EQ(refusal(example_scene, {"material.poisson_ratio=0.5"}),
            "--set material.poisson_ratio=0.5: material.poisson_ratio = 0.5; expected -1 < nu < 0.5. Use "
            "0.49 for a "
            "nearly incompressible solid.");
  EXPECT_EQ(refusal(example_scene, {"material.density=1e400"}),
            "--set material.density=1e400: material.density = 1e400; that is outside the range of a double "
            "precision "
            "number, 2.3e-308 to 1.7e308; expected rho > 0 [kg/m^3].");
  EXPECT_EQ(refusal(example_scene, {"materiel.density=1"}),
            "--set materiel.density=1: [materiel] is no section; did you mean [material]?");
  EXPECT_EQ(refusal(example_scene, {"material.desnity=1"}),
            "--set material.desnity=1: material.desnity = 1; unknown key; did you mean density?");
}

TEST(SceneReader, RefusesOverridesThatExcludeEachOther) {
  EXPECT_EQ(refusal(example_scene, {"loading.until=failure", "loading.until_strain=0.1"}),
            "--set loading.until=failure: loading.until = failure; loading.until_strain is given as "
            "well; expected "
            "one of the two.");
}

TEST(SceneReader, RefusesOverridesThatNameNoKey) {
  for (const std::string text : {"density=1", "material.density", "=1", ".density=1", "material.=1", ""}) {
    EXPECT_EQ(refusal(example_scene, {text}),
              "--set " + text + ": expected --set section.key=value, such as --set loading.speed=2.");
  }
}

TEST(SceneReader, SaysWhenThereIsNoSuchScene) {
  try {
    read_scene("/nowhere/scene.toml");
    FAIL();
  } catch (const SceneError& error) {
    EXPECT_STREQ(error.what(), "/nowhere/scene.toml: there is no such scene file.");
  }
}

}  // namespace
}  // namespace anticrack
