#include <string>

#include "errors.h"
#include "simulation.h"

namespace anticrack {

namespace {

/// The arrays of doubles of a simulation by name, those of `fields` included.
template <class Particles, class Visit>
void for_each_array(Particles& particles, ParticleFields fields, Visit visit) {
  constexpr const char* axis[3] = {"x", "y", "z"};
  constexpr const char* component[6] = {"xx", "yy", "zz", "xy", "xz", "yz"};
  for (int a = 0; a < 3; ++a) visit(std::string("particle.s.") + axis[a], particles.s[a]);
  for (int a = 0; a < 3; ++a) visit(std::string("particle.v.") + axis[a], particles.v[a]);
  for (int e = 0; e < 6; ++e) visit(std::string("particle.h.") + component[e], particles.h[e]);
  if (fields.kappa) visit("particle.kappa", particles.kappa);
  if (fields.affine)
    for (int e = 0; e < 9; ++e)
      visit(std::string("particle.affine.") + axis[e / 3] + axis[e % 3], particles.affine[e]);
}

SimulationSetup anchored(SimulationSetup setup, CheckpointReader& in) {
  in.read<double>("grid_offset", setup.numerics.grid_offset);
  return setup;
}

}  // namespace

void Simulation::save(CheckpointWriter& out) const {
  static_assert(sizeof(Ledger) % sizeof(double) == 0);
  out.add_value("step", step_);
  out.add_value("time", time_);
  out.add_value("dt", dt_);
  out.add_value("sort_debt", sort_debt_);
  out.add_copy<double>("walls", walls_.positions());
  out.add_copy<double>("grid_offset", setup_.numerics.grid_offset);
  out.add("ledger", std::span(reinterpret_cast<const double*>(&ledger_), sizeof(Ledger) / sizeof(double)));
  const ParticleFields fields = particle_fields(setup_.material, setup_.numerics);
  for_each_array(particles_, fields, [&](const std::string& name, const AlignedArray& array) {
    out.add(name, std::span(array.data(), array.size()));
  });
  out.add("particle.id", std::span<const std::uint32_t>(particles_.id));
  // What is active as it came, what only strays reach included, so that every sum keeps its order.
  std::vector<std::int32_t> origins;
  std::vector<std::uint8_t> leaves;
  for (const BlockReach& reach : grid_.reach()) {
    origins.insert(origins.end(), reach.origin.begin(), reach.origin.end());
    leaves.push_back(reach.leaves);
  }
  out.add_copy<std::int32_t>("reach.block", origins);
  out.add_copy<std::uint8_t>("reach.leaves", leaves);
  out.add("block.cells", std::span<const std::uint32_t>(cells_.data()->data(),
                                                        cells_.size() * std::tuple_size_v<CellRanges>));
  std::vector<std::uint32_t> returned;
  for (const Stray& stray : strays_)
    if (stray.shift == Index3{}) returned.push_back(stray.particle);
  out.add_copy<std::uint32_t>("returned_strays", returned);
}

Simulation::Simulation(const SimulationSetup& setup, CheckpointReader& in) : Simulation(anchored(setup, in)) {
  step_ = in.read_value<std::int64_t>("step");
  time_ = in.read_value<double>("time");
  dt_ = in.read_value<double>("dt");
  std::array<double, 6> walls;
  in.read<double>("walls", walls);
  walls_.set_positions(walls);
  in.read<double>("ledger", std::span(reinterpret_cast<double*>(&ledger_), sizeof(Ledger) / sizeof(double)));

  particles_.id = in.read<std::uint32_t>("particle.id");
  particles_.count = particles_.id.size();
  const ParticleFields fields = particle_fields(setup.material, setup.numerics);
  for_each_array(particles_, fields, [&](const std::string& name, AlignedArray& array) {
    array = AlignedArray(particles_.count);
    in.read<double>(name, std::span(array.data(), array.size()));
  });
  const auto leaves = in.read<std::uint8_t>("reach.leaves");
  std::vector<std::int32_t> origins(3 * leaves.size());
  in.read<std::int32_t>("reach.block", std::span(origins));
  std::vector<BlockReach> reach(leaves.size());
  for (std::size_t n = 0; n < reach.size(); ++n)
    reach[n] = {{origins[3 * n], origins[3 * n + 1], origins[3 * n + 2]}, leaves[n]};
  grid_.set_reach(reach);
  cells_.resize(grid_.blocks().size());
  in.read<std::uint32_t>("block.cells",
                         std::span(cells_.data()->data(), cells_.size() * std::tuple_size_v<CellRanges>));
  scatter_particles(in.read<std::uint32_t>("returned_strays"));
  sort_debt_ = in.read_value<double>("sort_debt");
}

}  // namespace anticrack
