#include "render_precision.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "files/atomic_file.h"
#include "io/provenance.h"
#include "plot.h"

namespace anticrack {

namespace {

std::string label_of(const std::string& variant) {
  return variant.empty() ? "defaults" : plain_text(variant);
}

std::string error_label(const std::string& measure) {
  const bool of_particles = measure == "displacement" || measure == "stress" || measure == "kappa";
  std::string what = measure == "kappa" ? "\u03ba" : measure;
  std::replace(what.begin(), what.end(), '_', ' ');
  return fmt::format("relative {}error of {}", of_particles ? "L_2 " : "", what);
}

/// One curve a variant through its points in order of `x`.
template <class X>
std::vector<Curve> curves_by_variant(const std::vector<WorkPoint>& points, X x) {
  std::vector<std::string> variants;
  for (const WorkPoint& point : points)
    if (std::find(variants.begin(), variants.end(), point.result->c.variant) == variants.end())
      variants.push_back(point.result->c.variant);
  std::sort(variants.begin(), variants.end());  // the defaults, "", first
  std::vector<Curve> curves;
  for (const std::string& variant : variants) {
    std::vector<const WorkPoint*> chosen;
    for (const WorkPoint& point : points)
      if (point.result->c.variant == variant) chosen.push_back(&point);
    std::stable_sort(chosen.begin(), chosen.end(), [&](auto* a, auto* b) { return x(*a) < x(*b); });
    Curve curve{label_of(variant), {}, {}};
    for (const WorkPoint* point : chosen) {
      curve.x.push_back(x(*point));
      curve.y.push_back(point->error);
      curve.markers.push_back(!std::isfinite(point->error) ? Marker::cross
                              : point->on_front            ? Marker::filled
                                                           : Marker::hollow);
    }
    curves.push_back(curve);
  }
  return curves;
}

Plot logarithmic_plot(const std::string& x_label, const std::string& measure,
                      const std::vector<WorkPoint>& points) {
  const bool failed =
      std::any_of(points.begin(), points.end(), [](auto& p) { return !std::isfinite(p.error); });
  Plot plot{x_label, error_label(measure) + (failed ? "  (\u00d7 failed)" : ""), {}};
  plot.log_x = plot.log_y = plot.legend_beside = true;
  return plot;
}

/// Error against cost. Filled points are on the front; a cross at the upper edge is a failure.
Plot work_diagram(const std::vector<WorkPoint>& points, const std::string& measure, const char* cost) {
  Plot plot = logarithmic_plot(cost, measure, points);
  Curve front{"Pareto front, filled", {}, {}};
  front.stroke = Stroke::broad;
  for (const WorkPoint& point : points) {
    if (!point.on_front) continue;
    front.x.push_back(point.cost);
    front.y.push_back(point.error);
  }
  plot.curves = curves_by_variant(points, [](const WorkPoint& p) { return p.cost; });
  plot.curves.push_back(front);
  return plot;
}

/// Error against cells, where there are grids to compare.
Plot order_diagram(const std::vector<WorkPoint>& points, const std::string& measure) {
  Plot plot = logarithmic_plot("cells along 1 m", measure, points);
  plot.curves = curves_by_variant(points, [](const WorkPoint& p) { return double(p.result->c.knobs.cells); });
  for (Curve& curve : plot.curves)
    for (Marker& marker : curve.markers)
      if (marker == Marker::hollow) marker = Marker::filled;
  const Curve& defaults = plot.curves.front();
  if (const auto order = observed_order(points, "")) {
    const std::size_t last = defaults.x.size() - 1;
    plot.slopes.push_back({defaults.x[last - 1], 0.6 * defaults.y[last - 1], defaults.x[last], -*order});
  }
  return plot;
}

}  // namespace

void draw_precision_diagrams(std::span<const PrecisionResult> results, const std::filesystem::path& folder) {
  for (const auto& [problem, measures] : problems_and_measures(results))
    for (const std::string& measure : measures) {
      const std::vector<WorkPoint> points = work_points(results, problem, measure);
      if (std::none_of(points.begin(), points.end(), [](const auto& p) { return std::isfinite(p.error); }))
        continue;
      const TextChunks text{{"Software", fmt::format("anticrack {}", program_version())},
                            {"Parameters", fmt::format("precision --problem {}: {}", problem, measure)}};
      const auto draw = [&](const Plot& plot, const char* kind) {
        write_text_atomically(folder / fmt::format("{}_{}_{}.png", problem, measure, kind),
                              draw_plot(plot, DocumentFormat::png, 1400, 840, text));
      };
      draw(work_diagram(points, measure, "wall time on one thread [s]"), "time");
      draw(work_diagram(work_points(results, problem, measure, Cost::particle_steps), measure,
                        "particle-steps"),
           "steps");
      if (observed_order(points, "")) draw(order_diagram(points, measure), "order");
    }
}

}  // namespace anticrack
