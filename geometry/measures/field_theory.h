#pragma once

#include "fields/gaussian_random_field.h"
#include "fields/morphology.h"

namespace anticrack {

/// Wave numbers of an isotropic Gaussian random field: the gamma law of shape b+1 and mean <eta>; Blatny et
/// al. 2021, Eq. 2.
struct GammaSpectrum {
  double mean_wave_number;  ///< <eta> [1/m], > 0
  double heterogeneity;     ///< b [-], > 0

  /// The law that `GaussianRandomField::sample` draws from.
  static GammaSpectrum of(const GaussianRandomFieldSpec& spec, double shortest_side);
};

/// Covariance of the field over its variance, rho(r) = sin(b atan u) / (b u (1+u^2)^(b/2)), u = <eta> r /
/// (b+1): the mean of sin(eta r)/(eta r) over the law. @param r  [m], >= 0
double field_correlation(const GammaSpectrum& spectrum, double r);

/// <eta^2> = <eta>^2 (b+2)/(b+1) [1/m^2].
double mean_square_wave_number(const GammaSpectrum& spectrum);

/// Density of N = L / omega = eta L / (2 pi), wavelengths a side; Fig. B.14a.
/// @param mean_wavelengths  N_w, the mean of N
double wavelengths_density(double wavelengths, double mean_wavelengths, double heterogeneity);

/// What probability theory says of an endless sample.
struct FieldTheory {
  Morphology morphology;
  double solid_fraction;  ///< phi [-], in (0, 1)
  GammaSpectrum spectrum;
};

/// S2(r) [-], the probability that both ends of a vector of length r are solid. Single cut: phi - 2 T(s,
/// sqrt((1-rho)/(1+rho))), s = sqrt(2) t, T Owen's function. @param r  [m], >= 0
/// @throws InputError  if the solid fraction is not in (0, 1)
double two_point_probability(const FieldTheory& theory, double r);

/// Densities of the solid's intrinsic volumes.
struct MinkowskiDensities {
  double surface;         ///< S_V [1/m]: area over volume. SSA = S_V / phi
  double mean_curvature;  ///< integral of (kappa_1 + kappa_2)/2 over the surface, over volume [1/m^2]; convex
                          ///< > 0
  double euler;           ///< Euler number over volume [1/m^3]: pieces - tunnels + cavities
};

/// Single cut, with s = sqrt(2) t and l = <eta^2>/3: S_V = (2/pi) l^(1/2) e^(-s^2/2), mean curvature l s
/// e^(-s^2/2) / sqrt(2 pi), Euler number l^(3/2) (s^2-1) e^(-s^2/2) / (4 pi^2) (Adler 1981; Tomita 1986). The
/// surfaces of a two-cut add up; intersections and unions follow from the principal kinematic formula
/// (Schneider & Weil 2008).
/// Open and closed cells have sharp edges, at which voxels and meshes do not converge to curvature and Euler
/// number.
/// @throws InputError  if the solid fraction is not in (0, 1)
MinkowskiDensities minkowski_densities(const FieldTheory& theory);

/// Integral range A_3 [m^3]: the integral of (S2 - phi^2) / (phi - phi^2) over space, by Simpson's rule out
/// to 1000 wavelengths. The solid fraction of a large volume V has the variance phi (1 - phi) A_3 / V
/// (Lantuejoul 1991; Kanit et al. 2003).
/// @throws InputError  if the solid fraction is not in (0, 1), or b <= 2: the integral diverges
double integral_range(const FieldTheory& theory);

/// Variance of the solid fraction of a cube of `edge`^3 lattice points of spacing `voxel_size` [m], exact for
/// every size: the mean of S2 - phi^2 over all pairs of its points.
/// @throws InputError  if the solid fraction is not in (0, 1), or edge < 1
double solid_fraction_variance(const FieldTheory& theory, int edge, double voxel_size);

}  // namespace anticrack
