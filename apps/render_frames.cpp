#include "render_frames.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "canvas.h"
#include "errors.h"
#include "io/frame_file_name.h"

namespace anticrack {

namespace {

namespace fs = std::filesystem;

// dkappa depends on the output interval, its rate does not.
constexpr auto fields = std::to_array<RenderField>({
    {"kappa", "accumulated plastic strain \u03ba", false, 1},
    {"dkappa", "plastic strain since the last frame \u0394\u03ba", false, 1},
    {"kappa_rate", "plastic strain rate [1/s]", false, 1},
    {"velocity_x", "velocity v_x [m/s]", true, 1},
    {"velocity_y", "velocity v_y [m/s]", true, 1},
    {"velocity_z", "velocity v_z [m/s]", true, 1},
    {"speed", "speed [m/s]", false, 1},
    {"pressure", "pressure p [MPa]", true, 1e6},
    {"von_mises", "von Mises stress q [MPa]", false, 1e6},
});

std::vector<float> scaled(const std::vector<float>& values, double unit) {
  std::vector<float> out(values.size());
  std::transform(values.begin(), values.end(), out.begin(), [&](float v) { return float(v / unit); });
  return out;
}

}  // namespace

const RenderField& find_field(std::string_view name) {
  const std::string_view wanted = name == "velocity" ? "velocity_y" : name;  // the usual axis of compression
  for (const RenderField& field : fields) {
    if (field.name == wanted) return field;
  }
  std::vector<std::string_view> names;
  for (const RenderField& field : fields) names.push_back(field.name);
  throw InputError(fmt::format("--field {}: expected one of {}.", name, fmt::join(names, ", ")));
}

std::vector<float> field_values(const Frame& frame, const RenderField& field) {
  std::vector<float> values;
  if (field.name == "kappa") {
    values = frame.kappa;
  } else if (field.name == "dkappa") {
    values = frame.dkappa;
  } else if (field.name == "kappa_rate") {
    const double seconds = frame.header.seconds_since_last_frame;
    values = scaled(frame.dkappa, seconds > 0 ? seconds : 1);  // the first frame has no increment: all zero
  } else if (field.name == "pressure") {
    values = scaled(frame.pressure, field.unit);
  } else if (field.name == "von_mises") {
    values = scaled(frame.von_mises, field.unit);
  } else {
    for (const auto& v : frame.velocity) {
      values.push_back(field.name == "speed" ? std::hypot(v[0], v[1], v[2])
                                             : v[std::size_t(field.name.back() - 'x')]);
    }
  }
  if (values.size() != frame.position.size()) {
    throw InputError(
        fmt::format("--field {}: frame {} of this run does not hold it. Try velocity_y, or pressure.",
                    field.name, frame.header.index));
  }
  return values;
}

RunFrames::RunFrames(const fs::path& path) : path_(path) {
  const fs::path clean = fs::absolute(path / "").parent_path();
  name_ = (clean.filename() == "frames" ? clean.parent_path() : clean).filename().string();
  if (fs::is_regular_file(path)) {
    if (path.extension() != ".vdb") {
      throw InputError(fmt::format("{}: expected a run folder or a frame_NNNN.vdb.", path.string()));
    }
    files_ = {{0, path}};
    return;
  }
  if (!fs::is_directory(path))
    throw InputError(fmt::format("{}: no such run folder or frame.", path.string()));
  const fs::path folder = fs::is_directory(path / "frames") ? path / "frames" : path;
  files_ = find_frame_files(folder, ".vdb");
  if (files_.empty()) {
    throw InputError(fmt::format(
        "{}: not a run folder: it holds no frames/frame_NNNN.vdb. anticrack run writes one.", path.string()));
  }
}

const fs::path& RunFrames::file(std::string_view text) const {
  if (fs::is_regular_file(path_) || text == "last") return files_.back().second;
  for (const auto& [index, file] : files_) {
    if (std::to_string(index) == text) return file;
  }
  throw InputError(fmt::format("{}: no frame {}; it has frames {} to {}.", path_.string(), text,
                               files_.front().first, files_.back().first));
}

const fs::path& RunFrames::closest(double strain) const {
  const fs::path* best = &files_.front().second;
  double least = INFINITY;
  for (const auto& [index, file] : files_) {
    const FrameHeader header = read_frame_header(file);
    const double distance = std::abs(std::abs(header.strain[std::size_t(loading_axis(header))]) - strain);
    if (distance < least) {
      least = distance;
      best = &file;
    }
  }
  return *best;
}

int loading_axis(const FrameHeader& header) {
  int axis = 1;  // y where nothing is strained yet
  for (const int a : {0, 2}) {
    if (std::abs(header.strain[std::size_t(a)]) > std::abs(header.strain[std::size_t(axis)])) axis = a;
  }
  return axis;
}

std::string strain_label(const FrameHeader& header) {
  const int axis = loading_axis(header);
  const double percent = 100 * header.strain[std::size_t(axis)];
  const int decimals = percent != 0 && std::abs(percent) < 0.95 ? 2 : 1;
  const bool negative = percent <= -0.5 * std::pow(10, -decimals);
  return fmt::format("\u03b5_{} = {}{:.{}f} %", "xyz"[axis], negative ? "\u2212" : "", std::abs(percent),
                     decimals);
}

Box frame_box(const Frame& frame) {
  Box box{frame.header.box_lower, frame.header.box_upper};
  for (const auto& x : frame.position) {
    const Vec3 p(x[0], x[1], x[2]);
    box.lower = box.lower.cwiseMin(p);
    box.upper = box.upper.cwiseMax(p);
  }
  return box;
}

}  // namespace anticrack
