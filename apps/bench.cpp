#include "bench.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "bench_cases.h"
#include "common_options.h"
#include "errors.h"
#include "files/atomic_file.h"
#include "kernels.h"
#include "machine_limits.h"
#include "observables/observer.h"
#include "output_folder.h"
#include "reference_step.h"
#include "sample.h"
#include "scene.h"
#include "simulation.h"
#if ANTICRACK_RENDER
#include "plot.h"
#endif

namespace anticrack {

namespace {

/// Lane operations of a particle-step, a fused multiply-add counted once.
constexpr double lane_operations = 940;

struct BenchOptions : CommonOptions {
  std::string scene, curves, simd;
  int rounds = 5, steps = 40;
  double most_particles = 1e7;
  bool json = false, options = false;
};

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
    const bool row_due = history_every > 0 && (simulation.steps() + 1) % history_every == 0;
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
                         .apic = scene.numerics.transfer == TransferScheme::apic,
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

/// A case's figures over its rounds.
struct CaseResult {
  std::string series;
  double value, particles;
  Spread rate;
  double bytes_per_particle, bytes, yielded, strays;    ///< the last two: shares of the particles a step
  std::array<double, std::size(phases)> phase_seconds;  ///< a particle-step, median
};

/// Times cases round by round in turn, all in memory together, or one after the other; after three steps to
/// warm up.
std::vector<CaseResult> time_cases(const std::vector<BenchCaseMaker>& makers, bool alternate,
                                   const BenchOptions& options, int threads) {
  struct Running {
    BenchCase bench_case;
    std::unique_ptr<Simulation> simulation;
    std::unique_ptr<Observer> observer;
    Timing timing;
    double yielded = 0, strays = 0;
  };
  const auto start = [&](const BenchCaseMaker& make) {
    Running r{make(), nullptr, nullptr, {threads, {}, {}}};
    r.simulation =
        std::make_unique<Simulation>(r.bench_case.setup, r.bench_case.positions, r.bench_case.velocities);
    r.bench_case.positions = {};
    r.bench_case.velocities = {};
    r.observer = std::make_unique<Observer>(*r.simulation);
    Timing warm_up{threads, {}, {}};
    run_round(*r.simulation, *r.observer, 3, r.bench_case.history_every, warm_up);
    return r;
  };
  const auto round = [&](Running& r) {
    run_round(*r.simulation, *r.observer, options.steps, r.bench_case.history_every, r.timing);
    const double n = double(r.simulation->particles().count);
    r.yielded = r.simulation->observed().yielded / n;
    r.strays = double(r.simulation->stray_count()) / n;
  };
  const auto result = [&](const Running& r) {
    const double n = double(r.simulation->particles().count);
    std::array<double, std::size(phases)> phase_seconds;
    for (std::size_t i = 0; i < std::size(phases); ++i)
      phase_seconds[i] = spread_of(r.timing.phase_seconds[i]).median / n;
    fmt::print(stderr, "{} {:.4g}: {:.2f} M particle-steps/s\n", r.bench_case.series, r.bench_case.value,
               1e-6 * r.timing.rate(n).median);
    return CaseResult{r.bench_case.series,
                      r.bench_case.value,
                      n,
                      r.timing.rate(n),
                      double(r.simulation->particles().bytes_per_particle()),
                      double(r.simulation->bytes()),
                      r.yielded,
                      r.strays,
                      phase_seconds};
  };
  std::vector<CaseResult> results;
  if (alternate) {
    std::vector<Running> all;
    for (const auto& make : makers) all.push_back(start(make));
    for (int n = 0; n < options.rounds; ++n)
      for (Running& r : all) round(r);
    for (const Running& r : all) results.push_back(result(r));
  } else {
    for (const auto& make : makers) {
      Running r = start(make);
      for (int n = 0; n < options.rounds; ++n) round(r);
      results.push_back(result(r));
    }
  }
  return results;
}

void bench_options(const BenchOptions& options) {
  const int threads = thread_count(options);
  const ThreadLimit limit(threads);
  fmt::print("{:<56}{:>6}{:>8}{:>18}\n", "", "ns", "bytes", "against the first");
  const auto results = time_cases(option_cases(), true, options, threads);
  for (const CaseResult& r : results)
    fmt::print("{:<56}{:>6.1f}{:>8.0f}{:>18.2f}\n", r.series, 1e9 / r.rate.median, r.bytes_per_particle,
               results.front().rate.median / r.rate.median);
  fmt::print("ns a particle-step with {} threads, median of {} rounds in turn; bytes of state a particle\n",
             threads, options.rounds);
}

/// Curves as throughput.csv and, where the build can draw, one picture a series.
void bench_curves(const BenchOptions& options) {
  namespace fs = std::filesystem;
  const int threads = thread_count(options);
  const ThreadLimit limit(threads);
  const fs::path folder = options.curves;
  const FolderLock lock = prepare_output_folder(folder, ExistingFolder::refuse);
  const auto results = time_cases(curve_cases(options.most_particles), false, options, threads);
  std::string csv = "series,value,particles,rate_low,rate_median,rate_high,gibibytes,yielded,strays";
  for (const auto& [name, member] : phases) csv += fmt::format(",{}_ns", name);
  csv += '\n';
  std::map<std::string, std::vector<CaseResult>> series;
  for (const CaseResult& r : results) {
    csv += fmt::format("{},{:.6g},{:.0f},{:.6g},{:.6g},{:.6g},{:.4g},{:.4g},{:.4g}", r.series, r.value,
                       r.particles, r.rate.low, r.rate.median, r.rate.high, r.bytes / (1 << 30), r.yielded,
                       r.strays);
    for (const double seconds : r.phase_seconds) csv += fmt::format(",{:.4g}", 1e9 * seconds);
    csv += '\n';
    series[r.series].push_back(r);
  }
  write_text_atomically(folder / "throughput.csv", csv);
  for (const auto& [name, points] : series) {
    const auto [low, high] =
        std::minmax_element(points.begin(), points.end(),
                            [](const auto& a, const auto& b) { return a.rate.median < b.rate.median; });
    fmt::print("{:<18} {:6.2f} to {:6.2f} M particle-steps/s, ratio {:.2f}\n", name, 1e-6 * low->rate.median,
               1e-6 * high->rate.median, high->rate.median / low->rate.median);
#if ANTICRACK_RENDER
    Plot plot{name == "particles" ? "log_{10} particles" : name, "M particle-steps/s", {}};
    plot.y_from_zero = true;
    Curve median{"median", {}, {}}, best{"best round", {}, {}};
    for (const CaseResult& r : points) {
      const double x = name == "particles" ? std::log10(r.value) : r.value;
      median.x.push_back(x);
      median.y.push_back(1e-6 * r.rate.median);
      best.x.push_back(x);
      best.y.push_back(1e-6 * r.rate.high);
    }
    plot.curves = {median, best};
    std::string file = name;
    std::replace(file.begin(), file.end(), ' ', '_');
    write_text_atomically(folder / (file + ".png"), draw_plot(plot, DocumentFormat::png));
#endif
  }
  fmt::print("{} and a picture a series: {}\n", (folder / "throughput.csv").string(), folder.string());
}

void bench(const BenchOptions& options) {
  if (options.scene.empty() && !options.set.empty())
    throw InputError("bench: --set overrides the keys of a scene file; expected SCENE.");
  const Scene scene = options.scene.empty() ? paper_scene() : read_scene(options.scene, options.set);
  const int threads = thread_count(options);
  const ThreadLimit limit(threads);
  const Sample sample = load_sample(scene);
  Simulation simulation(setup_of(scene, sample.lattice), sample.positions);
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
  const auto share = [&](double r) { return r * lane_operations / limits.multiply_adds_per_second; };
  report["share_of_compute_bound"] = share(rate.median);
  report["share_of_compute_bound_best_round"] = share(rate.high);
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
      "share of the compute bound ({} lane operations a particle-step): {:.1f} %, best round {:.1f} %\n"
      "plain step of the tests, 1 thread: {:.0f} ns a particle-step, {:.0f} times the engine's on 1 thread\n",
      threads, 1e-9 * limits.multiply_adds_per_second, 1e-9 * limits.bytes_per_second, lane_operations,
      100 * share(rate.median), 100 * share(rate.high), 1e9 * plain,
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
  command
      ->add_option("--simd", options->simd,
                   fmt::format("Instruction set to measure instead of the best: {}",
                               fmt::join(available_simd(), ", ")))
      ->type_name("NAME");
  add_set_option(*command, *options);
  add_threads_option(*command, *options);
  auto* table =
      command->add_flag("--options", options->options,
                        "Table of what each part of a step costs: PIC only, APIC, elastic only, ...");
  command
      ->add_option("--curves", options->curves,
                   "Curves of throughput against particles, solid fraction, crowding, yielding, strays: "
                   "throughput.csv and pictures in this new folder")
      ->type_name("DIR")
      ->excludes(table);
  command->add_option("--most-particles", options->most_particles, "Largest case of --curves, up to 5e7")
      ->check(CLI::Range(1e5, 5e7))
      ->capture_default_str();
  command->footer(
      "Examples:\n"
      "  anticrack bench\n"
      "  anticrack bench assets/scenes/quickstart.toml --threads 2 --json\n"
      "  anticrack bench --options\n"
      "  anticrack bench --curves out/throughput --most-particles 5e7 --steps 10 --rounds 3");
  command->callback([options] {
    const bool own_scenes = options->options || !options->curves.empty();
    if (own_scenes && (!options->scene.empty() || !options->set.empty() || options->json))
      throw InputError(
          "bench: --options and --curves have scenes and reports of their own; expected neither SCENE, "
          "--set nor --json.");
    use_simd(options->simd);
    if (options->options) return bench_options(*options);
    if (!options->curves.empty()) return bench_curves(*options);
    bench(*options);
  });
  return command;
}

}  // namespace anticrack
