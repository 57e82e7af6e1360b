#pragma once

#include <string>
#include <vector>

#include "scene.h"

namespace anticrack {

/// A sample and a loading, to be loaded at one rate after the other.
struct LoadingSeries {
  std::string sample, loading;
  Scene scene;
  int slowest, fastest;  ///< times the paper's strain rate, powers of two
};

/// What one run gave.
struct LoadingCase {
  std::string sample, loading;
  int rate;                         ///< times the paper's strain rate
  double strain_rate, wall_speed;   ///< of a wall [1/s], over the solid's wave speed [-]
  double modulus;                   ///< K, in pure shear G [Pa]
  double stress, strain;            ///< at failure: p, in pure shear q [Pa]; nominal [-]
  double peak_stress, peak_strain;  ///< the same at the highest force before it has fallen by a fifth
  double passages;                  ///< of the wave before failure [-]
  double kinetic_over_internal, wall_over_volume, energy_residual;  ///< the certificate at failure
  double steps, seconds;
};

/// Small samples of Table 1's solid: two realizations, one of lower solid fraction, one sixteen times
/// softer, one on a finer grid, one with twice the wavelengths a side; in isotropic and confined compression
/// and in pure shear.
std::vector<LoadingSeries> loading_series();

/// Loads until the force has fallen to four fifths of its peak, or to twice the strain of failure. NaN for
/// what was not found.
LoadingCase run_loading_case(const LoadingSeries& series, int rate);

}  // namespace anticrack
