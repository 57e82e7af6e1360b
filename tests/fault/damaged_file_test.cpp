#include <gtest/gtest.h>

#include <cstdlib>
#include <functional>
#include <random>

#include "engine/blocks.h"
#include "engine/io_frame_samples.h"
#include "fault/peak_memory.h"
#include "images/slice_reader.h"
#include "images/write_image.h"
#include "info.h"
#include "io/checkpoint.h"
#include "io/frame.h"
#include "io_test_folder.h"
#include "microstructure_io.h"
#include "simulation.h"

namespace anticrack {
namespace {

namespace fs = std::filesystem;

constexpr int flips = 10000, cuts = 200;

/// A checkpoint of a real simulation.
void write_checkpoint(const fs::path& file) {
  const double h = 0.05;
  Simulation simulation({Vec3::Constant(8 * h),
                         h * h * h,
                         2 * h,
                         {1e4, {10e9, 0.3}, {}},
                         ConfinedCompression{1, true, 20.0},
                         {}},
                        porous_block({8, 8, 8}, h, 0.4));
  for (int n = 0; n < 5; ++n) simulation.step(false);
  CheckpointWriter writer("[sample]\nresolution = 8\n");
  simulation.save(writer);
  writer.write(file);
}

/// What a reader tells of a file.
using Reading = std::function<std::string(const fs::path& file)>;

std::string read_checkpoint(const fs::path& file) {
  CheckpointReader reader(file);
  reader.verify();
  std::string content = reader.scene();
  for (const double x : reader.read<double>("particle.v.y")) content += std::to_string(x);
  return content;
}

std::string read_points(const fs::path& file) {
  const Frame frame = read_frame(file);
  const auto bytes = [](const auto& values) {
    return std::string(reinterpret_cast<const char*>(values.data()), values.size() * sizeof values[0]);
  };
  return bytes(frame.id) + bytes(frame.position) + bytes(frame.velocity) + bytes(frame.kappa) +
         bytes(frame.pressure) + std::to_string(frame.header.time) + frame.header.run;
}

std::string read_surface(const fs::path& file) {
  const Microstructure structure = read_microstructure(file);
  std::string content = std::to_string(structure.solid_points);
  for (const auto& [key, value] : structure.metadata) content += key + ' ';
  for (const Vec3& x : seed_particles(structure, structure.lattice)) content += std::to_string(x.sum());
  return content;
}

class DamagedFile : public IoTest {
 protected:
  void expect_noticed(const fs::path& file, const Reading& read, int bit_flips = flips) const {
    const std::string good = file_content(file);
    const std::string expected = read(file);
    const auto check = [&](const std::string& damage) {
      std::string message;
      const PeakMemory memory;
      try {
        EXPECT_EQ(read(file), expected) << damage;  // what does not matter may be read
        return;
      } catch (const FileError& error) {
        message = error.what();
      }
      EXPECT_LE(memory.bytes(), 2 * good.size()) << damage;
      EXPECT_TRUE(message.starts_with(file.string() + ": ")) << damage << ": " << message;
    };

    // Each bit of the first bytes, where the structure is, then bits anywhere.
    std::mt19937 random(3);
    std::fstream stream(file, std::ios::binary | std::ios::in | std::ios::out);
    for (int n = 0; n < bit_flips; ++n) {
      const std::size_t bit =
          n < bit_flips / 2 ? std::size_t(n) % (8 * good.size()) : random() % (8 * good.size());
      const std::size_t place = bit / 8;
      stream.seekp(std::streamoff(place)).put(char(good[place] ^ (1 << bit % 8))).flush();
      check("bit " + std::to_string(bit));
      stream.seekp(std::streamoff(place)).put(good[place]).flush();
    }
    ASSERT_EQ(file_content(file), good);
    for (int n = 0; n < cuts; ++n) {
      const std::size_t size = good.size() * std::size_t(n) / cuts;
      put_file(file, good.substr(0, size));
      EXPECT_ANY_THROW(read(file)) << size << " bytes";
      check("cut to " + std::to_string(size) + " bytes");
    }
  }
};

TEST_F(DamagedFile, ACheckpointIsRefusedAndTheOneBeforeOpens) {
  const fs::path before = checkpoint_file(folder, 1), newest = checkpoint_file(folder, 2);
  write_checkpoint(before);
  write_checkpoint(newest);
  expect_noticed(newest, [&](const fs::path& file) {
    std::vector<std::string> damaged;
    const fs::path opens = newest_valid_checkpoint(folder, damaged);
    EXPECT_EQ(opens, damaged.empty() ? newest : before);
    return read_checkpoint(file);
  });
}

TEST_F(DamagedFile, AFrameIsRefused) {
  expect_noticed(write_frame(sample_frame(12), folder), read_points);
}

TEST_F(DamagedFile, AMicrostructureIsRefused) {
  const Microstructure structure =
      generate_microstructure({{20, 24, 18}, 0.05}, {200, 2, 50, 1}, 0.4, ThresholdRule::exact);
  write_microstructure(structure, folder / "s.vdb");
  expect_noticed(folder / "s.vdb", read_surface);
}

TEST_F(DamagedFile, InfoRefusesItTooAndSaysWhy) {
  expect_noticed(
      write_frame(sample_frame(6), folder), [](const fs::path& file) { return describe(file); }, 1000);
}

std::string read_image(const fs::path& file) {
  const auto image = open_image(file);
  std::string content;
  std::vector<std::uint16_t> slice;
  for (int k = 0; k < image->size()[2]; ++k) {
    image->read(k, slice);
    for (const std::uint16_t label : slice) content += char(label);
  }
  return content;
}

// Where headers give voxels no checksum guards them; what is wrong must not cost memory nor escape.
TEST_F(DamagedFile, AnImageWhoseHeaderPromisesTooMuchTakesNoMemory) {
  PhaseImage image{{50, 50, 40}, 1e-6, std::vector<std::uint8_t>(100000, 1)};
  const auto replaced = [](std::string text, const std::string& what, const std::string& by) {
    return text.replace(text.find(what), what.size(), by);
  };
  const std::pair<std::string, std::string> sizes[] = {
      {"a.nrrd", "50 50 40"}, {"a.mha", "50 50 40"}, {"a.npy", "40, 50, 50"}};
  for (const auto& [name, size] : sizes) {
    write_image(slices_of(image), folder / name);
    const std::string good = file_content(folder / name);
    for (std::string absurd :
         {"1048576 1048576 1048576", "99999999999999999999 1 1", "50 50 41", "1 1 1048576"}) {
      if (name == "a.npy") absurd = replaced(replaced(absurd, " ", ","), " ", ",");
      put_file(folder / name, replaced(good, size, absurd));
      const PeakMemory memory;
      EXPECT_NE(file_error_of([&] { read_image(folder / name); }), "") << name << ' ' << absurd;
      EXPECT_LE(memory.bytes(), 2 * good.size()) << name << ' ' << absurd;
    }
    for (int n = 0; n < cuts; ++n) {
      put_file(folder / name, good.substr(0, good.size() * std::size_t(n) / cuts));
      const PeakMemory memory;
      EXPECT_NE(file_error_of([&] { read_image(folder / name); }), "") << name << ' ' << n;
      EXPECT_LE(memory.bytes(), 2 * good.size()) << name << ' ' << n;
    }
  }
  // Compressed: so many voxels might be in it, but are not.
  const std::string head = "NRRD0004\ntype: uchar\ndimension: 3\nsizes: 50 50 10000\nencoding: gzip\n\n";
  put_file(folder / "b.nrrd",
           head + std::string("\x1f\x8b\x08\0\0\0\0\0\0\x03", 10) + std::string(100000, 'x'));
  const PeakMemory memory;
  EXPECT_NE(file_error_of([&] { read_image(folder / "b.nrrd"); }), "");
  EXPECT_LE(memory.bytes(), 200000u);
}

}  // namespace
}  // namespace anticrack
