#pragma once

#include <functional>
#include <span>

#include "fields/gaussian_random_field.h"
#include "sample_lattice.h"

namespace anticrack {

/// Evaluates the sum of cos(eta_n . r + phase_n) on a padded lattice by a non-uniform Fourier transform.
///
/// The waves' complex amplitudes are spread onto a uniform grid of modes with a compact kernel psi,
///   e^{i eta x} = 1/psi_hat(x) sum_m psi(eta/delta - m) e^{i m delta x},
/// and the modes, folded to the real basis 1, cos, sin along each axis, are carried to the lattice one axis
/// after the other by small dense matrix products; the division by psi_hat is part of those matrices. Kernel:
/// the exponential of a semicircle (Barnett, Magland and af Klinteberg 2019). Memory: one plane of lattice
/// values for each mode along z.
///
/// @param store  called once for each run of consecutive lattice points: offset of the first (x fastest) and
/// their sums;
///               called from several threads at once. The sums do not depend on the number of threads.
void sum_waves_on_lattice(std::span<const PlaneWave> waves, const SampleLattice& lattice, int padding,
                          const std::function<void(std::size_t first, std::span<const double> sums)>& store);

}  // namespace anticrack
