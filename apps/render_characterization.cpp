#include "render_characterization.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "io/provenance.h"
#include "plot.h"

namespace anticrack {

namespace {

// Lengths of samples differ by powers of ten: plots choose their unit.
struct Scale {
  const char* unit;
  double metres;
};

Scale length_scale(double largest) {
  for (const Scale scale : {Scale{"m", 1.0}, {"mm", 1e-3}, {"\u00b5m", 1e-6}})
    if (largest >= scale.metres) return scale;
  return {"nm", 1e-9};
}

struct Wanted {
  const char* curve;
  const char* label;
  bool with_theory = false;
};

bool has_numbers(const MeasuredCurve& curve) {
  return std::ranges::any_of(curve.y, [](double y) { return std::isfinite(y); });
}

/// The curves that the characterization has, or nothing if it has none of them.
std::optional<Plot> plot_of(const Characterization& c, const char* title, const char* y_label,
                            std::initializer_list<Wanted> wanted) {
  Plot plot{"", y_label, {}};
  plot.title = title;
  double largest = 0;
  bool lengths = false;
  std::string x_name;
  for (const Wanted& want : wanted)
    if (const MeasuredCurve* curve = c.find_curve(want.curve); curve && has_numbers(*curve)) {
      largest = std::max(largest, *std::ranges::max_element(curve->x));
      lengths = curve->x_unit == "m";
      x_name = curve->x_name;
    }
  if (x_name.empty()) return {};
  const Scale scale = lengths ? length_scale(largest) : Scale{"", 1.0};
  if (lengths && plot.y_label.starts_with("share")) plot.y_label += fmt::format(" [1/{}]", scale.unit);
  plot.x_label = lengths ? fmt::format("{} [{}]", x_name, scale.unit) : x_name;
  for (const Wanted& want : wanted) {
    const MeasuredCurve* curve = c.find_curve(want.curve);
    if (!curve || !has_numbers(*curve)) continue;
    std::vector<double> x, y = curve->y;
    for (const double value : curve->x) x.push_back(value / scale.metres);
    if (curve->y_unit == "1/m")  // densities over a length: per unit of the axis
      for (double& value : y) value *= scale.metres;
    plot.curves.push_back({want.label, x, y});
    if (want.with_theory && !curve->theory.empty()) plot.curves.push_back({"theory", x, curve->theory});
  }
  return plot;
}

std::string number(double value) {
  return fmt::format("{:.4g}", value);
}

Table table_of(const Characterization& c) {
  Table table;
  const auto add = [&](const char* text, const char* name) {
    const MeasuredValue* measure = c.find(name);
    if (!measure) return;
    std::string value = measure->value && std::isfinite(*measure->value) ? number(*measure->value) : "none";
    if (measure->unit != "-") value += " " + measure->unit;
    if (measure->theory) value += fmt::format("  (theory {})", number(*measure->theory));
    table.push_back({text, value});
  };
  add("solid fraction", "solid_fraction");
  add("percolating solid fraction", "percolating_solid_fraction");
  add("SSA, mesh", "ssa_mesh");
  add("SSA, Crofton", "ssa_crofton");
  add("SSA, slope of g", "ssa_slope");
  add("SSA, the paper's way", "ssa_paper");
  add("Euler number density", "euler_density");
  add("correlation length", "correlation_length");
  add("mean pore size", "pore_size_mean");
  add("mean solid size", "solid_size_mean");
  add("pore tortuosity, y", "pore_tortuosity_y");
  add("solid tortuosity, y", "solid_tortuosity_y");
  add("edge for 5 % in solid fraction", "representative_edge_5_percent");
  return table;
}

}  // namespace

std::string draw_characterization(const Characterization& c) {
  Page page{plain_text(std::filesystem::path(c.input).filename().string()), {}, 2};
  page.cells.push_back(table_of(c));
  const auto add = [&](std::optional<Plot> plot) {
    if (plot) page.cells.push_back(std::move(*plot));
  };
  add(plot_of(c, "Two-point correlation", "g_{norm}", {{"correlation_normalized", "radial", true}}));
  add(plot_of(c, "Along the axes", "g",
              {{"correlation_x", "x"},
               {"correlation_y", "y"},
               {"correlation_z", "z"},
               {"correlation_periodic", "radial, periodic"}}));
  add(plot_of(c, "Size distribution", "share of the volume",
              {{"pore_size", "pores"}, {"solid_size", "solid"}}));
  add(plot_of(c, "Chord lengths, pores", "share of the chords",
              {{"pore_chords_x", "x"}, {"pore_chords_y", "y"}, {"pore_chords_z", "z"}}));
  add(plot_of(c, "Chord lengths, solid", "share of the chords",
              {{"solid_chords_x", "x"}, {"solid_chords_y", "y"}, {"solid_chords_z", "z"}}));
  if (auto plot = plot_of(c, "Representative volume", "deviation of the solid fraction",
                          {{"representative_volume", "cubes", true}})) {
    plot->log_x = plot->log_y = true;
    page.cells.push_back(std::move(*plot));
  }
  return draw_page(page, DocumentFormat::png, 1800,
                   {{"Software", "anticrack " + std::string(program_version())}});
}

}  // namespace anticrack
