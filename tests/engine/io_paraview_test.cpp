#include <cmath>
#include <cstring>
#include <numbers>

#include "io/frame.h"
#include "io_frame_samples.h"
#include "io_test_folder.h"

namespace anticrack {
namespace {

class ParaviewFrame : public IoTest {};

std::string decode_base64(const std::string& letters) {
  const std::string alphabet = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  EXPECT_EQ(letters.size() % 4, 0u);
  std::string bytes;
  unsigned bits = 0;
  int count = 0;
  for (const char letter : letters) {
    if (letter == '=') break;
    bits = bits << 6 | unsigned(alphabet.find(letter));
    count += 6;
    if (count >= 8) bytes += char(bits >> (count -= 8) & 255);
  }
  return bytes;
}

// The values of one inline array, after its UInt64 size.
template <class T>
std::vector<T> array_of(const std::string& text, const std::string& name) {
  const auto tag = text.find("Name=\"" + name + "\"");
  if (tag == std::string::npos) return {};
  const auto begin = text.find(">\n", tag) + 2;
  const std::string bytes = decode_base64(text.substr(begin, text.find('\n', begin) - begin));
  std::uint64_t size = 0;
  if (bytes.size() < sizeof size) return {};
  std::memcpy(&size, bytes.data(), sizeof size);
  EXPECT_EQ(size, bytes.size() - sizeof size) << name;
  std::vector<T> values((bytes.size() - sizeof size) / sizeof(T));
  if (!values.empty()) std::memcpy(values.data(), bytes.data() + sizeof size, values.size() * sizeof(T));
  return values;
}

TEST_F(ParaviewFrame, ArraysDecodeToTheValues) {
  // Sizes of every remainder by three, of which the padding of base64 depends, and one of several chunks.
  for (const int edge : {1, 2, 3, 4, 45}) {
    const Frame frame = sample_frame(edge);
    write_paraview_frame(frame, folder);
    const std::string text = file_content(folder / "frame_0012.vtp");
    using Vector = std::array<float, 3>;
    EXPECT_EQ(array_of<Vector>(text, "points"), frame.position);
    EXPECT_EQ(array_of<std::uint32_t>(text, "id"), frame.id);
    EXPECT_EQ(array_of<Vector>(text, "v"), frame.velocity);
    EXPECT_EQ(array_of<float>(text, "kappa"), frame.kappa);
    EXPECT_EQ(array_of<float>(text, "dkappa"), frame.dkappa);
    EXPECT_EQ(array_of<float>(text, "pressure"), frame.pressure);
    EXPECT_EQ(array_of<float>(text, "von_mises"), frame.von_mises);
    const auto connectivity = array_of<std::int32_t>(text, "connectivity");
    const auto offsets = array_of<std::int32_t>(text, "offsets");
    ASSERT_EQ(connectivity.size(), frame.id.size());
    ASSERT_EQ(offsets.size(), frame.id.size());
    EXPECT_EQ(connectivity.back(), std::int32_t(frame.id.size()) - 1);
    EXPECT_EQ(offsets.back(), std::int32_t(frame.id.size()));
  }
}

TEST_F(ParaviewFrame, SphereHasTheVolumeOfItsParticle) {
  write_paraview_frame(sample_frame(2, 0.01), folder);
  const auto radius = array_of<float>(file_content(folder / "frame_0012.vtp"), "radius");
  ASSERT_EQ(radius.size(), 8u);
  // r^3 triples the rounding of a float.
  for (const float r : radius)
    EXPECT_NEAR(4 / 3.0 * std::numbers::pi * std::pow(double(r), 3), 1e-6, 2e-7 * 1e-6);
}

TEST_F(ParaviewFrame, IsWhatOvitoTakesToo) {
  write_paraview_frame(sample_frame(2), folder);
  const std::string text = file_content(folder / "frame_0012.vtp");
  EXPECT_EQ(text.find("compressor"), std::string::npos);
  EXPECT_EQ(text.find("appended"), std::string::npos);
  EXPECT_NE(text.find("NumberOfPoints=\"8\" NumberOfVerts=\"8\""), std::string::npos);
  EXPECT_NE(text.find("<PolyData>\n<Piece "), std::string::npos);
  EXPECT_NE(text.find("byte_order=\"LittleEndian\" header_type=\"UInt64\""), std::string::npos);
}

TEST_F(ParaviewFrame, EmptyFrameIsAFrame) {
  write_paraview_frame(sample_frame(0), folder);
  const std::string text = file_content(folder / "frame_0012.vtp");
  EXPECT_NE(text.find("\nAAAAAAAAAAA=\n"), std::string::npos);  // eight zero bytes: an array of no values
  EXPECT_TRUE(array_of<std::uint32_t>(text, "id").empty());
}

TEST_F(ParaviewFrame, ElasticRunHasNoKappa) {
  Frame frame = sample_frame(2);
  frame.kappa.clear();
  frame.dkappa.clear();
  write_paraview_frame(frame, folder);
  EXPECT_EQ(file_content(folder / "frame_0012.vtp").find("kappa"), std::string::npos);
}

// Pairs of time and file, in order of the text.
std::vector<std::pair<double, std::string>> time_series(const std::string& text) {
  std::vector<std::pair<double, std::string>> entries;
  for (auto at = text.find("timestep=\""); at != std::string::npos; at = text.find("timestep=\"", at + 1)) {
    const auto file = text.find("file=\"", at) + 6;
    entries.emplace_back(std::stod(text.substr(at + 10)), text.substr(file, text.find('"', file) - file));
  }
  return entries;
}

TEST_F(ParaviewFrame, TimeSeriesNamesAllFramesThatAreThere) {
  Frame frame = sample_frame(2);
  for (const int index : {0, 1, 10}) {
    frame.header.index = index;
    frame.header.time = index / 3.0;
    write_paraview_frame(frame, folder);
  }
  using Entries = std::vector<std::pair<double, std::string>>;
  EXPECT_EQ(time_series(file_content(folder / "frames.pvd")),
            (Entries{{0, "frame_0000.vtp"}, {1 / 3.0, "frame_0001.vtp"}, {10 / 3.0, "frame_0010.vtp"}}));

  // A resumed run starts from the files alone; a frame written anew moves to its new time.
  std::filesystem::remove(folder / "frames.pvd");
  std::filesystem::remove(folder / "frame_0010.vtp");
  put_file(folder / "frame_0005.vtp", "left half-written by another program");
  frame.header.index = 1;
  frame.header.time = 0.5;
  write_paraview_frame(frame, folder);
  EXPECT_EQ(time_series(file_content(folder / "frames.pvd")),
            (Entries{{0, "frame_0000.vtp"}, {0.5, "frame_0001.vtp"}}));
}

TEST_F(ParaviewFrame, FullDiskIsAnErrorAndKeepsTheOldFrame) {
  write_paraview_frame(sample_frame(2), folder);
  const std::string good = file_content(folder / "frame_0012.vtp");
  std::string message;
  {
    const FullDisk full(100000);
    message = file_error_of([&] { write_paraview_frame(sample_frame(20), folder); });
  }
  EXPECT_PRED_FORMAT2(testing::IsSubstring, "frame_0012.vtp", message);
  EXPECT_PRED_FORMAT2(testing::IsSubstring, "File too large", message);
  EXPECT_EQ(file_content(folder / "frame_0012.vtp"), good);
  EXPECT_EQ(files_in_folder(), 2u);
}

}  // namespace
}  // namespace anticrack
