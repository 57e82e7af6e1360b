#include "precision_problems.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <chrono>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>

#include "exact_solutions.h"
#include "observables/angular_momentum.h"
#include "observables/observer.h"
#include "sample.h"
#include "simulation.h"
#include "time_step.h"

namespace anticrack {

namespace {

constexpr double unknown = std::numeric_limits<double>::quiet_NaN();

/// Table 1 of Blatny et al. (2021), elastic.
Material elastic_material(double poisson_ratio = 0.3) {
  return {1e4, {10e9, poisson_ratio}, {}};
}

/// Walls that stand still and are smooth.
TriaxialLoading slip_walls_at_rest() {
  return {0, 0, 0, WallKind::slip};
}

SimulationSetup make_setup(const Knobs& knobs, const Vec3& box, const Material& material,
                           const Loading& loading) {
  const double dx = 1.0 / knobs.cells, h = dx / knobs.per_direction;
  return {box, h * h * h, dx, material, loading, knobs.numerics};
}

/// Lattice points of the box for which `inside` holds, x fastest.
template <class Inside>
std::vector<Vec3> lattice_points(const Knobs& knobs, const Vec3& box, Inside inside) {
  const double h = 1.0 / (knobs.cells * knobs.per_direction);
  const auto n = [&](int a) { return int(std::lround(box[a] / h)); };
  std::vector<Vec3> points;
  for (int k = 0; k < n(2); ++k)
    for (int j = 0; j < n(1); ++j)
      for (int i = 0; i < n(0); ++i) {
        const Vec3 X = h * Vec3(i + 0.5, j + 0.5, k + 0.5);
        if (inside(X)) points.push_back(X);
      }
  return points;
}

bool everywhere(const Vec3&) {
  return true;
}

/// Steps until `end_time`, observing every `observe_every`-th (0: none), with `after` each; and what the
/// steps took without the body force, which other runs do not have.
template <class After>
Solution take_steps(Simulation& simulation, double end_time, int observe_every, After after) {
  using Clock = std::chrono::steady_clock;
  Solution solution;
  while (simulation.time() < end_time) {
    const auto start = Clock::now();
    simulation.step(observe_every > 0 && (simulation.steps() + 1) % observe_every == 0);
    solution.seconds += std::chrono::duration<double>(Clock::now() - start).count();
    after();
  }
  solution.seconds -= simulation.phase_seconds().body;
  solution.steps = simulation.steps();
  solution.particles = std::int64_t(simulation.particles().count);
  return solution;
}

/// Kirchhoff stress of every particle, storage order [Pa].
std::vector<SymmetricTensor> kirchhoff_stresses(const Simulation& simulation) {
  const Particles& p = simulation.particles();
  const HenckyElasticity& elasticity = simulation.setup().material.elasticity;
  std::vector<SymmetricTensor> h(p.count), tau(p.count);
  for (std::size_t i = 0; i < p.count; ++i)
    for (int e = 0; e < 6; ++e) h[i][e] = p.h[e][i];
  kernels().hencky(h, tau);
  for (SymmetricTensor& t : tau) {
    const double pressure = elasticity.lambda() * (t[0] + t[1] + t[2]);
    for (int e = 0; e < 6; ++e) t[e] = 2 * elasticity.mu() * t[e] + (e < 3 ? pressure : 0);
  }
  return tau;
}

double squared_norm(const SymmetricTensor& t) {
  double sum = 0;
  for (int e = 0; e < 6; ++e) sum += (e < 3 ? 1 : 2) * t[e] * t[e];
  return sum;
}

/// Sums of squares for a relative L2 error.
struct SquaredError {
  double error = 0, norm = 0;
  double relative() const { return std::sqrt(error / norm); }
};

/// Adds the stress of all particles; exact(i): of the i-th of the initial positions.
template <class Exact>
void add_stress(const Simulation& simulation, Exact exact, SquaredError& sum) {
  const std::vector<SymmetricTensor> tau = kirchhoff_stresses(simulation);
  for (std::size_t n = 0; n < tau.size(); ++n) {
    const SymmetricTensor should = exact(simulation.particles().id[n]);
    SymmetricTensor difference;
    for (int e = 0; e < 6; ++e) difference[e] = tau[n][e] - should[e];
    sum.error += squared_norm(difference), sum.norm += squared_norm(should);
  }
}

/// A motion that a body force enforces, from its start to its end. Errors over all particles and 24 times: a
/// single time may be one at which waves of error cancel.
template <class Motion>
Solution solve_motion(const Motion& motion, SimulationSetup setup, const std::vector<Vec3>& X) {
  setup.body_acceleration = [motion](const Vec3& x, double t) { return motion.body_acceleration(x, t); };
  // Velocities are half a step behind the positions.
  double max_speed = 0;
  for (const Vec3& place : X) max_speed = std::max(max_speed, motion.velocity(place, 0).norm());
  const double dt = adaptive_time_step(setup.numerics, setup.cell_size, setup.material, 0, max_speed);
  std::vector<Vec3> v;
  std::vector<Mat3> gradient;
  for (const Vec3& place : X) v.push_back(motion.velocity(place, -0.5 * dt));
  for (const Vec3& place : X) gradient.push_back(motion.velocity_gradient(place, -0.5 * dt));

  Simulation simulation(setup, X, v, gradient);
  SquaredError of_displacement, of_stress;
  int looks = 0;
  const auto look = [&] {
    const double t = simulation.time();
    if (t < (looks + 1) * motion.end_time() / 24) return;
    ++looks;
    const std::vector<Vec3> x = simulation.positions();
    for (std::size_t n = 0; n < x.size(); ++n) {
      const Vec3& start = X[simulation.particles().id[n]];
      const Vec3 u = motion.displacement(start, t);
      of_displacement.error += (x[n] - start - u).squaredNorm(), of_displacement.norm += u.squaredNorm();
    }
    add_stress(
        simulation, [&](std::uint32_t id) { return motion.kirchhoff_stress(X[id], t); }, of_stress);
  };
  Solution solution = take_steps(simulation, motion.end_time(), 0, look);
  solution.measures = {{"displacement", of_displacement.relative(), 0}, {"stress", of_stress.relative(), 0}};
  return solution;
}

Solution solve_wave(const Knobs& knobs, double amplitude) {
  const ManufacturedWave wave(elastic_material(), amplitude);
  const Vec3 box = Vec3::Ones();
  return solve_motion(wave, make_setup(knobs, box, elastic_material(), slip_walls_at_rest()),
                      lattice_points(knobs, box, everywhere));
}

Solution solve_vortex(const Knobs& knobs) {
  const double dx = 1.0 / knobs.cells;
  // A box that the annulus does not touch, four cells deep.
  const double side = dx * std::ceil((2 * GeneralizedVortex::outer_radius + 8 * dx) / dx);
  const Vec3 box(side, side, 4 * dx);
  const double period = std::sqrt(elastic_material().density / elastic_material().elasticity.young_modulus);
  const GeneralizedVortex vortex(elastic_material(), 0.1, period, 0.5 * box);
  return solve_motion(vortex, make_setup(knobs, box, elastic_material(), slip_walls_at_rest()),
                      lattice_points(knobs, box, [&](const Vec3& X) { return vortex.contains(X); }));
}

/// Elastic moduli of a sample in the unit cube under walls that go on evenly, every particle moving with them
/// from the start; by the observer's fit, over the solid's moduli.
Solution solve_moduli(const Knobs& knobs, const Material& material, TriaxialLoading loading,
                      const std::vector<Vec3>& X, bool shear, double exact_K) {
  const double end_time = knobs.transits / elastic_wave_speed(material);
  constexpr double strain = 1e-6;  // linear elasticity, far above rounding
  loading.strain_rate = strain / (6 * end_time);
  SimulationSetup setup = make_setup(knobs, Vec3::Ones(), material, loading);
  const Vec3 rates = 2 * loading.strain_rate *
                     Vec3(loading.beta2 + loading.beta1, loading.beta2 - loading.beta1, loading.beta2);
  std::vector<Vec3> v;
  for (const Vec3& place : X) v.push_back(rates.cwiseProduct(place - 0.5 * Vec3::Ones()));

  Simulation simulation(setup, X, v, std::vector<Mat3>(X.size(), rates.asDiagonal()));
  Observer observer(simulation);
  const int row_every = std::max(1, int(end_time / simulation.next_time_step() / 200));
  Solution solution = take_steps(simulation, end_time, row_every, [&] {
    if (simulation.steps() % row_every == 0) observer.record(simulation, 0);
  });
  const HenckyElasticity& solid = material.elasticity;
  solution.measures.push_back({"K", observer.bulk_modulus().value() / solid.bulk_modulus(), exact_K});
  if (shear) solution.measures.push_back({"G", observer.shear_modulus().value() / solid.mu(), exact_K});
  return solution;
}

constexpr TriaxialLoading isotropic_slip{0, -1, 0, WallKind::slip};

Solution solve_block(const Knobs& knobs, double poisson_ratio) {
  return solve_moduli(knobs, elastic_material(poisson_ratio), isotropic_slip,
                      lattice_points(knobs, Vec3::Ones(), everywhere), false, 1);
}

Solution solve_void(const Knobs& knobs, double fraction) {
  const double radius = std::cbrt(3 * fraction / (4 * std::numbers::pi));
  const auto solid = [&](const Vec3& X) { return (X - 0.5 * Vec3::Ones()).norm() > radius; };
  return solve_moduli(knobs, elastic_material(), isotropic_slip, lattice_points(knobs, Vec3::Ones(), solid),
                      false, void_array_bulk_modulus(fraction).value());
}

/// One field, cut at solid fraction 0.5 on every lattice.
Solution solve_porous(const Knobs& knobs) {
  SampleScene scene;
  const int points = knobs.cells * knobs.per_direction;
  scene.lattice = SampleLattice{{points, points, points}, 1.0 / points};
  scene.microstructure = GaussianRandomFieldSource{{2000, 4, 50, 1}, 0.5, ThresholdRule::exact};
  return solve_moduli(knobs, elastic_material(), {0.5, -1, 0, WallKind::sticky}, load_sample(scene).positions,
                      true, unknown);
}

/// A solid block compressed along y between smooth walls until its cohesion has decayed by 1 / e: a ray in
/// strain space, uniform in space; the cohesion is soft enough for the block to stay so. By PIC: FLIP would
/// remember that the particles at the walls know nothing of the first velocities of the nodes beyond, and
/// send waves of that.
Solution solve_softening(const Knobs& knobs) {
  Material material = elastic_material();
  material.plasticity = DruckerPragerSoftening{0.5, 2.5e6, 1500};
  constexpr double end_strain = 2e-3;
  const double end_time = knobs.transits / elastic_wave_speed(material);
  const double speed = 0.5 * end_strain / end_time;
  SimulationSetup setup = make_setup(knobs, Vec3::Ones(), material, ConfinedCompression{1, true, speed});
  setup.numerics.flip = 0;
  const std::vector<Vec3> X = lattice_points(knobs, Vec3::Ones(), everywhere);
  std::vector<Vec3> v;
  for (const Vec3& place : X) v.push_back({0, -2 * speed * (place[1] - 0.5), 0});

  Simulation simulation(setup, X, v);
  Solution solution = take_steps(simulation, end_time, 0, [] {});
  const RadialPath exact = radial_path(material, {0, std::log1p(simulation.walls().strain()[1]), 0});
  // tau = -p I + q sqrt(2/3) n, n the direction of the deviator.
  const double side = -exact.pressure + exact.q / 3, along = -exact.pressure - 2 * exact.q / 3;
  SquaredError of_stress;
  add_stress(
      simulation, [&](std::uint32_t) { return SymmetricTensor{side, along, side, 0, 0, 0}; }, of_stress);
  double of_kappa = 0;
  for (std::size_t n = 0; n < X.size(); ++n)
    of_kappa += std::pow(simulation.particles().kappa[n] / exact.kappa - 1, 2) / double(X.size());
  solution.measures = {{"stress", of_stress.relative(), 0}, {"kappa", std::sqrt(of_kappa), 0}};
  return solution;
}

constexpr double ball_radius = 0.35;  // [m]
constexpr double rim_speed = 0.05;    // over the wave speed

/// A ball that spins freely through one turn.
Solution solve_spin(const Knobs& knobs) {
  const Vec3 box = 3 * Vec3::Ones(), centre = 1.47 * Vec3::Ones();
  SimulationSetup setup = make_setup(knobs, box, elastic_material(), slip_walls_at_rest());
  const auto X = lattice_points(knobs, box, [&](const Vec3& X) { return (X - centre).norm() < ball_radius; });
  const double speed = rim_speed * elastic_wave_speed(setup.material) / ball_radius;
  const Vec3 omega = speed * Vec3(1, 2, 3).normalized(), axis_point = centre_of_mass(X);
  Mat3 gradient;
  for (int a = 0; a < 3; ++a) gradient.col(a) = omega.cross(Vec3::Unit(a));
  std::vector<Vec3> v;
  for (const Vec3& place : X) v.push_back(gradient * (place - axis_point));

  Simulation simulation(setup, X, v, std::vector<Mat3>(X.size(), gradient));
  const Vec3 before = angular_momentum(simulation);
  const double energy = simulation.kinetic_energy();
  Solution solution = take_steps(simulation, 2 * std::numbers::pi / speed, 0, [] {});
  solution.measures = {
      {"angular_momentum", (angular_momentum(simulation) - before).norm() / before.norm(), 0},
      {"kinetic_energy", simulation.kinetic_energy() / energy - 1, 0}};
  return solution;
}

struct Problem {
  const char* name;
  std::function<Solution(const Knobs&)> solve;
  /// What sets the cost: cubic metres of solid, seconds times the wave speed, nanoseconds a particle-step,
  /// roughly.
  double volume, duration, nanoseconds;
  bool quasi_static;
};

const std::vector<Problem>& problems() {
  const auto with_void = [](double fraction) {
    return [fraction](const Knobs& knobs) { return solve_void(knobs, fraction); };
  };
  static const std::vector<Problem> all = {
      {"wave", [](const Knobs& knobs) { return solve_wave(knobs, 5e-4); }, 1, 1.5, 500, false},
      {"large_wave", [](const Knobs& knobs) { return solve_wave(knobs, 0.05); }, 1, 1.5, 900, false},
      {"vortex", solve_vortex, 0.5, 1.16, 600, false},
      {"block", [](const Knobs& knobs) { return solve_block(knobs, 0.3); }, 1, 1, 90, true},
      {"stiff_block", [](const Knobs& knobs) { return solve_block(knobs, 0.49); }, 1, 1, 90, true},
      {"void_0.05", with_void(0.05), 0.95, 1, 90, true},
      {"void_0.1", with_void(0.1), 0.9, 1, 90, true},
      {"void_0.2", with_void(0.2), 0.8, 1, 90, true},
      {"void_0.3", with_void(0.3), 0.7, 1, 90, true},
      {"void_0.4", with_void(0.4), 0.6, 1, 90, true},
      {"void_0.5", with_void(0.5), 0.5, 1, 90, true},
      {"porous", solve_porous, 0.5, 1, 90, true},
      {"softening", solve_softening, 1, 1, 90, true},
      {"spin", solve_spin, 0.18, 2 * std::numbers::pi * ball_radius / rim_speed, 90, false},
  };
  return all;
}

const Problem& problem_named(const std::string& name) {
  std::vector<std::string> names;
  for (const Problem& problem : problems()) {
    if (problem.name == name) return problem;
    names.push_back(problem.name);
  }
  throw InputError(fmt::format("no problem {}; expected one of {}.", name, fmt::join(names, ", ")));
}

/// Adds the cases of a problem.
struct CaseList {
  std::string problem;
  bool quick;
  std::vector<PrecisionCase>& cases;

  void add(
      const std::string& variant, const std::vector<int>& cells,
      const std::function<void(Knobs&)>& turn = [](Knobs&) {}) {
    for (const int n : cells) {
      if (quick && n > 16) continue;
      Knobs knobs;
      knobs.cells = n;
      turn(knobs);
      cases.push_back({problem, variant, knobs});
    }
  }

  void add_transfers(const std::vector<int>& cells) {
    add("PIC", cells, [](Knobs& k) { k.numerics.flip = 0; });
    add("FLIP 1", cells, [](Knobs& k) { k.numerics.flip = 1; });
    const double transit = 1 / elastic_wave_speed(elastic_material());
    add("APIC", cells, [](Knobs& k) { k.numerics.transfer = TransferScheme::apic; });
    add("FLIP by time", cells, [&](Knobs& k) { k.numerics.flip_time = transit; });
  }
  void add_particles(const std::vector<int>& cells) {
    for (const int n : {3, 4})
      add(fmt::format("{} particles a direction", n), cells, [n](Knobs& k) { k.per_direction = n; });
  }
  void add_time_steps(const std::vector<int>& cells) {
    add("half the time step", cells, [](Knobs& k) { k.numerics.time_step_factor = 0.5; });
    add("the paper's time step", cells, [](Knobs& k) { k.numerics.time_step = TimeStepRule::paper; });
  }
  void add_wall_rule(const std::vector<int>& cells) {
    add("the paper's walls", cells, [](Knobs& k) { k.numerics.wall_rule = WallRule::paper; });
  }
  void add_transits(const std::vector<int>& cells, const std::vector<double>& transits) {
    for (const double t : transits) add("loading time", cells, [t](Knobs& k) { k.transits = t; });
  }
};

}  // namespace

std::string PrecisionCase::name() const {
  std::string text = fmt::format("{}, {} cells", problem, knobs.cells);
  if (!variant.empty()) text += ", " + variant;
  if (problem_named(problem).quasi_static) text += fmt::format(", {:g} transits", knobs.transits);
  const auto& offset = knobs.numerics.grid_offset;
  if (offset[0] != 0) text += fmt::format(", walls {:g} of a cell off", offset[0]);
  return text;
}

Solution solve(const PrecisionCase& c) {
  return problem_named(c.problem).solve(c.knobs);
}

double expected_seconds(const PrecisionCase& c) {
  const Problem& problem = problem_named(c.problem);
  const double cells = c.knobs.cells, per_cell = std::pow(c.knobs.per_direction, 3);
  const double volume = c.problem == "vortex" ? std::numbers::pi * 4 / cells : problem.volume;
  const double duration = problem.duration * (problem.quasi_static ? c.knobs.transits : 1);
  const double steps = duration * cells / (0.42 * c.knobs.numerics.time_step_factor);
  return 1e-9 * problem.nanoseconds * volume * std::pow(cells, 3) * per_cell * steps;
}

std::vector<PrecisionCase> precision_cases(bool quick) {
  std::vector<PrecisionCase> cases;
  for (const char* wave : {"wave", "large_wave"}) {
    CaseList list{wave, quick, cases};
    list.add("", {8, 12, 16, 24, 32});
    list.add_particles({8, 12, 16, 24});
    list.add_transfers({8, 16, 24});
    list.add_time_steps({8, 16, 24});
    list.add_wall_rule({8, 16, 24});
  }
  CaseList vortex{"vortex", quick, cases};
  vortex.add("", {8, 12, 16, 24, 32, 48});
  vortex.add_particles({8, 12, 16, 32});
  vortex.add_transfers({8, 16, 32});
  vortex.add_time_steps({8, 16, 32});

  CaseList block{"block", quick, cases};
  for (const double offset : {0.0, 0.25, 0.5, 0.75}) {
    const auto shift = [offset](Knobs& k) { k.numerics.grid_offset = {offset, offset, offset}; };
    block.add("", {8, 16}, shift);
    block.add("the paper's walls", {8, 16}, [&](Knobs& k) {
      shift(k);
      k.numerics.wall_rule = WallRule::paper;
    });
  }

  CaseList stiff{"stiff_block", quick, cases};
  stiff.add("", {8, 16});
  stiff.add_time_steps({8, 16});

  CaseList one_void{"void_0.3", quick, cases};
  one_void.add("", {12, 16, 24, 32, 48});
  one_void.add_particles({8, 12, 16});
  one_void.add_transfers({12, 24});
  one_void.add_time_steps({12, 24});
  one_void.add_wall_rule({12, 24});
  one_void.add_transits({16}, {2, 4, 12, 24});
  for (const char* other : {"void_0.05", "void_0.1", "void_0.2", "void_0.4", "void_0.5"})
    CaseList{other, quick, cases}.add("", {16, 48});

  CaseList porous{"porous", quick, cases};
  porous.add("", {8, 12, 16, 24, 32, 48});
  porous.add_particles({8, 12, 16});
  porous.add_transfers({12, 24});
  porous.add_time_steps({12, 24});
  porous.add_wall_rule({12, 24});
  porous.add_transits({16}, {2, 4, 12, 24});

  CaseList softening{"softening", quick, cases};
  for (const ReturnMapping mapping : {ReturnMapping::implicit, ReturnMapping::paper})
    for (const double transits : {1, 2, 4, 8, 16})
      softening.add(mapping == ReturnMapping::paper ? "the paper's return mapping" : "", {8}, [&](Knobs& k) {
        k.transits = transits;
        k.numerics.return_mapping = mapping;
      });

  CaseList spin{"spin", quick, cases};
  spin.add("", {8, 16});
  spin.add_transfers({8, 16});
  return cases;
}

}  // namespace anticrack
