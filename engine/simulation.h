#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "activation.h"
#include "body_force.h"
#include "io/checkpoint.h"
#include "kernels.h"
#include "numerics.h"
#include "particles.h"
#include "sparse_grid.h"
#include "walls/walls.h"

namespace anticrack {

/// A sample and what happens to it.
struct SimulationSetup {
  Vec3 box_size;           ///< [m]; the sample box is [0, box_size]
  double particle_volume;  ///< V0 of every particle [m^3]
  double cell_size;        ///< dx [m]
  Material material;
  Loading loading;
  Numerics numerics;
  BodyAcceleration body_acceleration = {};  ///< none by default; its work is in no ledger
};

/// What accumulates over a run. All energies in J.
struct Ledger {
  double plastic_dissipation = 0;
  double numerical_dissipation =
      0;                 ///< lost by the transfers between particles and grid and in impacts on the walls
  double wall_work = 0;  ///< done by the walls
  std::array<double, 6> wall_impulse{};  ///< along +axis [N s]
  double generalized_impulse = 0;        ///< see WallAction
  std::array<double, 3> wall_virial{};   ///< see WallAction [N s m]
  double stress_work = 0;         ///< what the stresses took from the motion of the grid in the last step ...
  double stress_work_before = 0;  ///< ... and in the one before
};

/// Wall seconds of the parts of a step, summed over the steps since construction.
struct PhaseSeconds {
  double grid = 0;    ///< leaves sum tiles and update velocities (lines 2, 3, 5)
  double walls = 0;   ///< line 6
  double body = 0;    ///< body force, where there is one
  double sort = 0;    ///< particles into their cells, blocks and leaves into being
  double pass = 0;    ///< particles at home: lines 7-13, and 2-4 of the next step
  double strays = 0;  ///< the same for strays, and finding them
};

/// The explicit elastoplastic material point method, Algorithm 1 of Blatny et al. (2021).
///
/// One pass over the particles a step: it ends step n (lines 7-13) and scatters for step n + 1 (lines 2-4),
/// which does not need the time step. Results do not depend on the number of threads.
class Simulation {
 public:
  /// @param positions   [m], one per particle, inside the box
  /// @param velocities  [m/s], one per particle; empty: at rest
  /// @param gradients   of the velocity [1/s], one per particle; empty: zero. Only APIC's particles hold them
  /// @throws InputError
  Simulation(const SimulationSetup& setup, std::span<const Vec3> positions,
             std::span<const Vec3> velocities = {}, std::span<const Mat3> gradients = {});

  /// Continues from a checkpoint of the same setup, with the same bits. @throws FileError
  Simulation(const SimulationSetup& setup, CheckpointReader& checkpoint);

  /// Notes the whole state; the arrays are read when the writer writes.
  void save(CheckpointWriter& checkpoint) const;

  /// One time step, halved at most 20 times if it would turn a particle inside out, det(I + dt grad v) <= 0.
  /// With `observe` the sums of `observed()` are those of the new state.
  /// @throws NumericalError  naming step, time, particle and quantity
  void step(bool observe);

  std::int64_t steps() const { return step_; }
  double time() const { return time_; }  ///< [s]
  double dt() const { return dt_; }      ///< of the last step [s]
  double next_time_step() const;         ///< [s]
  const ParticleSums& observed() const { return sums_; }
  const PhaseSeconds& phase_seconds() const { return phase_seconds_; }
  const Ledger& ledger() const { return ledger_; }
  double kinetic_energy() const { return 0.5 * mass_ * sums_.speed_squared; }  ///< of the particles [J]
  const Walls& walls() const { return walls_; }
  const SparseGrid& grid() const { return grid_; }
  const Particles& particles() const { return particles_; }
  const std::vector<CellRanges>& cells() const { return cells_; }
  const SimulationSetup& setup() const {
    return setup_;
  }                                               ///< its grid_offset counts from the sample's lowest cell
  double particle_mass() const { return mass_; }  ///< [kg]
  std::size_t stray_count() const { return strays_.size(); }
  std::size_t bytes() const;
  std::vector<Vec3> positions() const;  ///< [m], storage order

 private:
  explicit Simulation(const SimulationSetup& setup);
  double flip_of_step(double dt) const;
  StepConstants constants(double dt) const;
  LeafUpdate update_grid_velocity(double dt);
  std::optional<std::uint32_t> inverted_particle(double dt, double max_nodal_speed) const;
  void sort_if_due();
  using BlockKernel = decltype(Kernels::advance_block);
  BlockView block_view(std::size_t block) const;
  void pass_over_blocks(const StepConstants& c, BlockKernel kernel, bool observe);
  void advance_and_scatter_strays(const StepConstants& c, bool observe);
  void scatter_particles(std::span<const std::uint32_t> returned_strays);
  void collect_strays(std::span<const BlockResult> results);
  void scatter_strays(const StepConstants& c, bool observe);
  ParticleSums advance_strays(const StepConstants& c);
  void check_walls() const;
  [[noreturn]] void fail_to_advance(double dt) const;
  [[noreturn]] void fail(std::uint32_t particle, const std::string& quantity) const;

  SimulationSetup setup_;
  PassKind kind_;
  double mass_;
  Particles particles_;
  SparseGrid grid_;
  std::vector<CellRanges> cells_;
  std::vector<Stray> strays_;
  std::vector<BlockResult> results_;
  Walls walls_;
  ParticleSums sums_;
  Ledger ledger_;
  PhaseSeconds phase_seconds_;
  std::int64_t step_ = 0;
  double time_ = 0, dt_ = 0;
  double sort_debt_ = 0;  ///< strays handled since the last sort
};

}  // namespace anticrack
