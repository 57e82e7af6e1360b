#include <gtest/gtest.h>

#include "example_scene.h"
#include "microstructure_io.h"
#include "running_command.h"
#include "temporary_folder.h"

namespace anticrack {
namespace {

namespace fs = std::filesystem;

bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

TEST(Command, TellsVersionAndHelp) {
  EXPECT_EQ(run("--version").status, 0);
  EXPECT_TRUE(run("--version").text.starts_with("anticrack "));
  const Outcome help = run("generate --help");
  EXPECT_EQ(help.status, 0);
  EXPECT_TRUE(contains(help.text, "Examples:")) << help.text;
}

TEST(Command, ExitsWithTwoOnAWrongCommandLine) {
  EXPECT_EQ(run("").status, 2);
  const Outcome command = run("generat x");
  EXPECT_EQ(command.status, 2);
  EXPECT_TRUE(contains(command.text, "did you mean generate?")) << command.text;
  const Outcome option = run("generate scene.toml -o a.vdb --theads=2");
  EXPECT_EQ(option.status, 2);
  EXPECT_TRUE(contains(option.text, "Did you mean --threads?")) << option.text;
  EXPECT_EQ(run("generate").status, 2);
  EXPECT_EQ(run("generate scene.toml -o a.vdb --threads=0").status, 2);
}

TEST(Command, RefusesAWrongSceneBeforeItWritesAnything) {
  const TemporaryFolder folder;
  const std::string scene = folder.write("scene.toml", example_scene).string();
  const fs::path output = folder.path() / "new/sample.vdb";
  const Outcome outcome =
      run("generate " + scene + " -o " + output.string() + " --set microstructure.solid_fraction=0");
  EXPECT_EQ(outcome.status, 2);
  EXPECT_EQ(outcome.text,
            "anticrack: --set microstructure.solid_fraction=0: microstructure.solid_fraction = 0; expected 0 "
            "< phi <= "
            "1.\n");
  EXPECT_FALSE(fs::exists(output.parent_path()));
}

TEST(Command, RefusesAnEmptyMicrostructure) {
  const TemporaryFolder folder;
  const std::string scene = folder.write("scene.toml", example_scene).string();
  // At phi = 1e-9 the 2000 lattice points hold no solid.
  const Outcome outcome = run("generate " + scene + " -o " + (folder.path() / "a.vdb").string() +
                              " --set microstructure.solid_fraction=1e-9");
  EXPECT_EQ(outcome.status, 2) << outcome.text;
  EXPECT_FALSE(fs::exists(folder.path() / "a.vdb"));
}

TEST(Command, RefusesASampleLargerThanTheMemory) {
  const TemporaryFolder folder;
  const std::string scene = folder.write("scene.toml", example_scene).string();
  // The most points that a lattice may have; refused by any machine with less than 90 GB.
  const Outcome outcome = run("generate " + scene + " -o " + (folder.path() / "a.vdb").string() +
                              " --set sample.resolution=1290");
  if (sysconf(_SC_PHYS_PAGES) * double(sysconf(_SC_PAGE_SIZE)) > 90e9) GTEST_SKIP() << "a large machine";
  EXPECT_EQ(outcome.status, 2) << outcome.text;
  EXPECT_TRUE(contains(outcome.text, "this machine has")) << outcome.text;
}

TEST(Command, GeneratesWhatInfoTellsAndDoesNotOverwriteIt) {
  const TemporaryFolder folder;
  const std::string scene = folder.write("scene.toml", example_scene).string();
  const fs::path output = folder.path() / "new/sample.vdb";
  const std::string generate = "generate " + scene + " -o " + output.string();
  ASSERT_EQ(run(generate).status, 0);
  EXPECT_EQ(read_microstructure(output).lattice.points, (Index3{10, 20, 10}));

  const Outcome again = run(generate);
  EXPECT_EQ(again.status, 2);
  EXPECT_TRUE(contains(again.text, "--force")) << again.text;
  EXPECT_EQ(run(generate + " --force --quiet").text, "");

  const Outcome info = run("info " + output.string());
  EXPECT_EQ(info.status, 0);
  EXPECT_TRUE(contains(info.text, "grid \"surface\"")) << info.text;
  EXPECT_TRUE(contains(info.text, "seed = 1")) << info.text;
}

TEST(Command, BenchReportsWhatScriptsReadAndLeavesNothingBehind) {
  const TemporaryFolder folder;
  const std::string scene = folder.write("scene.toml", example_scene).string();
  const Outcome outcome = run("bench " + scene + " --rounds 1 --steps 2 --threads 1 --json");
  ASSERT_EQ(outcome.status, 0) << outcome.text;
  for (const char* key :
       {"particles", "threads", "particle_steps_per_second", "seconds_per_step", "bytes_per_particle",
        "phases", "precision", "simd", "share_of_compute_bound", "plain_step_seconds_per_particle"})
    EXPECT_TRUE(contains(outcome.text, std::string(1, '"').append(key).append("\":")))
        << key << " in " << outcome.text;
  EXPECT_EQ(std::distance(fs::directory_iterator(folder.path()), fs::directory_iterator()), 1);
  EXPECT_EQ(run("bench --set sample.resolution=10").status, 2);
  const Outcome other = run("bench " + scene + " --options");
  EXPECT_EQ(other.status, 2);
  EXPECT_TRUE(contains(other.text, "neither SCENE")) << other.text;
  const Outcome simd = run("bench " + scene + " --simd SSE9");
  EXPECT_EQ(simd.status, 2);
  EXPECT_TRUE(contains(simd.text, "expected one of")) << simd.text;
}

TEST(Command, RunNamesTheTransferAndResumesWithNoOther) {
  const TemporaryFolder folder;
  const std::string scene = folder.write("scene.toml", example_scene).string();
  const auto plan = [&](const std::string& set) { return run("run " + scene + " --dry-run" + set).text; };
  EXPECT_TRUE(contains(plan(""), "PIC-FLIP (flip = 0.99); 108 bytes a particle")) << plan("");
  EXPECT_TRUE(contains(plan(" --set numerics.flip=0"), "PIC (velocity increments left out); 108 bytes"));
  EXPECT_TRUE(contains(plan(" --set numerics.flip_time=0.001"), "PIC-FLIP (flip_time = 0.001 s); 108 bytes"));
  const std::string apic = " --set numerics.transfer=apic";
  EXPECT_TRUE(contains(plan(apic), "APIC; 180 bytes a particle")) << plan(apic);
  EXPECT_TRUE(contains(plan(apic + " --set material.model=hencky"), "APIC; 172 bytes a particle"));

  const std::string into = "run " + scene + " -o " + (folder.path() / "out").string() + " --max-steps ";
  ASSERT_EQ(run(into + "3" + apic).status, 0);
  const Outcome other = run(into + "6 --resume");
  EXPECT_EQ(other.status, 2);
  EXPECT_TRUE(contains(other.text, "of another scene")) << other.text;
  EXPECT_EQ(run(into + "6 --resume" + apic).status, 0);
}

TEST(Command, ExitsWithFourOnADamagedFile) {
  const TemporaryFolder folder;
  const std::string file = folder.write("damaged.vdb", "this is no OpenVDB file").string();
  const Outcome outcome = run("info " + file);
  EXPECT_EQ(outcome.status, 4) << outcome.text;
  EXPECT_TRUE(contains(outcome.text, file)) << outcome.text;
}

TEST(Command, SaysWhenItsAnswerCannotBeWritten) {
  const TemporaryFolder folder;
  const std::string scene = folder.write("scene.toml", example_scene).string();
  const Outcome outcome = run("info " + scene + " >/dev/full");
  EXPECT_EQ(outcome.status, 4);
  EXPECT_EQ(outcome.text, "anticrack: standard output: cannot be written: No space left on device\n");
}

TEST(Command, TellsTheResolvedScene) {
  const TemporaryFolder folder;
  const std::string scene = folder.write("scene.toml", example_scene).string();
  EXPECT_TRUE(contains(run("info " + scene).text, "checkpoint_minutes = 10"));
}

TEST(Command, PrecisionMeasuresResumesAndRefuses) {
  TemporaryFolder folder;
  const std::string out = (folder.path() / "study").string();
  const std::string study = "precision -o " + out + " --problem softening --runs 1 --quick";
  const Outcome whole = run(study);
  EXPECT_EQ(whole.status, 0) << whole.text;
  EXPECT_TRUE(contains(whole.text, "softening   stress")) << whole.text;
  for (const char* name : {"precision.csv", "precision.json", "provenance.json"})
    EXPECT_TRUE(fs::exists(folder.path() / "study" / name)) << name;

  const Outcome again = run(study);
  EXPECT_EQ(again.status, 2);
  EXPECT_TRUE(contains(again.text, "exists and is not empty")) << again.text;
  const Outcome resumed = run(study + " --resume --problem stiff_block");
  EXPECT_EQ(resumed.status, 0) << resumed.text;
  EXPECT_TRUE(contains(resumed.text, "softening   stress")) << resumed.text;
  EXPECT_TRUE(contains(resumed.text, "stiff_block K")) << resumed.text;
  const Outcome other = run("precision -o " + out + " --resume");
  EXPECT_EQ(other.status, 2);
  EXPECT_TRUE(contains(other.text, "a study with --quick; expected to go on with the same")) << other.text;
  const Outcome wrong = run("precision -o " + out + "2 --problem wve");
  EXPECT_EQ(wrong.status, 2);
  EXPECT_TRUE(contains(wrong.text, "--problem wve; expected one of wave, large_wave, vortex")) << wrong.text;
  EXPECT_FALSE(fs::exists(out + "2"));
  folder.write("study/provenance.json", R"({"commit": "of another version"})");
  const Outcome elsewhere = run(study + " --resume");
  EXPECT_EQ(elsewhere.status, 2);
  EXPECT_TRUE(contains(elsewhere.text, "measured with commit \"of another version\", this is"))
      << elsewhere.text;
}

// Its first case takes milliseconds, all of them minutes.
TEST(Command, PrecisionStoppedByASignalSaysHowToGoOn) {
  const TemporaryFolder folder;
  const Outcome outcome = run_shell("cd " + folder.path().string() +
                                    "\n" ANTICRACK_BINARY
                                    " precision -o out --quick --runs 1 --quiet &\n"
                                    "while kill -0 $! && ! [ -e out/precision.json ]; do sleep 0.01; done\n"
                                    "kill $!; wait $!; echo status $?");
  EXPECT_TRUE(contains(outcome.text, "anticrack: stopped after wave, ")) << outcome.text;
  EXPECT_TRUE(contains(outcome.text, " cells. Go on with the same command and --resume.\nstatus 75\n"))
      << outcome.text;
  EXPECT_TRUE(fs::exists(folder.path() / "out/precision.csv"));
}

}  // namespace
}  // namespace anticrack
