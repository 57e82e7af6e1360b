#include "images/write_mesh.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <cstring>
#include <fstream>

#include "errors.h"
#include "files/atomic_file.h"
#include "images/header_text.h"

namespace anticrack {
namespace {

namespace fs = std::filesystem;

// Bytes of numbers, handed to the stream now and then.
class Bytes {
 public:
  explicit Bytes(std::ofstream& stream) : stream_(stream) {}

  template <class Value>
  void add(const Value& value) {
    const auto* bytes = reinterpret_cast<const char*>(&value);
    buffer_.append(bytes, sizeof value);
    if (buffer_.size() > 1 << 20) flush();
  }
  void add(const Eigen::Vector3f& v) {
    for (int axis = 0; axis < 3; ++axis) add(v[axis]);
  }
  void flush() {
    stream_.write(buffer_.data(), std::streamsize(buffer_.size()));
    buffer_.clear();
  }

 private:
  std::ofstream& stream_;
  std::string buffer_;
};

void write_stl(const SurfaceMesh& mesh, Bytes& bytes) {
  char head[80] = "anticrack: binary STL, lengths in m";
  bytes.add(head);
  bytes.add(std::uint32_t(mesh.triangles.size()));
  for (const auto& [a, b, c] : mesh.triangles) {
    const Eigen::Vector3f &p = mesh.points[a], &q = mesh.points[b], &r = mesh.points[c];
    // In double precision: products of micrometres squared would leave the range of float.
    const Vec3 normal = (q - p).cast<double>().cross((r - p).cast<double>());
    const double length = normal.norm();
    const Vec3 unit = length > 0 ? Vec3(normal / length) : Vec3(Vec3::Zero());
    bytes.add(Eigen::Vector3f(unit.cast<float>()));
    bytes.add(p), bytes.add(q), bytes.add(r);
    bytes.add(std::uint16_t(0));
  }
}

void write_ply(const SurfaceMesh& mesh, Bytes& bytes, std::ofstream& stream) {
  stream << fmt::format(
      "ply\nformat binary_little_endian 1.0\ncomment anticrack: lengths in m\nelement vertex {}\nproperty "
      "float "
      "x\nproperty float y\nproperty float z\nelement face {}\nproperty list uchar uint vertex_indices\n"
      "end_header\n",
      mesh.points.size(), mesh.triangles.size());
  for (const Eigen::Vector3f& point : mesh.points) bytes.add(point);
  for (const auto& triangle : mesh.triangles) {
    bytes.add(std::uint8_t(3));
    for (const std::uint32_t point : triangle) bytes.add(point);
  }
}

}  // namespace

bool is_mesh_name(const fs::path& file) {
  const std::string ending = lower_case(file.extension().string());
  return ending == ".stl" || ending == ".ply";
}

void write_mesh(const SurfaceMesh& mesh, const fs::path& file) {
  if (!is_mesh_name(file)) throw InputError(fmt::format("{}: expected .stl or .ply", file.string()));
  if (mesh.triangles.size() > 0xffffffffu)
    throw InputError(fmt::format("{}: {} triangles; these formats count to 4294967295", file.string(),
                                 mesh.triangles.size()));
  const bool is_stl = lower_case(file.extension().string()) == ".stl";
  write_atomically(file, [&](const fs::path& temporary) {
    std::ofstream stream;
    stream.exceptions(std::ios::badbit | std::ios::failbit);
    stream.open(temporary, std::ios::binary);
    Bytes bytes(stream);
    is_stl ? write_stl(mesh, bytes) : write_ply(mesh, bytes, stream);
    bytes.flush();
    stream.close();
  });
}

}  // namespace anticrack
