#include "loading_study.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <vector>

#include "common_options.h"
#include "errors.h"
#include "files/atomic_file.h"
#include "loading_cases.h"
#include "observables/loading_law.h"
#include "observables/observer.h"
#include "output_folder.h"
#if ANTICRACK_RENDER
#include "plot.h"
#endif

namespace anticrack {

namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

/// A case beside the slowest of its series. Errors are signed and relative.
struct LoadingError {
  LoadingCase at;
  double modulus, stress, strain, peak_stress, speed_up;
};

constexpr std::pair<const char*, double LoadingCase::*> numbers[] = {
    {"strain_rate", &LoadingCase::strain_rate},
    {"wall_speed_over_wave_speed", &LoadingCase::wall_speed},
    {"wave_passages", &LoadingCase::passages},
    {"modulus", &LoadingCase::modulus},
    {"failure_stress", &LoadingCase::stress},
    {"failure_strain", &LoadingCase::strain},
    {"peak_stress", &LoadingCase::peak_stress},
    {"peak_strain", &LoadingCase::peak_strain},
    {"kinetic_over_internal", &LoadingCase::kinetic_over_internal},
    {"wall_over_volume_stress", &LoadingCase::wall_over_volume},
    {"energy_residual", &LoadingCase::energy_residual},
    {"steps", &LoadingCase::steps},
    {"seconds", &LoadingCase::seconds},
};
constexpr std::pair<const char*, double LoadingError::*> errors[] = {
    {"modulus_error", &LoadingError::modulus},       {"failure_stress_error", &LoadingError::stress},
    {"failure_strain_error", &LoadingError::strain}, {"peak_stress_error", &LoadingError::peak_stress},
    {"speed_up", &LoadingError::speed_up},
};

/// What result.json would have said at failure.
std::string verdict_of(const LoadingCase& c) {
  return quasi_static_verdict({c.kinetic_over_internal,
                               c.wall_over_volume,
                               c.energy_residual,
                               c.passages,
                               std::isfinite(c.stress),
                               {}});
}

Json to_json(const LoadingCase& c) {
  Json json{{"sample", c.sample}, {"loading", c.loading}, {"rate", c.rate}};
  for (const auto& [name, member] : numbers) json[name] = c.*member;
  return json;
}

LoadingCase read_case(const fs::path& file) {
  try {
    const Json json = Json::parse(std::ifstream(file));
    LoadingCase c{};
    c.sample = json.at("sample"), c.loading = json.at("loading"), c.rate = json.at("rate");
    for (const auto& [name, member] : numbers)
      c.*member = json.at(name).is_null() ? std::nan("") : json.at(name).get<double>();
    return c;
  } catch (const Json::exception& error) {
    throw FileError(fmt::format("{}: {}; remove it to run this case again.", file.string(), error.what()));
  }
}

/// The case from its file, or from a run.
LoadingCase case_of(const LoadingSeries& series, int rate, const fs::path& folder) {
  std::string name = fmt::format("{} {} {}", series.sample, series.loading, rate);
  for (char& c : name)
    if (c == ' ' || c == '/' || c == ',') c = '_';
  const fs::path file = folder / (name + ".json");
  if (fs::exists(file)) return read_case(file);
  const LoadingCase result = run_loading_case(series, rate);
  write_text_atomically(file, to_json(result).dump(2) + "\n");
  return result;
}

std::vector<LoadingError> errors_of_series(const std::vector<LoadingCase>& cases) {
  const LoadingCase& slowest = cases.front();
  std::vector<LoadingError> result;
  for (const LoadingCase& c : cases)
    result.push_back({c, c.modulus / slowest.modulus - 1, c.stress / slowest.stress - 1,
                      c.strain / slowest.strain - 1, c.peak_stress / slowest.peak_stress - 1,
                      slowest.seconds / c.seconds});
  return result;
}

void write_table(const std::vector<LoadingError>& all, const fs::path& folder) {
  std::string csv = "sample,loading,rate";
  for (const auto& [name, member] : numbers) csv += fmt::format(",{}", name);
  for (const auto& [name, member] : errors) csv += fmt::format(",{}", name);
  csv += ",verdict\n";
  Json json = Json::array();
  for (const LoadingError& e : all) {
    csv += fmt::format("\"{}\",{},{}", e.at.sample, e.at.loading, e.at.rate);
    for (const auto& [name, member] : numbers) csv += fmt::format(",{:.6g}", e.at.*member);
    for (const auto& [name, member] : errors) csv += fmt::format(",{:.4g}", e.*member);
    csv += fmt::format(",\"{}\"\n", verdict_of(e.at));
    Json row = to_json(e.at);
    row["verdict"] = verdict_of(e.at);
    for (const auto& [name, member] : errors) row[name] = e.*member;
    json.push_back(row);
  }
  write_text_atomically(folder / "loading.csv", csv);
  write_text_atomically(folder / "loading.json", json.dump(2) + "\n");
}

struct MedianAndWorst {
  double median, worst;
};

MedianAndWorst sizes(const std::vector<LoadingError>& all, double LoadingError::*error) {
  std::vector<double> size;
  for (const LoadingError& e : all)
    if (std::isfinite(e.*error)) size.push_back(std::abs(e.*error));
  if (size.empty()) return {std::nan(""), std::nan("")};
  std::sort(size.begin(), size.end());
  return {size[size.size() / 2], size.back()};
}

/// Errors by passages of the wave before failure, in bins of a factor of two.
void print_law(const std::vector<LoadingError>& all) {
  fmt::print("{:<18}{:>6}{:>18}{:>18}{:>18}{:>18}{:>14}{:>10}\n", "wave passages", "cases", "modulus",
             "failure stress", "failure strain", "peak stress", "not quasi-s.", "speed-up");
  for (double from = 256; from >= 2; from /= 2) {
    std::vector<LoadingError> bin;
    int refused = 0;
    for (const LoadingError& e : all)
      if (e.speed_up != 1 && e.at.passages >= from && e.at.passages < 2 * from) {
        bin.push_back(e);
        refused += verdict_of(e.at).starts_with("not");
      }
    if (bin.empty()) continue;
    fmt::print("{:<18}{:>6}", fmt::format("{:.0f} to {:.0f}", from, 2 * from), bin.size());
    for (const auto member :
         {&LoadingError::modulus, &LoadingError::stress, &LoadingError::strain, &LoadingError::peak_stress}) {
      const auto [median, worst] = sizes(bin, member);
      fmt::print("{:>18}", fmt::format("{:.1f} % ({:.1f} %)", 100 * median, 100 * worst));
    }
    fmt::print("{:>14}{:>10.3g}\n", refused, sizes(bin, &LoadingError::speed_up).median);
  }
  fmt::print(
      "median (worst) of the errors, and median of the speed-up, against the slowest run of each series\n");
}

#if ANTICRACK_RENDER
/// A picture a loading and quantity: errors against passages in decades, beside the law.
void draw(const std::vector<std::vector<LoadingError>>& series, const fs::path& folder) {
  struct Quantity {
    const char *name, *label;
    double LoadingError::*error;
    double (*law)(double wave_passages);
  };
  constexpr Quantity quantities[] = {
      {"modulus", "modulus", &LoadingError::modulus, loading_law::modulus_error},
      {"failure_stress", "failure stress", &LoadingError::stress, loading_law::failure_stress_error},
      {"failure_strain", "failure strain", &LoadingError::strain, nullptr},
  };
  for (const char* loading : {"isotropic", "confined", "shear"})
    for (const Quantity& quantity : quantities) {
      Plot plot{"log_{10} of the wave's passages before failure",
                fmt::format("log_{{10}} error [%]: {}, {}", quantity.label, loading),
                {}};
      for (const auto& cases : series) {
        if (cases.front().at.loading != loading) continue;
        Curve curve{cases.front().at.sample, {}, {}};
        for (const LoadingError& e : cases) {
          curve.x.push_back(std::log10(e.at.passages));
          curve.y.push_back(std::log10(100 * std::abs(e.*quantity.error)));
        }
        plot.curves.push_back(std::move(curve));
      }
      if (quantity.law) {
        Curve law{"advice", {}, {}};
        for (const double passages : {2.0, 256.0}) {
          law.x.push_back(std::log10(passages));
          law.y.push_back(std::log10(100 * quantity.law(passages)));
        }
        plot.curves.push_back(std::move(law));
      }
      write_text_atomically(folder / fmt::format("loading_{}_{}.png", loading, quantity.name),
                            draw_plot(plot, DocumentFormat::png));
    }
}
#endif

}  // namespace

void study_loading(const fs::path& folder, const ProgressOptions& options) {
  const fs::path case_folder = folder / "loading";
  fs::create_directories(case_folder);
  const FolderLock lock(case_folder);
  const ThreadLimit limit(1);
  Progress progress(options);
  const auto all_series = loading_series();
  int count = 0, done = 0;
  for (const LoadingSeries& s : all_series) count += 1 + int(std::log2(s.fastest / s.slowest));
  std::vector<std::vector<LoadingError>> series;
  std::vector<LoadingError> all;
  for (const LoadingSeries& s : all_series) {
    std::vector<LoadingCase> cases;
    for (int rate = s.slowest; rate <= s.fastest; rate *= 2) {
      cases.push_back(case_of(s, rate, case_folder));
      const LoadingCase& c = cases.back();
      progress.message(fmt::format(
          "{} of {}: {}, {}, {} times the paper's rate: failed after {:.1f} wave passages, {:.3g} s", ++done,
          count, c.sample, c.loading, rate, c.passages, c.seconds));
    }
    series.push_back(errors_of_series(cases));
    all.insert(all.end(), series.back().begin(), series.back().end());
  }
  write_table(all, folder);
#if ANTICRACK_RENDER
  draw(series, folder);
#endif
  print_law(all);
}

}  // namespace anticrack
