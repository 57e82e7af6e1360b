#include "simulation.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <sstream>
#include <utility>

#include "errors.h"
#include "inversion.h"
#include "setup_check.h"
#include "time_step.h"

namespace anticrack {

namespace {

class LapTimer {
 public:
  /// Seconds since the last call, or since construction.
  double lap() {
    const auto now = std::chrono::steady_clock::now();
    const std::chrono::duration<double> seconds = now - std::exchange(last_, now);
    return seconds.count();
  }

 private:
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
};

/// The setup with nodes counted from the lowest cell of the sample, so that a sample shifted by whole cells
/// takes the same steps to the last bit.
SimulationSetup anchored(SimulationSetup setup, std::span<const Vec3> positions) {
  for (int a = 0; a < 3; ++a) {
    double& offset = setup.numerics.grid_offset[a];
    double lowest = std::numeric_limits<double>::infinity();
    for (const Vec3& x : positions)
      lowest = std::min(lowest, std::floor(x[a] / setup.cell_size - offset - 0.5));
    if (std::abs(lowest) < 2e9) offset += lowest;  // else place_particles says what is wrong
  }
  return setup;
}

constexpr int max_halvings = 20;  ///< of a time step that would turn a particle inside out

}  // namespace

Simulation::Simulation(const SimulationSetup& setup)
    : setup_(checked(setup)),
      kind_(pass_kind(setup.material, setup.numerics)),
      mass_(setup.material.density * setup.particle_volume),
      walls_(setup.loading, setup.numerics.wall_rule, setup.box_size, setup.cell_size,
             Vec3(setup.numerics.grid_offset.data()), elastic_wave_speed(setup.material)) {}

Simulation::Simulation(const SimulationSetup& setup, std::span<const Vec3> positions,
                       std::span<const Vec3> velocities, std::span<const Mat3> gradients)
    : Simulation(anchored(setup, positions)) {
  const auto check_count = [&](std::size_t count, const char* what) {
    if (count != 0 && count != positions.size())
      throw InputError(std::to_string(count) + " " + what + " for " + std::to_string(positions.size()) +
                       " particles");
  };
  check_count(velocities.size(), "velocities");
  check_count(gradients.size(), "velocity gradients");
  const ParticleFields fields = particle_fields(setup.material, setup.numerics);
  place_particles(positions, setup.cell_size, Vec3(setup_.numerics.grid_offset.data()), fields, particles_,
                  grid_, cells_);
  if (!velocities.empty())
    for (std::size_t i = 0; i < particles_.count; ++i)
      for (int a = 0; a < 3; ++a) particles_.v[a][i] = velocities[particles_.id[i]][a];
  if (!gradients.empty() && fields.affine)
    for (std::size_t i = 0; i < particles_.count; ++i)
      for (int e = 0; e < 9; ++e)
        particles_.affine[e][i] = setup.cell_size * gradients[particles_.id[i]](e / 3, e % 3);
  scatter_particles({});
}

void Simulation::step(bool observe) {
  check_walls();
  StepConstants c = constants(next_time_step());  // line 1
  if (!(time_ + c.dt > time_)) fail_to_advance(c.dt);
  const double kinetic_before = kinetic_energy();
  LapTimer timer;
  if (setup_.body_acceleration)
    add_body_force(setup_.body_acceleration, time_, mass_, setup_.cell_size,
                   Vec3(setup_.numerics.grid_offset.data()), particles_, strays_, cells_, grid_);
  phase_seconds_.body += timer.lap();
  LeafUpdate grid;
  WallAction action;
  for (int halvings = 0;; ++halvings) {
    grid = update_grid_velocity(c.dt);  // lines 2, 3, 5
    phase_seconds_.grid += timer.lap();
    action = walls_.apply(grid_, time_);  // line 6
    phase_seconds_.walls += timer.lap();
    const auto inverted =
        inverted_particle(c.dt, std::max(std::sqrt(grid.max_speed_squared), action.max_speed));
    if (!inverted) break;
    if (halvings == max_halvings)
      fail(*inverted,
           "after " + std::to_string(max_halvings) + " halvings of the time step det(I + dt grad v)");
    c = constants(0.5 * c.dt);  // nothing has moved yet, and the sums over particles are still there
  }
  const double dt = c.dt;
  sort_if_due();
  phase_seconds_.sort += timer.lap();
  pass_over_blocks(c, kernels().advance_block, observe);  // lines 7-13, and 2-4 of the next step
  phase_seconds_.pass += timer.lap();
  advance_and_scatter_strays(c, observe);  // the same for those away from home
  phase_seconds_.strays += timer.lap();
  walls_.move(time_, dt);

  // Energy lost by particle -> grid, by grid -> particle and at the walls, each measured where it happens.
  ledger_.numerical_dissipation += (kinetic_before - grid.kinetic_before) +
                                   (grid.kinetic_after + action.kinetic_change - kinetic_energy()) +
                                   action.impact_loss;
  // Sum of dt f . v over the nodes is their change of kinetic energy less the walls' work, but for losses: of
  // all nodes what the walls took in impacts, of free ones m |dv|^2 / 2, which is of second order.
  ledger_.stress_work_before = std::exchange(
      ledger_.stress_work,
      action.work - action.impact_loss - (grid.kinetic_after + action.kinetic_change - grid.kinetic_before));
  ledger_.plastic_dissipation += setup_.particle_volume * sums_.plastic_dissipation;
  // A wall on its ramp meets the sample half-way between its velocities before and after.
  const double speeding_up = walls_.ramp(time_) - walls_.ramp(std::max(0.0, time_ - dt));
  ledger_.wall_work += action.work - 0.5 * speeding_up * action.generalized_impulse;
  ledger_.generalized_impulse += action.generalized_impulse;
  for (int w = 0; w < 6; ++w) ledger_.wall_impulse[w] += action.normal_impulse[w];
  for (int a = 0; a < 3; ++a) ledger_.wall_virial[a] += action.virial[a];
  dt_ = dt;
  time_ += dt;
  ++step_;
}

double Simulation::next_time_step() const {
  const double max_speed =
      std::max(std::sqrt(sums_.max_speed_squared), walls_.ramp(time_) * walls_.max_speed());
  return adaptive_time_step(setup_.numerics, setup_.cell_size, setup_.material, sums_.max_compression,
                            max_speed);
}

double Simulation::flip_of_step(double dt) const {
  return setup_.numerics.flip_time ? std::exp(-dt / *setup_.numerics.flip_time) : setup_.numerics.flip;
}

StepConstants Simulation::constants(double dt) const {
  return {dt,
          setup_.cell_size,
          flip_of_step(dt),
          mass_,
          setup_.particle_volume,
          MaterialConstants(setup_.material),
          kernels().full_width};
}

LeafUpdate Simulation::update_grid_velocity(double dt) {
  std::vector<LeafUpdate> updates(grid_.leaves().size());
  const auto view = [&](std::size_t l) {
    const SparseGrid::Leaf& leaf = grid_.leaves()[l];
    return LeafView{leaf.partials(), leaf.nodes};
  };
  tbb::parallel_for(std::size_t(0), updates.size(), [&](std::size_t l) {
    updates[l] = kernels().update_leaf(dt, view(l), view(std::min(l + 1, updates.size() - 1)));
    grid_.set_occupied(l, updates[l].occupied);
  });
  LeafUpdate sum;
  for (const LeafUpdate& u : updates) {
    sum.kinetic_before += u.kinetic_before;
    sum.kinetic_after += u.kinetic_after;
    sum.max_speed_squared = std::max(sum.max_speed_squared, u.max_speed_squared);
  }
  return sum;
}

std::optional<std::uint32_t> Simulation::inverted_particle(double dt, double max_nodal_speed) const {
  const double dt_over_dx = dt / setup_.cell_size;
  if (!may_invert(dt_over_dx * max_nodal_speed)) return {};
  return find_inverted_particle(particles_, grid_, cells_, strays_, dt_over_dx);
}

BlockView Simulation::block_view(std::size_t b) const {
  const SparseGrid::Block& block = grid_.blocks()[b];
  BlockView view{{}, {}, cells_[b].data()};
  for (int o = 0; o < 8; ++o) view.leaf[o] = block.nodes[o];
  for (int o = 0; o < 8; ++o) view.partial[o] = block.partial[o];
  return view;
}

/// Asks for the sums to come meanwhile: a store waits for the line that it writes to.
static void clear(std::span<Node* const> partials) {
  for (std::size_t i = 0; i < partials.size(); ++i) {
    const Node* const ahead = partials[std::min(i + 2, partials.size() - 1)];
    for (int n = 0; n < block_cells; ++n) {
      __builtin_prefetch(ahead + n, 1);
      partials[i][n] = Node{};
    }
  }
}

void Simulation::pass_over_blocks(const StepConstants& c, BlockKernel kernel, bool observe) {
  results_.resize(cells_.size());
  tbb::parallel_for(std::size_t(0), grid_.groups().size(), [&](std::size_t g) {
    const SparseGrid::Group& group = grid_.groups()[g];
    clear(group.partials);
    BlockView next = block_view(group.first_block);
    for (std::uint32_t b = group.first_block; b < group.last_block; ++b) {
      const std::uint32_t after = std::min(b + 1, group.last_block - 1);
      const BlockView block = std::exchange(next, block_view(after));
      __builtin_prefetch(&results_[after], 1);
      results_[b] = {};
      kernel(kind_, c, ParticlePointers(particles_), block, next, observe, results_[b]);
    }
  });
  for (const BlockResult& result : results_)
    if (result.failure) fail(result.failure->particle, result.failure->quantity);
}

void Simulation::advance_and_scatter_strays(const StepConstants& c, bool observe) {
  sums_ = advance_strays(c);
  for (const BlockResult& result : results_) sums_.add(result.sums);
  collect_strays(results_);
  scatter_strays(c, observe);
}

void Simulation::scatter_particles(std::span<const std::uint32_t> returned_strays) {
  const StepConstants c = constants(0);
  // A stray that came home in the last step was scattered among the strays; keep it there.
  std::vector<double> place;
  for (const std::uint32_t i : returned_strays) place.push_back(std::exchange(particles_.s[0][i], 2.0));
  pass_over_blocks(c, kernels().scatter_block, true);
  for (std::size_t n = 0; n < place.size(); ++n) particles_.s[0][returned_strays[n]] = place[n];
  sums_ = {};
  for (const BlockResult& result : results_) sums_.add(result.sums);
  collect_strays(results_);
  scatter_strays(c, true);
}

void Simulation::collect_strays(std::span<const BlockResult> results) {
  if (const auto bad = locate_strays(results, particles_, grid_, cells_, strays_)) fail(*bad, "position");
  sort_debt_ += double(strays_.size());
}

ParticleSums Simulation::advance_strays(const StepConstants& c) {
  constexpr std::size_t share = 400;
  const ParticlePointers pointers(particles_);
  const std::span<const Stray> strays(strays_);
  std::vector<BlockResult> results((strays.size() + share - 1) / share);
  tbb::parallel_for(std::size_t(0), results.size(), [&](std::size_t n) {
    const std::size_t first = n * share, count = std::min(share, strays.size() - first);
    kernels().advance_strays(kind_, c, pointers, grid_, strays.subspan(first, count), results[n]);
  });
  ParticleSums sums;
  for (const BlockResult& result : results) {
    if (result.failure) fail(result.failure->particle, result.failure->quantity);
    sums.add(result.sums);
  }
  return sums;
}

void Simulation::scatter_strays(const StepConstants& c, bool observe) {
  if (strays_.empty()) return;
  // One task a group, its strays in the order of `strays_`: no two tasks write the same sums, and the order
  // is always the same.
  const ParticlePointers pointers(particles_);
  std::vector<ParticleSums> sums(grid_.groups().size());
  tbb::parallel_for(std::size_t(0), sums.size(), [&](std::size_t g) {
    const auto of_block = [&](std::uint32_t block) {
      return std::ranges::lower_bound(strays_, block, {}, &Stray::block);
    };
    const SparseGrid::Group& group = grid_.groups()[g];
    const std::span<const Stray> strays(of_block(group.first_block), of_block(group.last_block));
    if (!strays.empty()) kernels().scatter_strays(kind_, c, pointers, grid_, strays, observe, sums[g]);
  });
  for (const ParticleSums& s : sums) sums_.add(s);
}

void Simulation::sort_if_due() {
  // A sort costs 13 ns a particle, a stray 200 ns a step, more where few are (one thread, Zen 5): sort when
  // the strays since the last one have cost as much as it does. The tiles have just been summed, so blocks
  // may change now.
  if (strays_.empty() || 15 * sort_debt_ < double(particles_.count)) return;
  sort_particles(strays_, particles_, grid_, cells_);
  sort_debt_ = 0;
}

std::size_t Simulation::bytes() const {
  return particles_.count * (particles_.bytes_per_particle()) + grid_.bytes() +
         cells_.size() * sizeof(CellRanges);
}

std::vector<Vec3> Simulation::positions() const {
  return world_positions(particles_, grid_, cells_, setup_.cell_size,
                         Vec3(setup_.numerics.grid_offset.data()));
}

void Simulation::check_walls() const {
  const Vec3 gap = (walls_.upper() - walls_.lower()) / setup_.cell_size;
  for (int a = 0; a < 3; ++a)
    if (!(gap[a] >= 3)) {
      std::ostringstream message;
      message << "step " << step_ + 1 << ", t = " << time_ << " s: the walls along "
              << "xyz"[a] << " have come within " << gap[a]
              << " cells of each other; expected at least 3, so that they do not act on the same nodes";
      throw NumericalError(message.str());
    }
}

void Simulation::fail_to_advance(double dt) const {
  std::ostringstream message;
  message << "step " << step_ + 1 << ", t = " << time_ << " s: a time step of " << dt
          << " s does not advance the time; the fastest particle moves at "
          << std::sqrt(sums_.max_speed_squared) << " m/s, the largest compression is "
          << sums_.max_compression << " Pa";
  throw NumericalError(message.str());
}

void Simulation::fail(std::uint32_t particle, const std::string& quantity) const {
  std::ostringstream message;
  message.precision(10);
  message << "step " << step_ + 1 << ", t = " << time_ << " s: " << quantity << " of particle "
          << particles_.id[particle] << " is not finite or not positive";
  throw NumericalError(message.str());
}

}  // namespace anticrack
