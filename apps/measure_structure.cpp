#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "measure_groups.h"
#include "measures/local_thickness.h"
#include "measures/representative_volume.h"
#include "measures/surface_measures.h"
#include "measures/two_point_correlation.h"

namespace anticrack {

namespace {

constexpr const char* axis_names[3] = {"x", "y", "z"};

double solid_fraction_of(const PhaseImage& image) {
  return double(std::ranges::count(image.solid, std::uint8_t(1))) / double(image.count());
}

std::optional<double> ssa_theory(const MeasuredSample& sample) {
  if (!sample.theory) return {};
  return minkowski_densities(*sample.theory).surface / sample.theory->solid_fraction;
}

MeasuredCurve radial_curve(const MeasuredSample& sample, const TwoPointCorrelation& correlation,
                           const std::string& name, const std::string& definition, bool normalized) {
  MeasuredCurve curve{name, "r", "m", normalized ? "g_norm" : "g", "-", definition, {}, {}};
  for (const RadialBin& bin : correlation.radial) {
    curve.x.push_back(bin.r);
    curve.y.push_back(normalized ? correlation.normalized(bin.g()) : bin.g());
    if (!sample.theory) continue;
    const double phi = sample.theory->solid_fraction, g = two_point_probability(*sample.theory, bin.r);
    curve.theory.push_back(normalized ? (g - phi * phi) / (phi - phi * phi) : g);
  }
  return curve;
}

// Length at which g_norm has fallen to 1/e, between the two points beside it.
std::optional<double> correlation_length(const MeasuredCurve& g_norm) {
  const double level = std::exp(-1.0);
  for (std::size_t i = 1; i < g_norm.x.size(); ++i)
    if (g_norm.y[i] <= level) {
      const double share = (g_norm.y[i - 1] - level) / (g_norm.y[i - 1] - g_norm.y[i]);
      return g_norm.x[i - 1] + share * (g_norm.x[i] - g_norm.x[i - 1]);
    }
  return {};
}

}  // namespace

void measure_fractions(const MeasuredSample& sample, Characterization& result) {
  const PhaseImage& image = sample.image;
  const auto solid = std::uint64_t(std::ranges::count(image.solid, std::uint8_t(1)));
  result.counts.insert(result.counts.end(), {{"voxels", image.count()},
                                             {"voxels_x", std::uint64_t(image.size[0])},
                                             {"voxels_y", std::uint64_t(image.size[1])},
                                             {"voxels_z", std::uint64_t(image.size[2])},
                                             {"solid_voxels", solid},
                                             {"pore_voxels", image.count() - solid}});
  result.measures.push_back({"voxel_size", image.voxel_size, "m", "edge of a voxel"});
  result.measures.push_back({"solid_fraction", double(solid) / double(image.count()), "-",
                             "phi: solid voxels over all voxels",
                             sample.theory ? std::optional(sample.theory->solid_fraction) : std::nullopt});
}

void measure_correlation(const MeasuredSample& sample, Characterization& result) {
  const PhaseImage& image = sample.image;
  const int largest_lag = default_largest_lag(image);
  const TwoPointCorrelation inside = correlate_solid(image, PairRule::inside_box, largest_lag);
  const char* inside_text =
      "two-point probability that both ends of a vector of length r lie in the solid; pairs of voxels inside "
      "the sample, each lag divided by its own number of pairs (Torquato 2002)";
  result.curves.push_back(radial_curve(sample, inside, "correlation", inside_text, false));
  result.curves.push_back(
      radial_curve(sample, inside, "correlation_normalized",
                   "(g - phi^2) / (phi - phi^2) of `correlation` (Blatny et al. 2021, Eq. B.3)", true));
  const MeasuredCurve g_norm = result.curves.back();
  for (int axis = 0; axis < 3; ++axis) {
    MeasuredCurve curve{fmt::format("correlation_{}", axis_names[axis]),
                        "r",
                        "m",
                        "g",
                        "-",
                        fmt::format("the same for vectors along {}", axis_names[axis]),
                        {},
                        {}};
    for (int lag = 0; lag <= largest_lag; ++lag) {
      curve.x.push_back(lag * image.voxel_size);
      curve.y.push_back(inside.axes[axis].g(lag));
      if (sample.theory) curve.theory.push_back(two_point_probability(*sample.theory, curve.x.back()));
    }
    result.curves.push_back(std::move(curve));
  }

  const TwoPointCorrelation periodic = correlate_solid(
      image, PairRule::periodic, std::min(largest_lag, *std::ranges::min_element(image.size) / 2));
  result.curves.push_back(radial_curve(sample, periodic, "correlation_periodic",
                                       "as Blatny et al. (2021), Eqs. B.1 and B.2: the sample is taken to "
                                       "repeat. Biased unless it does: pairs across "
                                       "a face belong to two places that have nothing to do with each other",
                                       false));

  const double phi = inside.solid_fraction;
  const SlopeSurface slope = surface_by_slope(inside), slope_periodic = surface_by_slope(periodic);
  const auto theory = ssa_theory(sample);
  result.measures.insert(result.measures.end(),
                         {{"ssa_slope", slope.axes_extrapolated / phi, "1/m",
                           "specific surface, area over solid volume, -4/phi dg/dr at r = 0 (Berryman 1987; "
                           "Eq. B.4) from g along the "
                           "axes at 1 and 2 voxels without its cubic term. A plane along the axes counts 2/3",
                           theory},
                          {"ssa_faces", slope.axes_first_difference / phi, "1/m",
                           "the same from the first difference of g: voxel faces between the phases times "
                           "2/3. Low by the curvature of g "
                           "over one voxel",
                           theory},
                          {"ssa_paper", slope_periodic.radial / phi, "1/m",
                           "the same as the paper has it: first difference of the radial mean of the "
                           "periodic g. High by the false surface "
                           "at the faces of the sample, low by bins that mix lengths 1 and sqrt(2)",
                           theory},
                          {"correlation_length", correlation_length(g_norm), "m",
                           "r at which `correlation_normalized` is 1/e"}});
}

void measure_surfaces(const MeasuredSample& sample, Characterization& result) {
  const double phi = solid_fraction_of(sample.image), h = sample.image.voxel_size;
  const Window window = inner_window(sample.image.box(), 2 * h);
  const SurfaceMeasures inside = measure_surface(sample.surface, window);
  const double volume = (window.upper - window.lower).prod();
  result.counts.push_back({"surface_triangles", sample.surface.triangles.size()});
  result.measures.insert(result.measures.end(),
                         {{"ssa_mesh", inside.area / volume / phi, "1/m",
                           "specific surface from the triangles of the level set, two voxels away from the "
                           "faces of the sample; no cap "
                           "counts",
                           ssa_theory(sample)},
                          {"mean_curvature_mesh", inside.mean_curvature / volume, "1/m^2",
                           "integral of (kappa_1 + kappa_2)/2 over the same surface, by the angles at its "
                           "edges, over the volume",
                           sample.density_in_theory(&MinkowskiDensities::mean_curvature)},
                          {"euler_density_mesh", inside.euler() / volume, "1/m^3",
                           "Euler number of the solid (pieces - tunnels + cavities) over the volume, by "
                           "Gauss and Bonnet on the same "
                           "surface",
                           sample.density_in_theory(&MinkowskiDensities::euler)}});
}

void measure_thickness(const MeasuredSample& sample, Characterization& result) {
  const double phi = solid_fraction_of(sample.image);
  if (phi == 0 || phi == 1) return;  // no ball is bounded
  for (const auto& [phase, name] : {std::pair{Phase::pore, "pore"}, {Phase::solid, "solid"}}) {
    const ThicknessDistribution sizes = thickness_distribution(sample.image, phase);
    const std::string text = fmt::format(
        "local thickness: diameter of the largest ball inside the {} that holds the voxel (Hildebrand & "
        "Ruegsegger "
        "1997), each voxel counting once; balls go on beyond the faces of the sample",
        name);
    result.measures.insert(result.measures.end(),
                           {{fmt::format("{}_size_mean", name), sizes.mean, "m", "mean " + text},
                            {fmt::format("{}_size_median", name), sizes.quantile(0.5), "m", "median " + text},
                            {fmt::format("{}_size_deviation", name), sizes.standard_deviation, "m",
                             "standard deviation of the " + text}});
    MeasuredCurve curve{
        fmt::format("{}_size", name), "diameter", "m", "share of the volume a diameter", "1/m",
        "density of the " + text,     {},         {}};
    const double width = 2 * sample.image.voxel_size;
    const std::vector<double> histogram = sizes.histogram(width);
    for (std::size_t n = 0; n < histogram.size(); ++n) {
      curve.x.push_back((double(n) + 0.5) * width);
      curve.y.push_back(histogram[n] / width);
    }
    result.curves.push_back(std::move(curve));
  }
}

void measure_representative_volume(const MeasuredSample& sample, Characterization& result) {
  const std::vector<int> edges = sub_box_edges(sample.image);
  const double phi = solid_fraction_of(sample.image), h = sample.image.voxel_size;
  if (edges.size() < 2 || phi == 0 || phi == 1) return;
  const std::vector<SubBoxStatistics> boxes = sub_box_solid_fractions(sample.image, edges);
  MeasuredCurve curve{"representative_volume",
                      "edge",
                      "m",
                      "standard deviation of phi",
                      "-",
                      "of the solid fractions of disjoint cubes of that edge (Kanit et al. 2003)",
                      {},
                      {}};
  for (const SubBoxStatistics& box : boxes) {
    curve.x.push_back(box.edge * h);
    curve.y.push_back(box.standard_deviation);
    if (sample.theory)
      curve.theory.push_back(std::sqrt(solid_fraction_variance(*sample.theory, box.edge, h)));
  }
  result.curves.push_back(std::move(curve));

  // The law with exponent 1 holds for cubes that are large against the structure: the largest four edges.
  const std::size_t largest = std::min<std::size_t>(4, boxes.size());
  const RepresentativeVolume fit = fit_representative_volume(std::span(boxes).first(largest), h, false);
  result.measures.insert(
      result.measures.end(),
      {{"integral_range", fit.scale / (phi - phi * phi), "m^3",
        "A_3: variance of phi over phi (1 - phi) times the volume, fitted to the four largest cubes "
        "(Lantuejoul 1991)",
        sample.theory ? std::optional(integral_range(*sample.theory)) : std::nullopt},
       {"representative_edge_5_percent", fit.edge_for_relative_error(0.05), "m",
        "edge of the cube whose solid fraction has two standard deviations of 5 % of phi (Kanit et al. 2003, "
        "Eq. 18)"},
       {"representative_edge_1_percent", fit.edge_for_relative_error(0.01), "m", "the same for 1 %"}});
}

}  // namespace anticrack
