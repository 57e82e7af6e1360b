#if ANTICRACK_RENDER

#include "render.h"

#include <gtest/gtest.h>

#include <CLI/CLI.hpp>
#include <cstdlib>
#include <fstream>
#include <iterator>

#include "errors.h"
#include "expect_error.h"
#include "io/frame.h"
#include "io/history.h"
#include "render_frames.h"
#include "render_movie.h"
#include "running_command.h"
#include "temporary_folder.h"

namespace anticrack {
namespace {

namespace fs = std::filesystem;

/// A run folder with frames 0 to 2 of a small block, and its history.
void make_run(const fs::path& folder, const std::string& name) {
  fs::create_directories(folder / "frames");
  for (int index = 0; index < 3; ++index) {
    Frame frame;
    frame.header.index = index;
    frame.header.strain = {0, -0.05 * index, 0};
    frame.header.box_upper = Vec3(1, 2, 1);
    frame.header.particle_spacing = 0.125;
    frame.header.cell_size = 0.25;
    frame.header.run = name;
    for (int i = 0; i < 8 * 16 * 8; ++i) {
      const float h = 0.125f;
      frame.position.push_back(
          {h * (float(i % 8) + 0.5f), h * (float(i / 8 % 16) + 0.5f), h * (float(i / 128) + 0.5f)});
      frame.velocity.push_back({0, 1 - frame.position.back()[1], 0});
      frame.kappa.push_back(0.1f * float(index) * frame.position.back()[1]);
      frame.id.push_back(std::uint32_t(i));
    }
    write_frame(frame, folder / "frames");
  }
  HistoryWriter history(folder / "history.csv");
  for (int i = 0; i < 20; ++i) {
    HistoryRow row;
    row.step = i;
    row.strain_y = -0.01 * i;
    row.p = 1e5 * i;
    row.q = 5e4 * i;
    history.append(row);
  }
}

class RenderCommand : public testing::Test {
 protected:
  void SetUp() override {
    make_run(folder_.path() / "a", "run a");
    make_run(folder_.path() / "b", "run b");
  }
  std::string path(const std::string& name) const { return (folder_.path() / name).string(); }

  static void render(std::vector<std::string> arguments) {
    CLI::App app;
    add_render_command(app);
    arguments.insert(arguments.begin(), "render");
    arguments.push_back("--quiet");
    std::reverse(arguments.begin(), arguments.end());  // CLI11 takes them from the back
    app.parse(arguments);
  }

  std::string content(const std::string& name) const {
    std::ifstream stream(path(name), std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), {}};
  }

  /// Refused with a message that holds `expected`, and nothing written.
  void expect_refused(const std::vector<std::string>& arguments, const std::string& expected) {
    try {
      render(arguments);
      FAIL() << "not refused: " << expected;
    } catch (const InputError& error) {
      EXPECT_NE(std::string(error.what()).find(expected), std::string::npos) << error.what();
    }
    EXPECT_FALSE(fs::exists(path("x.png")));
  }

  TemporaryFolder folder_;
};

const std::vector<std::string> small = {"--size", "260x340"};

TEST_F(RenderCommand, WritesTheSamePictureTwiceAndReplacesIt) {
  render({path("a"), "-o", path("1.png"), small[0], small[1]});
  render({path("a"), "-o", path("2.png"), small[0], small[1], "--threads", "1"});
  render({path("a"), "-o", path("2.png"), small[0], small[1], "--threads", "3"});
  EXPECT_EQ(content("1.png").substr(1, 3), "PNG");
  EXPECT_EQ(content("1.png"), content("2.png"));
  EXPECT_NE(content("1.png").find("frame 2, step 0"), std::string::npos);
}

TEST_F(RenderCommand, DrawsEveryRendererModeAndField) {
  for (const std::string renderer : {"embree", "osmesa"}) {
    for (const std::string mode : {"surface", "spheres"}) {
      render({path("a"), "-o", path(renderer + mode + ".png"), small[0], small[1], "--renderer", renderer,
              "--mode", mode, "--cut", "z=0.5", "--frame", "1", "--samples", "8"});
      EXPECT_GT(content(renderer + mode + ".png").size(), 1000u);
    }
  }
  for (const std::string field : {"velocity_y", "velocity", "speed", "kappa"}) {
    render({path("a"), "-o", path(field + ".png"), small[0], small[1], "--renderer", "osmesa", "--field",
            field});
  }
  EXPECT_EQ(content("velocity.png"), content("velocity_y.png"));
  EXPECT_NE(content("speed.png"), content("velocity_y.png"));
}

TEST_F(RenderCommand, TakesAFrameFileAndAnOutputFolderThatIsNotThereYet) {
  render({path("a/frames/frame_0001.vdb"), "-o", path("new/deep/x.png"), small[0], small[1], "--renderer",
          "osmesa"});
  EXPECT_GT(content("new/deep/x.png").size(), 1000u);
}

TEST_F(RenderCommand, LaysRunsSideBySide) {
  render({path("a"), path("b"), "-o", path("panel.png"), "--panel", "--strains", "0.05,0.1", "--size",
          "120x180", "--renderer", "osmesa"});
  const std::string bytes = content("panel.png");
  ASSERT_GT(bytes.size(), 24u);
  const auto number = [&](std::size_t at) {
    return int(std::uint8_t(bytes[at + 2])) * 256 + int(std::uint8_t(bytes[at + 3]));
  };
  EXPECT_GT(number(16), 2 * 120);
  EXPECT_LT(number(16), 2 * 120 + 100);
  EXPECT_GT(number(20), 2 * 180);
}

TEST_F(RenderCommand, ChoosesFramesByStrain) {
  const RunFrames run(path("a"));
  EXPECT_EQ(run.closest(0.06).filename(), "frame_0001.vdb");
  EXPECT_EQ(run.closest(0.9).filename(), "frame_0002.vdb");
  EXPECT_EQ(run.file("0").filename(), "frame_0000.vdb");
  EXPECT_EQ(run.file("last").filename(), "frame_0002.vdb");
}

TEST_F(RenderCommand, PlotsTheHistory) {
  for (const std::string format : {"png", "svg", "pdf"}) {
    render({path("a"), path("b"), "-o", path("plot." + format), "--plot", "--y", "p"});
    EXPECT_GT(content("plot." + format).size(), 1000u);
  }
  render({path("a"), "-o", path("plot.png"), "--plot", "--x", "strain_y", "--y", "p,q,sigma_yy"});
}

TEST_F(RenderCommand, RefusesBadInputBeforeWriting) {
  const std::string out = path("x.png");
  expect_refused({path("a"), "-o", out, "--field", "kapa"}, "expected one of kappa, dkappa");
  expect_refused({path("a"), "-o", out, "--field", "von_mises"}, "does not hold it");
  expect_refused({path("a"), "-o", out, "--frame", "7"}, "frames 0 to 2");
  expect_refused({path("."), "-o", out}, "not a run folder");
  expect_refused({path("none"), "-o", out}, "no such run folder");
  expect_refused({path("a/history.csv"), "-o", out}, "frame_NNNN.vdb");
  expect_refused({path("a"), "-o", path("x.jpg")}, ".png");
  expect_refused({path("a"), "-o", out, "--renderer", "povray"}, "embree or osmesa");
  expect_refused({path("a"), "-o", out, "--mode", "points"}, "surface or spheres");
  expect_refused({path("a"), "-o", out, "--cut", "w=1"}, "--cut w=1");
  expect_refused({path("a"), "-o", out, "--cut", "0,0,0,1"}, "no length");
  for (const std::string cut : {"x=1,2", "1,2,3", "x=1,2,3,4"})
    expect_refused({path("a"), "-o", out, "--cut", cut},
                   "--cut " + cut +
                       ": expected x=D, y=D or z=D (metres; the half towards the camera goes), or "
                       "NX,NY,NZ,D (what has n . x > D goes).");
  expect_refused({path("a"), "-o", out, "--cut", "z=7"}, "misses the sample");
  expect_refused({path("a"), "-o", out, "--range", "1,0"}, "LOW < HIGH");
  expect_refused({path("a"), "-o", out, "--range", "1,nan"}, "not a number");
  expect_refused({path("a"), "-o", out, "--size", "0x10"}, "WIDTHxHEIGHT");
  expect_refused({path("a"), "-o", out, "--size", "40x40"}, "no room");
  expect_refused({path("a"), "-o", out, "--view", "0,90"}, "elevation");
  expect_refused({path("a"), "-o", out, "--samples", "0"}, "1 to 1024");
  expect_refused({path("a"), "-o", out, "--percentile", "0"}, "percentile");
  expect_refused({path("a"), path("b"), "-o", out}, "--panel");
  expect_refused({path("a"), "-o", out, "--frames", "1,2"}, "--panel");
  expect_refused({path("a"), "-o", out, "--plot", "--y", "pressure"}, "expected one of step, time");
  expect_refused({path("a"), "-o", out, "--plot", "--y", "p,time"}, "different units");
  expect_refused({path("a"), "-o", out, "--log", "--field", "velocity_y"}, "without sign");
  expect_refused({path("a"), "-o", out, "--panel", "--plot"},
                 "--panel, --plot and --movie exclude each other.");
  expect_refused({path("a"), "-o", out, "--movie", path("m.mp4")},
                 "--movie names the file itself; leave -o out.");
  expect_refused({path("a"), "--movie", path("m.gif")}, "m.gif: expected a name that ends in .mp4.");
  expect_refused({path("a")}, "expected -o IMAGE (or --movie M.mp4).");
  expect_refused({path("a"), "-o", out, "--panel", "--frames", "1", "--strains", "0.1"},
                 "--frames and --strains exclude each other.");
  expect_refused({path("a"), "-o", out, "--fps", "0"}, "--fps 0: expected 0 < fps <= 240.");
  fs::remove(path("b/history.csv"));
  expect_refused({path("b"), "-o", out, "--plot"}, "b: not a run folder: it holds no history.csv.");
  Frame empty;
  empty.header.particle_spacing = 0.125;
  empty.header.cell_size = 0.25;
  const std::string frame = write_frame(empty, folder_.path()).string();
  expect_refused({frame, "-o", out}, "frame_0000.vdb: the frame holds no particles.");
}

TEST_F(RenderCommand, SaysWhichFrameIsDamaged) {
  fs::resize_file(path("a/frames/frame_0002.vdb"), 1000);
  EXPECT_ERROR(render({path("a"), "-o", path("x.png")}), FileError, "frame_0002.vdb: damaged or truncated");
  EXPECT_FALSE(fs::exists(path("x.png")));
}

TEST_F(RenderCommand, SaysWhereOsmesaFails) {
  const auto expect = [&](int status, const std::string& library_folder, const std::string& failing,
                          const std::string& message) {
    const Outcome outcome = run_shell("LD_LIBRARY_PATH=" + library_folder + " OSMESA_FAILS=" + failing +
                                      " " ANTICRACK_BINARY " render " + path("a") + " -o " + path("x.png") +
                                      " --renderer osmesa --size 260x340 --quiet");
    EXPECT_EQ(outcome.status, status) << failing;
    EXPECT_EQ(outcome.text, "anticrack: " + message + "\n");
    EXPECT_FALSE(fs::exists(path("x.png")));
  };
  const std::string failing = ANTICRACK_OSMESA "failing";
  const std::string hint = "; install libosmesa6 or use the Embree renderer";
  for (const char* name : {"libOSMesa.so.8", "libOSMesa.so"})
    folder_.write(std::string("libraries/") + name, std::string(100, 'x'));
  expect(4, path("libraries"), "",
         "OSMesa: " + path("libraries/libOSMesa.so.8") + ": invalid ELF header; " +
             path("libraries/libOSMesa.so") + ": invalid ELF header" + hint);
  expect(4, ANTICRACK_OSMESA "empty", "", "OSMesa: the library lacks OSMesaCreateContextAttribs" + hint);
  expect(2, failing, "context", "OSMesa offers no OpenGL 3.3 core context. Use the Embree renderer.");
  expect(2, failing, "size",
         "OSMesa cannot draw 520 x 582 pixels. Use a smaller picture or the Embree renderer.");
  expect(2, failing, "function", "OpenGL: the context lacks glUseProgram");
  expect(2, failing, "shader", "OpenGL: a shader of the preview does not compile: 0:7: syntax error");
  expect(2, failing, "program", "OpenGL: the preview's shaders do not link");
  expect(2, failing, "drawing", "OpenGL: error 1285 while drawing the preview");
}

TEST_F(RenderCommand, SaysWhenFfmpegFails) {
  folder_.write("ffmpeg", "#!/bin/sh\nexit 1\n");
  fs::permissions(path("ffmpeg"), fs::perms::owner_all);
  const std::string before = std::getenv("PATH");
  setenv("PATH", (folder_.path().string() + ":" + before).c_str(), 1);
  EXPECT_ERROR(render({path("a"), "--movie", path("m.mp4"), "--size", "260x340", "--renderer", "osmesa"}),
               FileError, "m.mp4: ffmpeg failed. Its command: ffmpeg ");
  setenv("PATH", before.c_str(), 1);
  EXPECT_FALSE(fs::exists(path("m.mp4")));
}

TEST_F(RenderCommand, RendersNumberedPicturesOfAMovie) {
  render({path("a"), "--movie", path("m.mp4"), "--size", "260x340", "--renderer", "osmesa"});
  for (const std::string name : {"frame_0000.png", "frame_0001.png", "frame_0002.png"}) {
    EXPECT_GT(content("m_frames/" + name).size(), 1000u);
  }
}

TEST(Movie, CommandQuotesWhatAShellWouldRead) {
  const std::string line = shell_line(ffmpeg_command("my frames", "m.mp4", 12));
  EXPECT_NE(line.find("'my frames/frame_%04d.png'"), std::string::npos);
  EXPECT_NE(line.find("yuv420p"), std::string::npos);
}

TEST(StrainLabel, ShowsTheLargestStrain) {
  FrameHeader header;
  header.strain = {0.001, -0.1104, 0};
  EXPECT_EQ(strain_label(header), "\u03b5_y = \u221211.0 %");
  header.strain = {0, -0.004, 0};
  EXPECT_EQ(strain_label(header), "\u03b5_y = \u22120.40 %");
  header.strain = {0, 0, 0.2};
  EXPECT_EQ(strain_label(header), "\u03b5_z = 20.0 %");
  header.strain = {0, 0, 0};
  EXPECT_EQ(strain_label(header), "\u03b5_y = 0.0 %");
}

}  // namespace
}  // namespace anticrack

#endif
