#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

namespace anticrack {

/// Where the second-order work changed sign.
struct FailurePoint {
  double strain;  ///< nominal strain of the loading, as `until_strain` counts it [-]
  double p;       ///< mean stress of the box [Pa]
  double q;       ///< [Pa]
  std::int64_t step;
  double time;  ///< [s]
};

/// How far the run was from a quasi-static one.
struct QuasiStatic {
  double kinetic_over_internal;  ///< kinetic energy over elastic energy and plastic work [-]
  double
      wall_over_volume_stress;  ///< stress by the wall forces over the volume average [-]; 1 in equilibrium
  double energy_residual;       ///< relative [-]
  double wave_passages;  ///< of the solid's longitudinal wave through the sample before failure, or the end
  bool failed;           ///< whether the sample has
  std::string verdict;   ///< one line for the reader
};

/// The end of a run, result.json. A number that is not finite becomes null.
struct RunResult {
  std::string loading;     ///< "triaxial" or "confined_compression"
  std::string walls;       ///< wall kind; every result names it because K depends on it
  std::string wall_rule;   ///< "ghost" or "paper"
  std::string stopped_by;  ///< "until_strain", "failure", "max_steps", "signal", ...

  std::optional<double> K;  ///< bulk modulus of the sample [Pa], where the loading allows it
  std::optional<double> G;  ///< shear modulus of the sample [Pa], where the loading allows it
  std::optional<FailurePoint> failure;

  std::uint64_t particles = 0;
  std::int64_t steps = 0;
  double wall_seconds = 0;                     ///< [s] of the whole run, resumed or not
  double particle_steps_per_second = 0;        ///< [1/s]
  double solid_fraction_achieved = 0;          ///< at the start [-]
  std::optional<double> solid_fraction_asked;  ///< [-]; none for a scan
  QuasiStatic quasi_static;
};

/// Writes `result` atomically: a result.json that exists is complete. @throws FileError
void write_run_result(const RunResult& result, const std::filesystem::path& file);

}  // namespace anticrack
