#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstring>
#include <fstream>
#include <limits>
#include <numbers>
#include <numeric>
#include <optional>
#include <span>
#include <string>

#include "errors.h"
#include "files/atomic_file.h"
#include "io/frame.h"
#include "io/frame_file_name.h"

// VTK XML PolyData, one vertex cell a particle. Arrays are inline base64 without compression, their size
// ahead as UInt64, because OVITO's reader takes nothing else: it refuses `compressor`, `appended` and fewer
// vertices than points, and overlooks a file whose <Piece> is not the first element of <PolyData>.

namespace anticrack {
namespace {

namespace fs = std::filesystem;

std::string shortest(double value) {
  char digits[32];
  return {digits, std::to_chars(digits, digits + sizeof digits, value).ptr};
}

// ---- base64

constexpr char base64_letters[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";

// Two letters for each value of 12 bits.
const auto base64_pairs = [] {
  std::array<std::array<char, 2>, 4096> pairs;
  for (unsigned i = 0; i < pairs.size(); ++i) pairs[i] = {base64_letters[i >> 6], base64_letters[i & 63]};
  return pairs;
}();

// Whole triples of bytes; 4 letters each.
void encode_triples(const unsigned char* bytes, std::size_t triples, char* letters) {
  for (std::size_t t = 0; t < triples; ++t, bytes += 3, letters += 4) {
    const unsigned bits = unsigned(bytes[0]) << 16 | unsigned(bytes[1]) << 8 | bytes[2];
    std::memcpy(letters, base64_pairs[bits >> 12].data(), 2);
    std::memcpy(letters + 2, base64_pairs[bits & 4095].data(), 2);
  }
}

// Size and data as one stream of bytes, encoded.
std::string encode(std::span<const std::byte> data) {
  const auto* bytes = reinterpret_cast<const unsigned char*>(data.data());
  const std::uint64_t size = data.size();
  std::string letters((sizeof size + size + 2) / 3 * 4, '=');

  // The size takes two triples and two thirds: the third one ends with the first byte of the data.
  std::array<unsigned char, 9> first{};
  std::memcpy(first.data(), &size, sizeof size);
  if (size > 0) first[8] = bytes[0];
  encode_triples(first.data(), 3, letters.data());
  if (size == 0) {
    letters.back() = '=';  // the place of the byte that is not there
    return letters;
  }

  const std::size_t triples = (size - 1) / 3;
  constexpr std::size_t chunk = 1 << 16;
  tbb::parallel_for(std::size_t(0), (triples + chunk - 1) / chunk, [&](std::size_t c) {
    const std::size_t begin = c * chunk;
    encode_triples(bytes + 1 + 3 * begin, std::min(chunk, triples - begin), letters.data() + 12 + 4 * begin);
  });

  if (const std::size_t rest = (size - 1) % 3; rest > 0) {
    std::array<unsigned char, 3> last{};
    std::memcpy(last.data(), bytes + 1 + 3 * triples, rest);
    std::array<char, 4> end;
    encode_triples(last.data(), 1, end.data());
    std::copy_n(end.begin(), rest + 1, letters.end() - 4);
  }
  return letters;
}

// ---- arrays

template <class T>
constexpr const char* vtk_type = nullptr;
template <>
constexpr const char* vtk_type<float> = "Float32";
template <>
constexpr const char* vtk_type<std::int32_t> = "Int32";
template <>
constexpr const char* vtk_type<std::uint32_t> = "UInt32";

template <class T>
void write_array(std::ofstream& stream, const char* name, std::span<const T> values) {
  stream << "<DataArray type=\"" << vtk_type<T> << "\" Name=\"" << name << "\" format=\"binary\">\n"
         << encode(std::as_bytes(values)) << "\n</DataArray>\n";
}

void write_array(std::ofstream& stream, const char* name, const std::vector<std::array<float, 3>>& values) {
  stream << "<DataArray type=\"Float32\" Name=\"" << name
         << "\" NumberOfComponents=\"3\" format=\"binary\">\n"
         << encode(std::as_bytes(std::span(values))) << "\n</DataArray>\n";
}

void write_optional_array(std::ofstream& stream, const char* name, const std::vector<float>& values) {
  if (!values.empty()) write_array<float>(stream, name, values);
}

void write_polydata(const Frame& frame, std::ofstream& stream) {
  const std::string count = std::to_string(frame.id.size());
  stream << "<?xml version=\"1.0\"?>\n"
            "<VTKFile type=\"PolyData\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\">\n"
            "<PolyData>\n"
            "<Piece NumberOfPoints=\""
         << count << "\" NumberOfVerts=\"" << count
         << "\" NumberOfLines=\"0\" NumberOfStrips=\"0\" NumberOfPolys=\"0\">\n";

  stream << "<PointData>\n";
  write_array<std::uint32_t>(stream, "id", frame.id);
  // The sphere of the particle's own volume, spacing^3.
  const double radius = frame.header.particle_spacing * std::cbrt(3 / (4 * std::numbers::pi));
  write_array<float>(stream, "radius", std::vector<float>(frame.id.size(), float(radius)));
  if (!frame.velocity.empty()) write_array(stream, "v", frame.velocity);
  write_optional_array(stream, "kappa", frame.kappa);
  write_optional_array(stream, "dkappa", frame.dkappa);
  write_optional_array(stream, "pressure", frame.pressure);
  write_optional_array(stream, "von_mises", frame.von_mises);
  stream << "</PointData>\n<Points>\n";
  write_array(stream, "points", frame.position);
  stream << "</Points>\n<Verts>\n";
  std::vector<std::int32_t> number(frame.id.size());
  std::iota(number.begin(), number.end(), 0);
  write_array<std::int32_t>(stream, "connectivity", number);
  std::iota(number.begin(), number.end(), 1);
  write_array<std::int32_t>(stream, "offsets", number);

  stream << "</Verts>\n</Piece>\n"
            "<FieldData>\n"
            "<DataArray type=\"Float64\" Name=\"TimeValue\" NumberOfTuples=\"1\" format=\"ascii\">"
         << shortest(frame.header.time)
         << "</DataArray>\n"
            "</FieldData>\n</PolyData>\n</VTKFile>\n";
}

// ---- time series

// The TimeValue at the end of a file that write_polydata wrote, else nothing.
std::optional<double> time_of(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary | std::ios::ate);
  const std::streamoff size = stream.tellg();
  if (size <= 0) return std::nullopt;
  std::string tail(std::size_t(std::min<std::streamoff>(size, 512)), '\0');
  stream.seekg(size - std::streamoff(tail.size()));
  if (!stream.read(tail.data(), std::streamsize(tail.size()))) return std::nullopt;

  const auto name = tail.find("Name=\"TimeValue\"");
  const auto value = name == std::string::npos ? name : tail.find('>', name);
  if (value == std::string::npos) return std::nullopt;
  double time = 0;
  const auto [stop, failed] = std::from_chars(tail.data() + value + 1, tail.data() + tail.size(), time);
  return failed == std::errc{} ? std::optional(time) : std::nullopt;
}

// From the files that are there, so that a resumed run keeps the frames of the one before.
void write_time_series(const fs::path& folder) {
  std::string text =
      "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"1.0\" "
      "byte_order=\"LittleEndian\">\n<Collection>\n";
  for (const auto& [index, file] : find_frame_files(folder, ".vtp")) {
    if (const auto time = time_of(file))
      text += "<DataSet timestep=\"" + shortest(*time) + "\" part=\"0\" file=\"" + file.filename().string() +
              "\"/>\n";
  }
  write_text_atomically(folder / "frames.pvd", text + "</Collection>\n</VTKFile>\n");
}

}  // namespace

void write_paraview_frame(const Frame& frame, const fs::path& folder) {
  if (frame.id.size() > std::size_t(std::numeric_limits<std::int32_t>::max()))
    throw InputError("frame " + std::to_string(frame.header.index) + ": " + std::to_string(frame.id.size()) +
                     " particles are more than a .vtp file of ours can number");
  write_atomically(folder / (frame_file_stem(frame.header.index) + ".vtp"), [&](const fs::path& temporary) {
    std::ofstream stream;
    stream.exceptions(std::ios::badbit | std::ios::failbit);
    stream.open(temporary, std::ios::binary);
    write_polydata(frame, stream);
    stream.close();
  });
  write_time_series(folder);
}

}  // namespace anticrack
