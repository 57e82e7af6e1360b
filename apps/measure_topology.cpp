#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "measure_groups.h"
#include "measures/chords.h"
#include "measures/clusters.h"
#include "measures/geodesic.h"
#include "measures/minkowski.h"

namespace anticrack {

namespace {

constexpr const char* axis_names[3] = {"x", "y", "z"};
constexpr std::pair<Phase, const char*> phases[] = {{Phase::pore, "pore"}, {Phase::solid, "solid"}};

void count_clusters(const PhaseImage& image, Phase phase, const std::string& name, Characterization& result) {
  const Clusters clusters = find_clusters(image, phase, Connectivity::faces);
  const auto largest = clusters.largest();
  result.counts.insert(
      result.counts.end(),
      {{name + "_clusters", clusters.clusters.size()},
       {name + "_largest_cluster", largest ? clusters.clusters[*largest].voxels : 0},
       {name + "_spanning_x", clusters.spanning_voxels(SpanningRule::x)},
       {name + "_spanning_y", clusters.spanning_voxels(SpanningRule::y)},
       {name + "_spanning_z", clusters.spanning_voxels(SpanningRule::z)},
       {name + "_spanning_six_faces", clusters.spanning_voxels(SpanningRule::six_faces)},
       {name + "_clusters_26", find_clusters(image, phase, Connectivity::corners).clusters.size()}});
  result.measures.push_back(
      {fmt::format("percolating_{}_fraction", name),
       double(clusters.spanning_voxels(SpanningRule::six_faces)) / double(image.count()), "-",
       fmt::format("voxels of the {0} cluster that touches all six faces (6-connected) over all voxels{1}",
                   name, phase == Phase::solid ? "; phi_p of Blatny et al. 2021, Fig. B.16a" : "")});
}

}  // namespace

void measure_topology(const MeasuredSample& sample, Characterization& result) {
  for (const auto& [phase, name] : phases) count_clusters(sample.image, phase, name, result);

  const NeighbourhoodCounts open = count_neighbourhoods(sample.image, BoxBoundary::open);
  const NeighbourhoodCounts closed = count_neighbourhoods(sample.image, BoxBoundary::closed);
  const double solid_volume = open.solid_volume();
  const auto specific = [&](CroftonDirections directions) {
    return solid_volume > 0 ? std::optional(surface_area(open, directions) / solid_volume) : std::nullopt;
  };
  auto ssa = sample.density_in_theory(&MinkowskiDensities::surface);
  if (ssa) *ssa /= sample.theory->solid_fraction;
  result.measures.insert(
      result.measures.end(),
      {{"ssa_crofton", specific(CroftonDirections::thirteen), "1/m",
        "specific surface, area over solid volume, by Crofton's formula on voxels in 13 directions (Lang, "
        "Ohser & "
        "Hilfer 2001), faces of the sample left out. Counts 0.927 to 1.023 of a plane, by its direction; "
        "misses what is "
        "thinner than a voxel",
        ssa},
       {"ssa_crofton_3", specific(CroftonDirections::three), "1/m",
        "the same in three directions. Counts 0.667 to 1.155 of a plane", ssa},
       {"mean_curvature", integral_of_mean_curvature(open) / open.volume(), "1/m^2",
        "integral of (kappa_1 + kappa_2)/2 over the surface, over the volume, by Euler numbers of plane "
        "sections in 13 "
        "directions (Ohser & Muecklich 2000)",
        sample.density_in_theory(&MinkowskiDensities::mean_curvature)},
       {"euler_density", euler_density(open, Connectivity::faces), "1/m^3",
        "Euler number of the solid (pieces - tunnels + cavities) over the volume, solid 6-connected, faces "
        "of the "
        "sample left out (Serra 1982)",
        sample.density_in_theory(&MinkowskiDensities::euler)},
       {"euler_density_26", euler_density(open, Connectivity::corners), "1/m^3",
        "the same, solid 26-connected", sample.density_in_theory(&MinkowskiDensities::euler)},
       {"euler_number", double(eightfold_euler_number(closed, Connectivity::faces) / 8), "-",
        "Euler number of the solid as a body, 6-connected, pore around it"},
       {"euler_number_26", double(eightfold_euler_number(closed, Connectivity::corners) / 8), "-",
        "the same, 26-connected"}});
}

void measure_chords(const MeasuredSample& sample, Characterization& result) {
  const double h = sample.image.voxel_size;
  for (const auto& [phase, name] : phases)
    for (int axis = 0; axis < 3; ++axis) {
      const Chords chords = measure_chords(sample.image, phase, axis);
      const std::string along = fmt::format("{}_chord_{}", name, axis_names[axis]);
      const auto finite = [](double value) {
        return std::isfinite(value) ? std::optional(value) : std::nullopt;
      };
      result.measures.push_back(
          {along + "_mean", finite(chords.mean()), "m",
           fmt::format(
               "mean length of the stretches of {} along {} (Torquato & Lu 1993): its length over half the "
               "number of its ends inside the sample, so that chords which a face cuts do not bias it",
               name, axis_names[axis])});
      result.measures.push_back(
          {along + "_mean_whole", finite(chords.mean_of_whole()), "m",
           "the same of chords that no face cuts only: too short, long ones are cut more often"});
      std::uint64_t all = 0;
      for (const std::uint64_t count : chords.whole) all += count;
      MeasuredCurve curve{fmt::format("{}_chords_{}", name, axis_names[axis]),
                          "chord length",
                          "m",
                          "share of the chords a length",
                          "1/m",
                          "of the chords that no face cuts",
                          {},
                          {}};
      std::size_t end = chords.whole.size();
      while (end > 1 && chords.whole[end - 1] == 0) --end;
      for (std::size_t l = 1; l < end; ++l) {
        curve.x.push_back(double(l) * h);
        curve.y.push_back(all > 0 ? double(chords.whole[l]) / double(all) / h : 0);
      }
      result.curves.push_back(std::move(curve));
    }
}

void measure_paths(const MeasuredSample& sample, Characterization& result) {
  struct Paths {
    Phase phase;
    const char* name;
    int axis;
    std::optional<Tortuosity> euclidean, steps;
  };
  std::vector<Paths> all;
  for (const auto& [phase, name] : phases)
    for (int axis = 0; axis < 3; ++axis) all.push_back({phase, name, axis, {}, {}});
  // A front is one thread's work.
  tbb::parallel_for(std::size_t(0), all.size(), [&](std::size_t n) {
    all[n].euclidean = tortuosity_by_fast_marching(sample.image, all[n].phase, all[n].axis);
    all[n].steps = tortuosity_by_steps(sample.image, all[n].phase, all[n].axis);
  });

  for (const Paths& paths : all) {
    const std::string along = fmt::format("{}_tortuosity_{}", paths.name, axis_names[paths.axis]);
    const auto of = [](const std::optional<Tortuosity>& t, double Tortuosity::*value) {
      return t ? std::optional((*t).*value) : std::nullopt;
    };
    result.measures.push_back(
        {along, of(paths.euclidean, &Tortuosity::mean), "-",
         fmt::format(
             "geodesic tortuosity: shortest way through the {0} from the lower face along {1} to a voxel of "
             "the "
             "upper one, mean over the voxels reached, over the straight way; fast marching (Sethian 1996). "
             "null: the {0} does not percolate along {1}",
             paths.name, axis_names[paths.axis])});
    result.measures.push_back({along + "_steps", of(paths.steps, &Tortuosity::mean), "-",
                               "the same by steps between face neighbours, the burning of Herrmann et al. "
                               "1984 and of Blatny et al. 2021, Fig. "
                               "B.16b: oblique ways are too long by up to sqrt(3)"});
    result.measures.push_back({along + "_least", of(paths.euclidean, &Tortuosity::least), "-",
                               "the same of the shortest way of all, by fast marching"});
  }
}

}  // namespace anticrack
