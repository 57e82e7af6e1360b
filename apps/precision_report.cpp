#include "precision_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>

#include "errors.h"

namespace anticrack {

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

const Measure* find_measure(const PrecisionResult& result, const std::string& name) {
  for (const Measure& measure : result.solution.measures)
    if (measure.name == name) return &measure;
  return nullptr;
}

std::string time_step_name(const Numerics& numerics) {
  return numerics.time_step == TimeStepRule::safe ? "safe" : "paper";
}

std::string transfer_name(const Numerics& numerics) {
  if (numerics.transfer == TransferScheme::apic) return "apic";
  if (numerics.flip_time) return fmt::format("flip_time {:g} s", *numerics.flip_time);
  return numerics.flip == 0 ? "pic" : fmt::format("flip {:g}", numerics.flip);
}

/// null for what JSON has no number for.
nlohmann::ordered_json number(double x) {
  return std::isfinite(x) ? nlohmann::ordered_json(x) : nlohmann::ordered_json();
}

}  // namespace

double error_of(const Measure& measure) {
  return measure.exact == 0 ? std::abs(measure.value) : std::abs(measure.value / measure.exact - 1);
}

void extrapolate_references(std::span<PrecisionResult> results) {
  for (const std::string name : {"K", "G"}) {
    std::map<int, double> by_cells;
    for (const PrecisionResult& result : results)
      if (result.c.problem == "porous" && result.c.variant.empty())
        if (const Measure* measure = find_measure(result, name))
          by_cells[result.c.knobs.cells] = measure->value;
    if (!(by_cells.contains(12) && by_cells.contains(24) && by_cells.contains(48))) continue;
    const double change = by_cells[48] - by_cells[24], ratio = (by_cells[24] - by_cells[12]) / change;
    if (!(ratio > 1.2)) continue;
    for (PrecisionResult& result : results)
      if (result.c.problem == "porous")
        for (Measure& measure : result.solution.measures)
          if (measure.name == name) measure.exact = by_cells[48] + change / (ratio - 1);
  }
}

std::vector<WorkPoint> work_points(std::span<const PrecisionResult> results, const std::string& problem,
                                   const std::string& measure, Cost cost) {
  std::vector<WorkPoint> points;
  for (const PrecisionResult& result : results) {
    if (result.c.problem != problem) continue;
    const Measure* found = find_measure(result, measure);
    if (!found && result.failure.empty()) continue;
    double error = found ? error_of(*found) : infinity;
    if (std::isnan(error) && result.failure.empty()) continue;  // nothing to compare with
    if (!(error <= 1)) error = infinity;
    const Solution& solution = result.solution;
    points.push_back(
        {&result,
         cost == Cost::seconds ? solution.seconds : double(solution.particles) * double(solution.steps),
         error, false});
  }
  std::stable_sort(points.begin(), points.end(),
                   [](const WorkPoint& a, const WorkPoint& b) { return a.cost < b.cost; });
  double best = infinity;
  for (WorkPoint& point : points) {
    point.on_front = point.error < best;
    best = std::min(best, point.error);
  }
  return points;
}

std::optional<double> observed_order(std::span<const WorkPoint> points, const std::string& variant) {
  std::map<int, double> error_at;
  for (const WorkPoint& point : points)
    if (point.result->c.variant == variant && point.result->c.knobs.numerics.grid_offset[0] == 0)
      error_at[point.result->c.knobs.cells] = point.error;
  if (error_at.size() < 3) return {};
  double sx = 0, sy = 0, sxx = 0, sxy = 0;
  auto finest = error_at.rbegin();
  for (int n = 0; n < 3; ++n, ++finest) {
    if (!std::isfinite(finest->second)) return {};
    const double x = std::log(double(finest->first)), y = std::log(finest->second);
    sx += x, sy += y, sxx += x * x, sxy += x * y;
  }
  return -(3 * sxy - sx * sy) / (3 * sxx - sx * sx);
}

std::optional<double> cost_for(std::span<const WorkPoint> points, double error) {
  const WorkPoint* before = nullptr;
  for (const WorkPoint& point : points) {
    if (!point.on_front) continue;
    if (point.error <= error) {
      if (!before) return point.cost;
      const double t = std::log(before->error / error) / std::log(before->error / point.error);
      return before->cost * std::pow(point.cost / before->cost, t);
    }
    before = &point;
  }
  return {};
}

std::vector<std::pair<std::string, std::vector<std::string>>> problems_and_measures(
    std::span<const PrecisionResult> results) {
  std::vector<std::pair<std::string, std::vector<std::string>>> all;
  for (const PrecisionResult& result : results) {
    if (all.empty() || all.back().first != result.c.problem) all.push_back({result.c.problem, {}});
    for (const Measure& measure : result.solution.measures) {
      auto& names = all.back().second;
      if (std::find(names.begin(), names.end(), measure.name) == names.end()) names.push_back(measure.name);
    }
  }
  return all;
}

std::string to_csv(std::span<const PrecisionResult> results) {
  std::string csv =
      "problem,variant,cells,particles_per_direction,time_step,time_step_factor,transfer,wall_rule,"
      "return_mapping,grid_offset,transits,particles,steps,particle_steps,seconds,runs,measure,value,exact,"
      "error,failure\n";
  for (const PrecisionResult& r : results) {
    const Knobs& k = r.c.knobs;
    const std::string row =
        fmt::format("{},{},{},{},{},{:g},{},{},{},{:g},{:g},{},{},{},{:.6g},{}", r.c.problem, r.c.variant,
                    k.cells, k.per_direction, time_step_name(k.numerics), k.numerics.time_step_factor,
                    transfer_name(k.numerics), k.numerics.wall_rule == WallRule::ghost ? "ghost" : "paper",
                    k.numerics.return_mapping == ReturnMapping::implicit ? "implicit" : "paper",
                    k.numerics.grid_offset[0], k.transits, r.solution.particles, r.solution.steps,
                    r.solution.particles * r.solution.steps, r.solution.seconds, r.runs);
    for (const Measure& m : r.solution.measures)
      csv += fmt::format("{},{},{:.8g},{:.8g},{:.6g},\n", row, m.name, m.value, m.exact, error_of(m));
    if (!r.failure.empty()) csv += fmt::format("{},,,,,\"{}\"\n", row, r.failure);
  }
  return csv;
}

std::string to_json(std::span<const PrecisionResult> results, bool quick) {
  nlohmann::ordered_json json;
  json["quick"] = quick;
  json["cases"] = nlohmann::ordered_json::array();
  for (const PrecisionResult& r : results) {
    nlohmann::ordered_json entry{{"name", r.c.name()},
                                 {"problem", r.c.problem},
                                 {"variant", r.c.variant},
                                 {"cells", r.c.knobs.cells},
                                 {"particles", r.solution.particles},
                                 {"steps", r.solution.steps},
                                 {"seconds", r.solution.seconds},
                                 {"runs", r.runs}};
    entry["measures"] = nlohmann::ordered_json::array();
    for (const Measure& m : r.solution.measures)
      entry["measures"].push_back({{"name", m.name},
                                   {"value", number(m.value)},
                                   {"exact", number(m.exact)},
                                   {"error", number(error_of(m))}});
    if (!r.failure.empty()) entry["failure"] = r.failure;
    json["cases"].push_back(entry);
  }
  json["summary"] = nlohmann::ordered_json::array();
  for (const auto& [problem, measures] : problems_and_measures(results))
    for (const std::string& measure : measures) {
      const auto points = work_points(results, problem, measure);
      nlohmann::ordered_json entry{{"problem", problem}, {"measure", measure}};
      if (const auto order = observed_order(points, "")) entry["observed_order"] = *order;
      for (const double error : {0.05, 0.01, 0.001})
        if (const auto seconds = cost_for(points, error))
          entry[fmt::format("seconds_for_{:g}", error)] = *seconds;
      json["summary"].push_back(entry);
    }
  return json.dump(1) + "\n";
}

std::vector<PrecisionResult> from_json(const std::string& text, const std::string& file, bool& quick) {
  std::vector<PrecisionResult> results;
  try {
    const auto json = nlohmann::json::parse(text);
    quick = json.at("quick");
    std::map<std::string, PrecisionCase> known;
    for (const PrecisionCase& c : precision_cases(quick)) known[c.name()] = c;
    for (const auto& entry : json.at("cases")) {
      const auto found = known.find(entry.at("name"));
      if (found == known.end()) continue;  // of another version of the study
      PrecisionResult r{found->second, {}, entry.at("runs"), entry.value("failure", std::string())};
      r.solution.particles = entry.at("particles"), r.solution.steps = entry.at("steps");
      r.solution.seconds = entry.at("seconds");
      const auto value = [](const nlohmann::json& j) {
        return j.is_null() ? std::numeric_limits<double>::quiet_NaN() : j.get<double>();
      };
      for (const auto& m : entry.at("measures"))
        r.solution.measures.push_back({m.at("name"), value(m.at("value")), value(m.at("exact"))});
      results.push_back(r);
    }
  } catch (const nlohmann::json::exception& error) {
    throw FileError(fmt::format("{}: no results of this command: {}", file, error.what()));
  }
  return results;
}

std::string summary(std::span<const PrecisionResult> results) {
  std::string text = fmt::format("{:<12}{:<14}{:>7}{:>22}{:>13}\n", "problem", "measure", "order",
                                 "finest grid's error", "1 % costs");
  for (const auto& [problem, measures] : problems_and_measures(results))
    for (const std::string& measure : measures) {
      const auto points = work_points(results, problem, measure);
      const WorkPoint* finest = nullptr;
      for (const WorkPoint& point : points)
        if (point.result->c.variant.empty() &&
            (!finest || point.result->c.knobs.cells >= finest->result->c.knobs.cells))
          finest = &point;
      const auto order = observed_order(points, "");
      const auto seconds = cost_for(points, 0.01);
      text += fmt::format(
          "{:<12}{:<14}{:>7}{:>22}{:>13}\n", problem, measure, order ? fmt::format("{:.2f}", *order) : "-",
          finest ? fmt::format("{:.2e} at {} cells", finest->error, finest->result->c.knobs.cells) : "-",
          seconds ? fmt::format("{:.2g} s", *seconds) : "-");
    }
  for (const PrecisionResult& r : results)
    if (!r.failure.empty()) text += fmt::format("failed: {}: {}\n", r.c.name(), r.failure);
  for (const std::string problem : {"void_0.3", "porous"})
    if (const auto seconds = cost_for(work_points(results, problem, "K"), 0.01))
      text += fmt::format("1 % in K costs {:.2g} s ({}, one thread)\n", *seconds, problem);
  return text;
}

}  // namespace anticrack
