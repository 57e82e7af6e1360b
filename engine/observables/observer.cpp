#include "observables/observer.h"

#include <algorithm>
#include <cmath>
#include <sstream>

#include "observables/loading_law.h"
#include "time_step.h"

namespace anticrack {

namespace {

double mean_stress(const double (&s)[6]) {
  return -(s[0] + s[1] + s[2]) / 3;
}

double von_mises(const double (&s)[6]) {
  const double m = -mean_stress(s);
  const double diagonal = (s[0] - m) * (s[0] - m) + (s[1] - m) * (s[1] - m) + (s[2] - m) * (s[2] - m);
  return std::sqrt(1.5 * (diagonal + 2 * (s[3] * s[3] + s[4] * s[4] + s[5] * s[5])));
}

/// Ramp and two passages of the longitudinal wave [s]: before that a wall's force is that of its start.
double settling_time(const SimulationSetup& setup, double passage_time) {
  const double ramp = std::visit([](const auto& loading) { return loading.ramp_time; }, setup.loading);
  return ramp + 2 * passage_time;
}

}  // namespace

Observer::Observer(const Simulation& simulation)
    : passage_time_(simulation.setup().box_size.maxCoeff() /
                    elastic_wave_speed(simulation.setup().material)) {
  m_.time = simulation.time();
}

double Observer::loading_strain(const Simulation& simulation) {
  const Vec3 strain = simulation.walls().strain();
  if (const auto* confined = std::get_if<ConfinedCompression>(&simulation.setup().loading))
    return -strain[confined->axis];
  return strain.cwiseAbs().maxCoeff();
}

HistoryRow Observer::record(const Simulation& simulation, double wall_seconds) {
  const ParticleSums& sums = simulation.observed();
  const Ledger& ledger = simulation.ledger();
  const double V0 = simulation.setup().particle_volume, V = simulation.walls().volume();
  const Vec3 strain = simulation.walls().strain();

  HistoryRow row;
  row.step = double(simulation.steps());
  row.time = simulation.time();
  row.dt = simulation.dt();
  row.strain_x = strain[0], row.strain_y = strain[1], row.strain_z = strain[2];

  double sigma[6], paper[6];  // <sigma> = sum V0 tau / V of the whole box; the paper's: phi sum(tau J) /
                              // sum(J) of the solid
  const double solid_fraction = V0 * double(simulation.particles().count) / V;
  for (int e = 0; e < 6; ++e) {
    sigma[e] = V0 * sums.tau[e] / V;
    paper[e] = solid_fraction * sums.tau_J[e] / sums.J;
  }
  row.p = mean_stress(sigma);
  row.q = V0 * sums.q / V;
  row.q_of_mean = von_mises(sigma);
  row.p_paper = mean_stress(paper);
  row.q_paper = von_mises(paper);
  row.sigma_xx = sigma[0], row.sigma_yy = sigma[1], row.sigma_zz = sigma[2];
  row.sigma_xy = sigma[3], row.sigma_xz = sigma[4], row.sigma_yz = sigma[5];

  const double interval = simulation.time() - m_.time;
  std::array<double, 6> force{};
  if (interval > 0)
    for (int w = 0; w < 6; ++w) force[w] = (ledger.wall_impulse[w] - m_.wall_impulse[w]) / interval;
  row.wall_force_x0 = force[0], row.wall_force_x1 = force[1];
  row.wall_force_y0 = force[2], row.wall_force_y1 = force[3];
  row.wall_force_z0 = force[4], row.wall_force_z1 = force[5];

  // W2 = sum u' . f' with u' = ramp * full velocity: the rate of the force conjugate to the loading, averaged
  // over intervals.
  double conjugate = m_.force;
  if (interval > 0) {
    conjugate = (ledger.generalized_impulse - m_.generalized_impulse) / interval;
    row.second_order_work = simulation.walls().ramp(simulation.time()) * (conjugate - m_.force) /
                            (0.5 * (interval + m_.interval));
  }

  row.kinetic_energy = simulation.kinetic_energy();
  row.elastic_energy = V0 * sums.elastic_energy;
  row.plastic_dissipation = ledger.plastic_dissipation;
  row.numerical_dissipation = ledger.numerical_dissipation;
  row.wall_work = ledger.wall_work;
  // Velocities and the work of the walls stand half a step before the strains: what the stresses will take
  // from the motion in the coming half step, extrapolated from the last two, is stored already.
  const double ahead = 0.5 * (1.5 * ledger.stress_work - 0.5 * ledger.stress_work_before);
  const double stored = row.kinetic_energy + row.elastic_energy + row.plastic_dissipation - ahead;
  const double balance = stored + row.numerical_dissipation - row.wall_work;
  const double scale = std::max(stored, std::abs(row.wall_work));
  row.energy_residual = scale > 0 ? balance / scale : 0;
  row.solid_fraction = solid_fraction;
  row.plastic_fraction = sums.plastic / double(simulation.particles().count);
  row.strays = double(simulation.stray_count()) / double(simulation.particles().count);
  row.active_leaves = double(simulation.grid().leaves().size());
  row.wall_seconds = wall_seconds;

  // Moduli, from rows in which next to nothing has yielded.
  if (row.plastic_dissipation > 1e-3 * row.elastic_energy) m_.yielding = 1;
  const double volumetric = strain.sum();
  if (!m_.yielding) {
    m_.p_ev -= row.p * volumetric;
    m_.ev_ev += volumetric * volumetric;
    for (int a = 0; a < 3; ++a) {
      const double e = strain[a] - volumetric / 3;
      m_.s_e += (sigma[a] + row.p) * e;
      m_.e_e += e * e;
    }
  }
  // Failure: the peak of the conjugate force, once the impact of the walls has crossed the sample and come
  // back.
  if (!m_.failed && simulation.time() > settling_time(simulation.setup(), passage_time_)) {
    if (conjugate > m_.peak_force) {
      m_.peak_force = conjugate;
      m_.peak_strain = loading_strain(simulation), m_.peak_p = row.p, m_.peak_q = row.q;
      m_.peak_step = row.step, m_.peak_time = row.time;
    } else if (m_.yielding && conjugate < 0.95 * m_.peak_force) {
      m_.failed = 1;
    }
  }
  // Quasi-static certificate.
  m_.kinetic += row.kinetic_energy;
  m_.internal += row.elastic_energy + row.plastic_dissipation;
  for (int a = 0; a < 3; ++a) {
    // Mean stress of a body at rest, from all forces on its boundary: V sigma_aa = sum f_a x_a. Sticky walls
    // push along themselves too.
    const double wall = interval > 0 ? (ledger.wall_virial[a] - m_.wall_virial[a]) / interval / V : 0;
    const double volume = 0.5 * (m_.sigma[a] + sigma[a]);  // over the interval, as the wall force is
    m_.wall_volume += wall * volume;
    m_.volume_volume += volume * volume;
    m_.sigma[a] = sigma[a];
  }
  m_.wall_virial = ledger.wall_virial;
  // While the walls' impact is on its way next to no work is done, and any share of it is missing little.
  const double residual = std::abs(row.energy_residual);
  const bool settled = simulation.time() > settling_time(simulation.setup(), passage_time_);
  m_.worst_residual = settled ? std::max(m_.worst_residual, residual) : residual;

  m_.time = simulation.time(), m_.interval = interval;
  m_.wall_impulse = ledger.wall_impulse;
  m_.generalized_impulse = ledger.generalized_impulse;
  m_.force = conjugate;
  return row;
}

std::optional<FailurePoint> Observer::failure() const {
  if (!m_.failed) return std::nullopt;
  return FailurePoint{m_.peak_strain, m_.peak_p, m_.peak_q, std::int64_t(m_.peak_step), m_.peak_time};
}

std::optional<double> Observer::bulk_modulus() const {
  if (!(m_.ev_ev > 1e-6 * m_.e_e)) return std::nullopt;
  return m_.p_ev / m_.ev_ev;
}

std::optional<double> Observer::shear_modulus() const {
  if (!(m_.e_e > 1e-6 * m_.ev_ev)) return std::nullopt;
  return m_.s_e / (2 * m_.e_e);
}

QuasiStatic Observer::quasi_static() const {
  QuasiStatic q;
  q.kinetic_over_internal = m_.kinetic / m_.internal;
  q.wall_over_volume_stress = m_.wall_volume / m_.volume_volume;
  q.energy_residual = m_.worst_residual;
  q.failed = m_.failed;
  q.wave_passages = (m_.failed ? m_.peak_time : m_.time) / passage_time_;
  q.verdict = quasi_static_verdict(q);
  return q;
}

/// "by up to 4.1 %"; larger ones mean nothing.
static std::string by_up_to(double error) {
  if (!(error < 0.5)) return "by half or more";
  std::ostringstream text;
  text.precision(2);
  text << "by up to " << 100 * error << " %";
  return text.str();
}

std::string quasi_static_verdict(const QuasiStatic& q) {
  std::ostringstream why;
  if (!(q.kinetic_over_internal < 0.05)) why << "; kinetic energy above 5 % of the internal";
  if (!(std::abs(q.wall_over_volume_stress - 1) < 0.05))
    why << "; wall and volume stress differ by more than 5 %";
  if (!(q.energy_residual < 0.05)) why << "; energy balance open by more than 5 %";
  using namespace loading_law;
  why.precision(2);
  if (q.failed && !(failure_stress_error(q.wave_passages) < 0.05))
    why << "; failed after " << q.wave_passages << " wave passages, expected at least "
        << passages_for_failure_stress(0.05) << ", so that its stress is off "
        << by_up_to(failure_stress_error(q.wave_passages)) << " and moduli "
        << by_up_to(modulus_error(q.wave_passages));
  if (!q.failed && !(modulus_error(q.wave_passages) < 0.05))
    why << "; ended after " << q.wave_passages << " wave passages, so that moduli are off "
        << by_up_to(modulus_error(q.wave_passages));
  return why.str().empty() ? "quasi-static" : "not quasi-static" + why.str();
}

}  // namespace anticrack
