#pragma once

namespace anticrack {

/// What loading too fast costs, by the number N of passages of the solid's longitudinal wave through the
/// sample before it fails: errors of up to about a / N, as if failure came a passages late; in the median
/// half as much. Measured by `anticrack precision --loading` on samples of two solid fractions, stiffnesses,
/// resolutions and sizes; the table is in engine/README.md.
namespace loading_law {

constexpr double modulus_factor = 0.5;
constexpr double failure_stress_factor = 2;

constexpr double modulus_error(double wave_passages) {
  return modulus_factor / wave_passages;
}
constexpr double failure_stress_error(double wave_passages) {
  return failure_stress_factor / wave_passages;
}

/// Passages from which on the errors are smaller.
constexpr double passages_for_modulus(double error) {
  return modulus_factor / error;
}
constexpr double passages_for_failure_stress(double error) {
  return failure_stress_factor / error;
}

/// Nominal strain at failure over cohesion / E, the solid's own scale: to about a factor of two.
constexpr double confined_failure_strain = 1.1, triaxial_failure_strain = 0.6;

}  // namespace loading_law
}  // namespace anticrack
