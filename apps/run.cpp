#include "run.h"

#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <fstream>
#include <memory>
#include <string>

#include "common_options.h"
#include "errors.h"
#include "exit_codes.h"
#include "loading_advice.h"
#include "observables/observer.h"
#include "output_folder.h"
#include "run_folder.h"
#include "sample.h"
#include "scene.h"
#include "stop_signal.h"
#include "time_step.h"

namespace anticrack {

namespace {

struct RunOptions : CommonOptions {
  std::string scene, output;
  bool force = false, resume = false, dry_run = false, save_grid = false;
  std::int64_t max_steps = 0;       ///< 0: no limit
  double max_walltime_minutes = 0;  ///< 0: no limit
};

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// Memory that a new process can have without swapping [bytes]; 0 if the system does not tell.
std::size_t available_memory() {
  std::ifstream meminfo("/proc/meminfo");
  std::string key, rest;
  std::size_t kibibytes = 0;
  while (meminfo >> key >> kibibytes && std::getline(meminfo, rest))
    if (key == "MemAvailable:") return kibibytes * 1024;
  return 0;
}

std::optional<double> until_strain(const Scene& scene) {
  const auto* until = std::get_if<UntilStrain>(&scene.until);
  return until ? std::optional(until->strain) : std::nullopt;
}

/// Strain between frames. A run to failure does not know its end: it counts in hundredths of a percent, the
/// scale on which a brittle solid fails.
double frame_interval(const Scene& scene) {
  constexpr double failure_scale = 4e-3;
  return until_strain(scene).value_or(failure_scale) / std::max(1, scene.output.frames);
}

std::string loading_name(const Loading& loading) {
  return std::holds_alternative<TriaxialLoading>(loading) ? "triaxial" : "confined_compression";
}

std::string wall_name(const Loading& loading) {
  const auto* triaxial = std::get_if<TriaxialLoading>(&loading);
  if (!triaxial) return "slip";
  switch (triaxial->walls) {
    case WallKind::sticky:
      return "sticky";
    case WallKind::slip:
      return "slip";
    case WallKind::affine:
      return "affine";
    case WallKind::paper:
      return "paper";
  }
  return {};
}

std::string transfer_name(const Numerics& numerics) {
  if (numerics.transfer == TransferScheme::apic) return "APIC";
  if (numerics.flip_time) return fmt::format("PIC-FLIP (flip_time = {} s)", *numerics.flip_time);
  if (numerics.flip == 0) return "PIC (velocity increments left out)";
  return fmt::format("PIC-FLIP (flip = {})", numerics.flip);
}

std::string describe(const Scene& scene, const Sample& sample, const MemoryEstimate& memory) {
  const bool plastic = scene.material.plasticity.has_value();
  return fmt::format(
      "{} particles, solid fraction {:.4f}{}; {} blocks, {} leaves, {:.2f} GiB; dx = {:.5g} m; kernels {}; "
      "active: "
      "Hencky elasticity, {}, {}; {} bytes a particle",
      memory.particles, sample.solid_fraction,
      sample.solid_fraction_asked ? fmt::format(" (asked {})", *sample.solid_fraction_asked) : "",
      memory.blocks, memory.leaves, double(memory.bytes) / (1 << 30), 2 * sample.lattice.spacing,
      kernels().simd,
      plastic ? "softening Drucker-Prager" : "no plasticity (kappa and return mapping left out)",
      transfer_name(scene.numerics),
      Particles::bytes_per_particle(particle_fields(scene.material, scene.numerics)));
}

/// Particles, leaves, memory, steps and expected time, from a few real steps.
void print_plan(const Scene& scene, const Sample& sample, const MemoryEstimate& memory) {
  const SimulationSetup setup = setup_of(scene, sample.lattice);
  Simulation simulation(setup, sample.positions);
  simulation.step(false);
  const auto start = std::chrono::steady_clock::now();
  constexpr int trial_steps = 5;
  for (int n = 0; n < trial_steps; ++n) simulation.step(false);
  const double seconds = seconds_since(start) / trial_steps;
  fmt::print("{}\n", describe(scene, sample, memory));
  fmt::print("active leaves now: {}, {:.2f} GiB in use\n", simulation.grid().leaves().size(),
             double(simulation.bytes()) / (1 << 30));
  fmt::print("time step {:.4g} s, {:.3g} s a step, {:.3g} M particle-steps/s\n", simulation.dt(), seconds,
             1e-6 * double(sample.positions.size()) / seconds);
  const bool fails = scene.material.plasticity && scene.material.plasticity->cohesion > 0;
  const double strain =
      until_strain(scene).value_or(fails ? expected_failure_strain(scene.material, scene.loading) : 1e-3);
  const double steps = strain / (strain_rate(setup) * simulation.dt());
  fmt::print("{} {:.3g}: about {:.3g} steps, {} (the time step shrinks under compression)\n",
             until_strain(scene) ? "to strain" : "to failure, if that is at strain", strain, steps,
             duration_text(steps * seconds));
  fmt::print("{}", loading_advice(setup, strain, steps * seconds));
}

/// One run from its first or resumed state to its end.
class Run {
 public:
  Run(const Scene& scene, const Sample& sample, const RunOptions& options)
      : scene_(scene),
        sample_(sample),
        options_(options),
        progress_(options.progress()),
        threads_(thread_count(options)) {}

  void start() {
    // First what may refuse the scene: an earlier run must not be lost to a mistake.
    simulation_.emplace(setup_of(scene_, sample_.lattice), sample_.positions);
    observer_.emplace(*simulation_);
    lock_.emplace(prepare_output_folder(options_.output,
                                        options_.force ? ExistingFolder::replace : ExistingFolder::refuse));
    if (options_.force) remove_run(options_.output);
    folder_.emplace(options_.output, scene_, sample_.lattice.spacing, threads_);
    if (scene_.output.frames > 0) folder_->write_frame(*simulation_);
  }

  void resume() {
    lock_.emplace(prepare_output_folder(options_.output, ExistingFolder::resume));
    CheckpointReader checkpoint = open_checkpoint(options_.output, to_toml(scene_));
    simulation_.emplace(setup_of(scene_, sample_.lattice), checkpoint);
    observer_.emplace(*simulation_);
    Observer::Memory memory;
    checkpoint.read<double>("observer",
                            std::span(reinterpret_cast<double*>(&memory), sizeof(memory) / sizeof(double)));
    observer_->restore(memory);
    seconds_before_ = checkpoint.read_value<double>("wall_seconds");
    folder_.emplace(options_.output, scene_, sample_.lattice.spacing, threads_, checkpoint);
    progress_.message(fmt::format("resumed after step {}", simulation_->steps()));
  }

  void to_end() {
    first_step_ = simulation_->steps();
    const double dx_strain = frame_interval(scene_);
    auto last_checkpoint = std::chrono::steady_clock::now();
    try {
      while (true) {
        const std::string reason = stop_reason();
        if (!reason.empty()) return finish(reason);
        const bool row_due = (simulation_->steps() + 1) % scene_.output.history_every == 0;
        simulation_->step(row_due);
        if (row_due) folder_->append(observer_->record(*simulation_, wall_seconds()));
        if (scene_.output.frames > 0 &&
            Observer::loading_strain(*simulation_) >= folder_->frames() * dx_strain)
          folder_->write_frame(*simulation_);
        if (seconds_since(last_checkpoint) > 60 * scene_.output.checkpoint_minutes) {
          folder_->write_checkpoint(*simulation_, *observer_, wall_seconds());
          last_checkpoint = std::chrono::steady_clock::now();
        }
        progress_.update(progress());
      }
    } catch (const NumericalError& error) {
      throw NumericalError(
          folder_->last_checkpoint() < 0
              ? fmt::format("{}; no checkpoint yet.", error.what())
              : fmt::format("{}; last checkpoint: step {}.", error.what(), folder_->last_checkpoint()));
    }
  }

 private:
  double wall_seconds() const { return seconds_before_ + seconds_since(start_); }

  double rate() const {
    return double(simulation_->particles().count) * double(simulation_->steps() - first_step_) /
           seconds_since(start_);
  }

  ProgressState progress() const {
    const double strain = Observer::loading_strain(*simulation_);
    // Nobody knows when it will fail; the guess is good to a factor of two.
    const double failure = expected_failure_strain(scene_.material, scene_.loading);
    const double by_strain = until_strain(scene_) ? strain / *until_strain(scene_)
                             : failure > 0        ? std::min(0.95, strain / failure)
                                                  : 0;
    const double by_steps =
        options_.max_steps ? double(simulation_->steps()) / double(options_.max_steps) : 0;
    return {std::min(1.0, std::max(by_strain, by_steps)), simulation_->steps(), strain, rate()};
  }

  std::string stop_reason() const {
    if (const auto strain = until_strain(scene_); strain && Observer::loading_strain(*simulation_) >= *strain)
      return "until_strain";
    if (std::holds_alternative<UntilFailure>(scene_.until) && observer_->failure()) return "failure";
    if (options_.max_steps && simulation_->steps() >= options_.max_steps) return "max_steps";
    if (signals_.requested()) return "signal";
    if (options_.max_walltime_minutes > 0 && seconds_since(start_) > 60 * options_.max_walltime_minutes)
      return "max_walltime";
    return {};
  }

  void finish(const std::string& reason) {
    const bool stopped = reason == "signal" || reason == "max_walltime";
    if (stopped || reason == "max_steps") folder_->write_checkpoint(*simulation_, *observer_, wall_seconds());
    if (stopped) {
      progress_.finish(progress(), fmt::format("stopped after step {}", simulation_->steps()));
      throw Stopped(fmt::format(
          "stopped by {} after step {}, t = {:.6g} s; a checkpoint is written in {}. Go on with the "
          "same command and --resume.",
          reason, simulation_->steps(), simulation_->time(), options_.output));
    }
    folder_->wait_for_frames();
    RunResult result;
    result.loading = loading_name(scene_.loading);
    result.walls = wall_name(scene_.loading);
    result.wall_rule = scene_.numerics.wall_rule == WallRule::ghost ? "ghost" : "paper";
    result.stopped_by = reason;
    result.K = observer_->bulk_modulus();
    result.G = observer_->shear_modulus();
    result.failure = observer_->failure();
    result.particles = simulation_->particles().count;
    result.steps = simulation_->steps();
    result.wall_seconds = wall_seconds();
    result.particle_steps_per_second = double(result.particles) * double(result.steps) / result.wall_seconds;
    result.solid_fraction_achieved = sample_.solid_fraction;
    result.solid_fraction_asked = sample_.solid_fraction_asked;
    result.quasi_static = observer_->quasi_static();
    if (options_.save_grid)
      simulation_->grid().write_vdb(folder_->path() / "grid.vdb", simulation_->setup().cell_size,
                                    Vec3(simulation_->setup().numerics.grid_offset.data()));
    write_run_result(result, folder_->path() / "result.json");
    progress_.finish(
        progress(),
        fmt::format("{}: {} steps, {} leaves, {:.2f} GiB, {}; {}", folder_->path().string(), result.steps,
                    simulation_->grid().leaves().size(), double(simulation_->bytes()) / (1 << 30),
                    duration_text(result.wall_seconds), result.quasi_static.verdict));
  }

  const Scene& scene_;
  const Sample& sample_;
  const RunOptions& options_;
  Progress progress_;
  StopOnSignal signals_;
  int threads_;
  std::optional<FolderLock> lock_;
  std::optional<Simulation> simulation_;
  std::optional<Observer> observer_;
  std::optional<RunFolder> folder_;
  double seconds_before_ = 0;
  std::int64_t first_step_ = 0;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

void run(const RunOptions& options) {
  const Scene scene = read_scene(options.scene, options.set);
  if (!options.dry_run)
    check_output_folder(options.output, options.resume  ? ExistingFolder::resume
                                        : options.force ? ExistingFolder::replace
                                                        : ExistingFolder::refuse);
  if (options.resume)
    if (const auto end = end_of_run(options.output, to_toml(scene))) {
      Progress(options.progress())
          .message(fmt::format("{}: the run has ended ({}); nothing is left to do", options.output, *end));
      return;
    }
  const ThreadLimit limit(thread_count(options));
  const Sample sample = load_sample(scene);
  const MemoryEstimate memory =
      estimate_memory(sample.positions, 2 * sample.lattice.spacing, Vec3(scene.numerics.grid_offset.data()),
                      particle_fields(scene.material, scene.numerics));
  if (const std::size_t available = available_memory(); available && memory.bytes > available)
    throw InputError(fmt::format(
        "{}: {} particles need {:.2f} GiB; expected at most the {:.2f} GiB available. Use a smaller "
        "sample.resolution.",
        options.scene, memory.particles, double(memory.bytes) / (1 << 30), double(available) / (1 << 30)));
  if (options.dry_run) return print_plan(scene, sample, memory);
  if (!options.quiet && !options.log_json) fmt::print(stderr, "{}\n", describe(scene, sample, memory));
  Run run(scene, sample, options);
  if (options.resume)
    run.resume();
  else
    run.start();
  run.to_end();
}

}  // namespace

CLI::App* add_run_command(CLI::App& app) {
  CLI::App* command = app.add_subcommand("run", "Simulate a scene with the material point method");
  auto options = std::make_shared<RunOptions>();
  command->add_option("scene", options->scene, "Scene file (TOML)")->required()->type_name("SCENE");
  auto* output = command->add_option("-o,--output", options->output, "Run folder to write")->type_name("DIR");
  auto* dry = command->add_flag("--dry-run", options->dry_run,
                                "Print particles, leaves, memory, steps and time; write nothing");
  command->add_flag("--force", options->force, "Replace an earlier run in the folder")->excludes(dry);
  command->add_flag("--resume", options->resume, "Go on from the folder's last checkpoint")
      ->excludes("--force")
      ->excludes(dry);
  command->add_flag("--save-grid", options->save_grid,
                    "Save the background grid of the last step as VDB grids in DIR/grid.vdb");
  command->add_option("--max-steps", options->max_steps, "Stop after so many steps in all")
      ->check(positive_number());
  command
      ->add_option("--max-walltime", options->max_walltime_minutes,
                   "Stop with a checkpoint after so many minutes (exit 75)")
      ->check(positive_number())
      ->type_name("MINUTES");
  add_set_option(*command, *options);
  add_threads_option(*command, *options);
  add_progress_options(*command, *options);
  command->footer(
      "Examples:\n"
      "  anticrack run assets/scenes/quickstart.toml --dry-run\n"
      "  anticrack run assets/scenes/quickstart.toml -o out/run --threads 2\n"
      "  anticrack run assets/scenes/quickstart.toml -o out/run --resume");
  command->callback([options, output] {
    if (!options->dry_run && output->empty())
      throw InputError("run: -o DIR is missing; expected the folder to write, or --dry-run.");
    run(*options);
  });
  return command;
}

}  // namespace anticrack
