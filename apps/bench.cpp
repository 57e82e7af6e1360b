#include "bench.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "common_options.h"
#include "errors.h"
#include "kernels.h"
#include "machine_limits.h"
#include "observables/observer.h"
#include "reference_step.h"
#include "sample.h"
#include "scene.h"
#include "simulation.h"

namespace anticrack {

namespace {

/// Lane operations of a particle-step, a fused multiply-add counted once.
constexpr double lane_operations = 940;

struct BenchOptions : CommonOptions {
  std::string scene;
  int rounds = 5, steps = 40;
  bool json = false;
};

/// 131^3 lattice, solid fraction 0.44, six sticky walls, Table 1 of Blatny et al. (2021).
Scene paper_scene() {
  Scene scene;
  scene.lattice = SampleLattice{{131, 131, 131}, 1.0 / 131};
  scene.microstructure = GaussianRandomFieldSource{{10000, 9, 50, 1}, 0.44};
  scene.material = {1e4, {10e9, 0.3}, DruckerPragerSoftening{1.2, 2.5e6, 1e6}};
  scene.loading = TriaxialLoading{0, -1, 5e-4, WallKind::sticky};
  return scene;
}

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

struct Spread {
  double low, median, high;
};

Spread spread_of(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  const std::size_t n = values.size();
  return {values.front(), 0.5 * (values[(n - 1) / 2] + values[n / 2]), values.back()};
}

/// Phases in the order of a step; the names are those of the JSON report.
constexpr std::pair<const char*, double PhaseSeconds::*> phases[] = {
    {"grid", &PhaseSeconds::grid}, {"walls", &PhaseSeconds::walls},   {"sort", &PhaseSeconds::sort},
    {"pass", &PhaseSeconds::pass}, {"strays", &PhaseSeconds::strays},
};

/// What one number of threads took, a value a round.
struct Timing {
  int threads;
  std::vector<double> seconds;                           ///< of a step
  std::vector<double> phase_seconds[std::size(phases)];  ///< of a step

  Spread rate(double particles) const {
    std::vector<double> rates;
    for (const double s : seconds) rates.push_back(particles / s);
    return spread_of(rates);
  }
};

/// One round as a run does it: steps, a row of history every `history_every`.
void run_round(Simulation& simulation, Observer& observer, int steps, int history_every, Timing& timing) {
  const ThreadLimit limit(timing.threads);
  const PhaseSeconds before = simulation.phase_seconds();
  const auto start = std::chrono::steady_clock::now();
  for (int n = 0; n < steps; ++n) {
    const bool row_due = (simulation.steps() + 1) % history_every == 0;
    simulation.step(row_due);
    if (row_due) observer.record(simulation, 0);
  }
  timing.seconds.push_back(seconds_since(start) / steps);
  for (std::size_t i = 0; i < std::size(phases); ++i) {
    const auto member = phases[i].second;
    timing.phase_seconds[i].push_back((simulation.phase_seconds().*member - before.*member) / steps);
  }
}

/// Seconds a particle-step of the plain step (one thread), on as many of the particles as take about a
/// second.
double plain_step_seconds(const Scene& scene, const Sample& sample, double dt) {
  constexpr std::size_t most = 20000;
  reference::Model model{.material = scene.material,
                         .dx = 2 * sample.lattice.spacing,
                         .mass = scene.material.density * sample.particle_volume,
                         .volume = sample.particle_volume,
                         .flip = scene.numerics.flip,
                         .walls = {},
                         .particles = {},
                         .grid = {}};
  for (std::size_t i = 0; i < std::min(most, sample.positions.size()); ++i) {
    model.particles.emplace_back();
    model.particles.back().x = sample.positions[i];
  }
  std::vector<double> seconds;
  for (int n = 0; n < 3; ++n) {
    const auto start = std::chrono::steady_clock::now();
    model.step(dt);
    seconds.push_back(seconds_since(start) / double(model.particles.size()));
  }
  return spread_of(seconds).median;
}

void bench(const BenchOptions& options) {
  if (options.scene.empty() && !options.set.empty())
    throw InputError("bench: --set overrides the keys of a scene file; expected SCENE.");
  const Scene scene = options.scene.empty() ? paper_scene() : read_scene(options.scene, options.set);
  const int threads = thread_count(options);
  const ThreadLimit limit(threads);
  const Sample sample = load_sample(scene);
  Simulation simulation({sample.lattice.size(), sample.particle_volume, 2 * sample.lattice.spacing,
                         scene.material, scene.loading, scene.numerics},
                        sample.positions);
  Observer observer(simulation);
  const double particles = double(simulation.particles().count);

  std::vector<Timing> timings;
  for (const int t : {1, threads})
    if (timings.empty() || t != 1) timings.push_back({t, {}, {}});
  Timing warm_up{threads, {}, {}};
  run_round(simulation, observer, options.steps, scene.output.history_every, warm_up);
  for (int round = 0; round < options.rounds; ++round)
    for (Timing& timing : timings)
      run_round(simulation, observer, options.steps, scene.output.history_every, timing);
  const MachineLimits limits = measure_machine_limits();
  const double plain = plain_step_seconds(scene, sample, simulation.dt());

  const Timing& all = timings.back();
  const Spread rate = all.rate(particles);
  const double bytes = double(simulation.bytes()) / particles;
  nlohmann::ordered_json report;
  report["particles"] = simulation.particles().count;
  report["leaves"] = simulation.grid().leaves().size();
  report["threads"] = threads;
  report["simd"] = kernels().simd;
  report["precision"] = "double";
  report["particle_steps_per_second"] = rate.median;
  report["seconds_per_step"] = particles / rate.median;
  report["bytes_per_particle"] = simulation.particles().bytes_per_particle();
  report["bytes_per_particle_with_grid"] = bytes;
  for (const Timing& timing : timings) {
    const Spread s = timing.rate(particles);
    nlohmann::ordered_json entry{
        {"threads", timing.threads}, {"low", s.low}, {"median", s.median}, {"high", s.high}};
    for (std::size_t i = 0; i < std::size(phases); ++i)
      entry["phases"][phases[i].first] = spread_of(timing.phase_seconds[i]).median;
    report["rounds"].push_back(entry);
  }
  report["phases"] = report["rounds"].back()["phases"];
  report["multiply_adds_per_second"] = limits.multiply_adds_per_second;
  report["bytes_per_second"] = limits.bytes_per_second;
  report["share_of_compute_bound"] = rate.median * lane_operations / limits.multiply_adds_per_second;
  report["plain_step_seconds_per_particle"] = plain;
  if (options.json) {
    fmt::print("{}\n", report.dump(2));
    return;
  }
  fmt::print("{:.0f} particles, {} leaves, {} bytes a particle ({:.0f} with grid), {}, double precision\n",
             particles, simulation.grid().leaves().size(), simulation.particles().bytes_per_particle(), bytes,
             kernels().simd);
  for (const Timing& timing : timings) {
    const Spread s = timing.rate(particles);
    fmt::print("\n{} thread{}: {:.2f} M particle-steps/s (from {:.2f} to {:.2f} in {} rounds of {} steps)\n",
               timing.threads, timing.threads > 1 ? "s" : "", 1e-6 * s.median, 1e-6 * s.low, 1e-6 * s.high,
               options.rounds, options.steps);
    for (std::size_t i = 0; i < std::size(phases); ++i)
      fmt::print("  {:<8}{:8.2f} ns a particle-step\n", phases[i].first,
                 1e9 * spread_of(timing.phase_seconds[i]).median / particles);
  }
  fmt::print(
      "\nthis machine, {} threads: {:.1f} G multiply-adds/s, {:.1f} GB/s\n"
      "share of the compute bound ({} lane operations a particle-step): {:.1f} %\n"
      "plain step of the tests, 1 thread: {:.0f} ns a particle-step, {:.0f} times the engine's on 1 thread\n",
      threads, 1e-9 * limits.multiply_adds_per_second, 1e-9 * limits.bytes_per_second, lane_operations,
      100 * rate.median * lane_operations / limits.multiply_adds_per_second, 1e9 * plain,
      plain * timings.front().rate(particles).median);
}

}  // namespace

CLI::App* add_bench_command(CLI::App& app) {
  CLI::App* command = app.add_subcommand("bench", "Measure particle-steps per second on this machine");
  auto options = std::make_shared<BenchOptions>();
  command
      ->add_option("scene", options->scene,
                   "Scene file; by default 131^3 lattice points at solid fraction 0.44 between six walls")
      ->type_name("SCENE");
  command->add_option("--rounds", options->rounds, "Rounds, one thread and all threads in turn")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  command->add_option("--steps", options->steps, "Steps a round")
      ->check(CLI::Range(1, 100000))
      ->capture_default_str();
  command->add_flag("--json", options->json, "Report as JSON on stdout");
  add_set_option(*command, *options);
  add_threads_option(*command, *options);
  command->callback([options] { bench(*options); });
  return command;
}

}  // namespace anticrack
