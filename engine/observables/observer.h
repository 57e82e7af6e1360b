#pragma once

#include <array>
#include <optional>

#include "io/history.h"
#include "io/run_result.h"
#include "simulation.h"

namespace anticrack {

/// Turns the sums of a simulation into rows of history and, over the rows, into moduli, failure point and
/// quasi-static certificate. Its whole memory is a plain struct, so that a checkpoint can hold it.
class Observer {
 public:
  explicit Observer(const Simulation& simulation);

  /// The row of the state that the last step observed; call after `step(true)`. `wall_seconds` is only passed
  /// on.
  HistoryRow record(const Simulation& simulation, double wall_seconds);

  /// The maximum of the wall force conjugate to the loading, where W2 (Eq. 9) turns negative; known once the
  /// force has fallen by 5 % below it with plastic work done, so that elastic waves are not taken for
  /// failure.
  std::optional<FailurePoint> failure() const;

  /// Least-squares moduli of the rows before plastic work reaches a thousandth of the elastic energy [Pa];
  /// nothing where the loading has no volumetric (K) or no deviatoric (G) part.
  std::optional<double> bulk_modulus() const;
  std::optional<double> shear_modulus() const;

  QuasiStatic quasi_static() const;

  /// Strain as `until_strain` counts it: compression along the axis, or the largest strain of a triaxial run.
  static double loading_strain(const Simulation& simulation);

  struct Memory {
    double time, interval;               ///< of the last row [s]
    std::array<double, 6> wall_impulse;  ///< at the last row [N s]
    double generalized_impulse;          ///< at the last row [J]
    double force;                        ///< generalized force over the last interval [W]
    std::array<double, 3> sigma;         ///< normal stresses at the last row [Pa]
    std::array<double, 3> wall_virial;   ///< at the last row [N s m]
    double peak_force;
    double peak_strain, peak_p, peak_q, peak_step, peak_time;
    double failed;                      ///< 1 once it has
    double yielding;                    ///< 1 once plastic work counts
    double p_ev, ev_ev, s_e, e_e;       ///< sums for the moduli
    double kinetic, internal;           ///< sums over rows [J]
    double wall_volume, volume_volume;  ///< sums of stress products [Pa^2]
    double worst_residual;
  };
  const Memory& memory() const { return m_; }
  void restore(const Memory& memory) { m_ = memory; }

 private:
  double passage_time_;  ///< of the solid's longitudinal wave through the sample [s]
  Memory m_{};
};

/// One line for the reader: "quasi-static", or why not. `verdict` itself is not looked at.
std::string quasi_static_verdict(const QuasiStatic& certificate);

}  // namespace anticrack
