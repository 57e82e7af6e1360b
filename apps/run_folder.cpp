#include "run_folder.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <cmath>
#include <cstdio>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>

#include "errors.h"
#include "files/atomic_file.h"
#include "io/checkpoint.h"
#include "io/provenance.h"

namespace anticrack {

namespace {

std::string label_of(const Scene& scene) {
  if (const auto* field = std::get_if<GaussianRandomFieldSource>(&scene.microstructure))
    return fmt::format("phi = {:.2f}", field->solid_fraction);
  if (const auto* vdb = std::get_if<VdbSource>(&scene.microstructure)) return vdb->file.stem().string();
  if (const auto* scan = std::get_if<ScanSource>(&scene.microstructure)) return scan->file.stem().string();
  return "solid";
}

constexpr const char* checkpoint_folder = "checkpoint";

/// Values of a resolved scene by "section.key".
std::map<std::string, std::string> values_of(const std::string& scene_text) {
  std::map<std::string, std::string> values;
  std::istringstream stream(scene_text);
  std::string section, line;
  while (std::getline(stream, line)) {
    const std::size_t equals = line.find(" = ");
    if (line.starts_with('['))
      section = line.substr(1, line.find(']') - 1);
    else if (equals != std::string::npos)
      values[section + '.' + line.substr(0, equals)] = line.substr(equals + 3);
  }
  return values;
}

/// Each key in which two resolved scenes differ, with both values; "" if they are the same.
std::string scene_difference(const std::string& of_checkpoint, const std::string& given) {
  const auto was = values_of(of_checkpoint), is = values_of(given);
  auto keys = was;
  keys.insert(is.begin(), is.end());
  std::string text;
  for (const auto& [key, ignored] : keys) {
    const auto before = was.find(key), now = is.find(key);
    const std::string a = before == was.end() ? "not given" : before->second;
    const std::string b = now == is.end() ? "not given" : now->second;
    if (a != b) text += fmt::format("{}{} was {}, is {}", text.empty() ? "" : "; ", key, a, b);
  }
  return text;
}

}  // namespace

RunFolder::RunFolder(const std::filesystem::path& folder, const Scene& scene, double spacing, int threads)
    : folder_(folder),
      output_(scene.output),
      scene_text_(to_toml(scene)),
      label_(label_of(scene)),
      spacing_(spacing) {
  write_text_atomically(folder_ / "scene.toml", scene_text_);
  write_provenance(folder_ / "provenance.json", kernels().simd, threads);
  history_.emplace(folder_ / "history.csv");
}

RunFolder::RunFolder(const std::filesystem::path& folder, const Scene& scene, double spacing, int threads,
                     CheckpointReader& checkpoint)
    : folder_(folder),
      output_(scene.output),
      scene_text_(to_toml(scene)),
      label_(label_of(scene)),
      spacing_(spacing) {
  last_checkpoint_ = checkpoint.read_value<std::int64_t>("step");
  frames_ = checkpoint.read_value<std::int32_t>("frame.count");
  last_frame_time_ = checkpoint.read_value<double>("frame.time");
  last_kappa_ = checkpoint.read<float>("frame.kappa");
  history_.emplace(folder_ / "history.csv", last_checkpoint_);
  write_provenance(folder_ / "provenance.json", kernels().simd, threads);
}

Frame RunFolder::take_frame(const Simulation& simulation) {
  const Particles& p = simulation.particles();
  Frame frame;
  const Vec3 strain = simulation.walls().strain();
  frame.header = {frames_,
                  simulation.steps(),
                  simulation.time(),
                  {strain[0], strain[1], strain[2]},
                  simulation.time() - last_frame_time_,
                  simulation.walls().lower(),
                  simulation.walls().upper(),
                  spacing_,
                  simulation.setup().cell_size,
                  label_};
  const std::vector<Vec3> x = simulation.positions();
  const bool plastic = p.kappa.size() > 0;
  frame.id = p.id;
  frame.position.resize(p.count);
  frame.velocity.resize(p.count);
  frame.pressure.resize(p.count);
  frame.von_mises.resize(p.count);
  if (plastic) frame.kappa.resize(p.count), frame.dkappa.resize(p.count), last_kappa_.resize(p.count, 0.0f);
  const MaterialConstants material(simulation.setup().material);
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, p.count, 4096), [&](const auto& range) {
    std::vector<std::array<double, 6>> h(range.size()), eps(range.size());
    for (std::size_t i = range.begin(); i < range.end(); ++i)
      for (int e = 0; e < 6; ++e) h[i - range.begin()][e] = p.h[e][i];
    kernels().hencky(h, eps);
    for (std::size_t i = range.begin(); i < range.end(); ++i) {
      const auto& s = eps[i - range.begin()];
      const double trace = s[0] + s[1] + s[2];
      double dev = 0;
      for (int e = 0; e < 6; ++e) dev += (e < 3 ? 1 : 2) * std::pow(s[e] - (e < 3 ? trace / 3 : 0), 2);
      frame.pressure[i] = float(-material.bulk_modulus * trace);
      frame.von_mises[i] = float(std::sqrt(6.0 * dev) * material.mu);  // sqrt(3/2) |dev tau|
      for (int a = 0; a < 3; ++a) frame.position[i][a] = float(x[i][a]);
      for (int a = 0; a < 3; ++a) frame.velocity[i][a] = float(p.v[a][i]);
      if (plastic) {
        frame.kappa[i] = float(p.kappa[i]);
        frame.dkappa[i] = frame.kappa[i] - last_kappa_[p.id[i]];
        last_kappa_[p.id[i]] = frame.kappa[i];
      }
    }
  });
  return frame;
}

void RunFolder::write_frame(const Simulation& simulation) {
  Frame frame = take_frame(simulation);
  wait_for_frames();
  const std::filesystem::path folder = folder_ / "frames";
  std::filesystem::create_directories(folder);
  frame_being_written_ =
      std::async(std::launch::async, [frame = std::move(frame), folder, paraview = output_.paraview] {
        anticrack::write_frame(frame, folder);
        if (paraview) write_paraview_frame(frame, folder);
      });
  last_frame_time_ = simulation.time();
  ++frames_;
}

void RunFolder::wait_for_frames() {
  if (frame_being_written_.valid()) frame_being_written_.get();
}

void RunFolder::write_checkpoint(const Simulation& simulation, const Observer& observer,
                                 double wall_seconds) {
  wait_for_frames();
  CheckpointWriter out(scene_text_);
  simulation.save(out);
  out.add("observer", std::span(reinterpret_cast<const double*>(&observer.memory()),
                                sizeof(Observer::Memory) / sizeof(double)));
  out.add_value("wall_seconds", wall_seconds);
  out.add_value("frame.count", std::int32_t(frames_));
  out.add_value("frame.time", last_frame_time_);
  out.add("frame.kappa", std::span<const float>(last_kappa_));
  const std::filesystem::path folder = folder_ / checkpoint_folder;
  std::filesystem::create_directories(folder);
  history_->flush_to_disk();  // a resumed run drops rows after the checkpoint; those before must be there
  const std::filesystem::path file = checkpoint_file(folder, simulation.steps());
  out.write(file);
  keep_last_two_checkpoints(folder, file);
  last_checkpoint_ = simulation.steps();
}

std::optional<std::string> end_of_run(const std::filesystem::path& folder, const std::string& scene_text) {
  std::ifstream stream(folder / "result.json");
  const auto result = nlohmann::json::parse(stream, nullptr, false);
  if (!result.is_object() || !result.contains("stopped_by")) return {};
  const auto& end = result["stopped_by"];
  if (end != "until_strain" && end != "failure") return {};
  const std::string before = to_toml(read_scene(folder / "scene.toml"));
  if (const std::string difference = scene_difference(before, scene_text); !difference.empty())
    throw InputError(
        fmt::format("{}: the run in it has ended ({}), and is of another scene than the one given: {}. Use "
                    "--force to replace it, or another -o.",
                    folder.string(), end.get<std::string>(), difference));
  return end.get<std::string>();
}

CheckpointReader open_checkpoint(const std::filesystem::path& folder, const std::string& scene_text) {
  std::vector<std::string> damaged;
  CheckpointReader checkpoint(newest_valid_checkpoint(folder / checkpoint_folder, damaged));
  for (const std::string& problem : damaged)
    fmt::print(stderr, "anticrack: {}; going on from the checkpoint before it, {}\n", problem,
               checkpoint.file().filename().string());
  if (const std::string program = checkpoint.program(); program != program_version())
    throw InputError(fmt::format(
        "{}: written by anticrack {}, but this is anticrack {}, whose results may differ. Go on with {}.",
        checkpoint.file().string(), program, program_version(), program));
  if (const std::string difference = scene_difference(checkpoint.scene(), scene_text); !difference.empty())
    throw InputError(
        fmt::format("{} is of another scene than the one given: {}. Resume with the scene and the "
                    "--set of its first start.",
                    checkpoint.file().string(), difference));
  return checkpoint;
}

}  // namespace anticrack
