#include "loading_cases.h"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "bench_cases.h"
#include "observables/observer.h"
#include "sample.h"
#include "time_step.h"

namespace anticrack {

namespace {

constexpr double paper_strain_rate = 5e-4;  ///< Table 1 [1/s]

struct StudySample {
  const char* name;
  int resolution, wavelengths;
  double solid_fraction;
  std::uint64_t seed;
  double young_modulus;
  int slowest, fastest;
  bool all_loadings;  ///< else isotropic compression only
};

// A sixteen times softer solid fails at sixteen times the strain, and its waves are four times slower: the
// same number of passages at four times the rate. Fine and large samples are expensive, and begin later.
constexpr StudySample samples[] = {
    {"phi 0.5, seed 1", 33, 4, 0.5, 1, 10e9, 1, 128, true},
    {"phi 0.5, seed 2", 33, 4, 0.5, 2, 10e9, 1, 128, true},
    {"phi 0.34", 33, 4, 0.34, 1, 10e9, 1, 128, true},
    {"E / 16", 33, 4, 0.5, 1, 10e9 / 16, 4, 512, false},
    {"fine", 65, 4, 0.5, 1, 10e9, 8, 128, false},
    {"large", 65, 8, 0.5, 1, 10e9, 8, 128, false},
};

Scene study_scene(const StudySample& sample) {
  Scene scene = paper_scene(sample.solid_fraction);
  const int n = sample.resolution;
  scene.lattice = SampleLattice{{n, n, n}, 1.0 / n};
  auto& source = std::get<GaussianRandomFieldSource>(scene.microstructure);
  source.field.wavelengths_per_side = sample.wavelengths;
  source.field.seed = sample.seed;
  source.threshold_rule = ThresholdRule::exact;
  scene.material.elasticity.young_modulus = sample.young_modulus;
  return scene;
}

/// Walls at a multiple of the paper's rate: each moves at rate times side.
Loading loading_at(const std::string& name, int rate) {
  const double strain_rate = paper_strain_rate * rate;
  if (name == "confined") return ConfinedCompression{1, true, strain_rate * 1.0};
  return TriaxialLoading{name == "shear" ? 1.0 : 0.0, name == "shear" ? 0.0 : -1.0, strain_rate,
                         WallKind::sticky};
}

}  // namespace

std::vector<LoadingSeries> loading_series() {
  std::vector<LoadingSeries> series;
  for (const StudySample& sample : samples)
    for (const char* loading : {"isotropic", "confined", "shear"}) {
      if (!sample.all_loadings && loading != std::string("isotropic")) continue;
      series.push_back({sample.name, loading, study_scene(sample), sample.slowest, sample.fastest});
    }
  return series;
}

LoadingCase run_loading_case(const LoadingSeries& series, int rate) {
  Scene scene = series.scene;
  scene.loading = loading_at(series.loading, rate);
  const Sample sample = load_sample(scene);
  const auto start = std::chrono::steady_clock::now();
  Simulation simulation(setup_of(scene, sample.lattice), sample.positions);
  Observer observer(simulation);
  const bool shear = series.loading == "shear";
  const double yield_strain = scene.material.plasticity->cohesion /
                              scene.material.elasticity.young_modulus;  // of the solid, its scale

  LoadingCase result{};
  std::optional<FailurePoint> failure;
  double peak_force = 0;
  // Few rows where failure is many steps away, eight steps each where it is near.
  const int history_every = rate <= 4 ? 40 : 8;
  while (true) {
    const bool row_due = (simulation.steps() + 1) % history_every == 0;
    simulation.step(row_due);
    if (!row_due) continue;
    const HistoryRow row = observer.record(simulation, 0);
    const double force = observer.memory().force;
    if (!failure && observer.failure()) {
      failure = observer.failure();
      const QuasiStatic certificate = observer.quasi_static();
      result.passages = certificate.wave_passages;
      result.kinetic_over_internal = certificate.kinetic_over_internal;
      result.wall_over_volume = certificate.wall_over_volume_stress;
      result.energy_residual = certificate.energy_residual;
    }
    if (observer.memory().peak_time == 0) continue;  // walls have just started
    if (force > peak_force) {
      peak_force = force;
      result.peak_stress = shear ? row.q : row.p;
      result.peak_strain = Observer::loading_strain(simulation);
    }
    const double most_strain = failure ? 2 * failure->strain : 10 * yield_strain;
    if ((failure && force < 0.8 * peak_force) || Observer::loading_strain(simulation) > most_strain) break;
  }
  result.sample = series.sample, result.loading = series.loading, result.rate = rate;
  result.strain_rate = paper_strain_rate * rate;
  result.wall_speed =
      result.strain_rate * simulation.setup().box_size[1] / elastic_wave_speed(scene.material);
  result.modulus = (shear ? observer.shear_modulus() : observer.bulk_modulus()).value_or(std::nan(""));
  result.stress = !failure ? std::nan("") : shear ? failure->q : failure->p;
  result.strain = failure ? failure->strain : std::nan("");
  result.steps = double(simulation.steps());
  result.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return result;
}

}  // namespace anticrack
