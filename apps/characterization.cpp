#include "characterization.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "io/provenance.h"

namespace anticrack {

namespace {

using Json = nlohmann::ordered_json;

template <class Named>
const Named* find_named(const std::vector<Named>& all, std::string_view name) {
  const auto found = std::ranges::find(all, name, &Named::name);
  return found == all.end() ? nullptr : &*found;
}

Json number_or_null(const std::optional<double>& value) {
  return value && std::isfinite(*value) ? Json(*value) : Json(nullptr);
}

}  // namespace

const MeasuredValue* Characterization::find(std::string_view name) const {
  return find_named(measures, name);
}

const MeasuredCurve* Characterization::find_curve(std::string_view name) const {
  return find_named(curves, name);
}

std::string to_json(const Characterization& characterization) {
  Json json;
  json["input"] = characterization.input;
  json["program"] = program_version();
  Json& counts = json["counts"] = Json::object();
  for (const auto& [name, count] : characterization.counts) counts[name] = count;
  Json& measures = json["measures"] = Json::object();
  for (const MeasuredValue& measure : characterization.measures) {
    Json& entry = measures[measure.name];
    entry["value"] = number_or_null(measure.value);
    entry["unit"] = measure.unit;
    entry["definition"] = measure.definition;
    if (measure.theory) entry["theory"] = number_or_null(measure.theory);
  }
  Json& curves = json["curves"] = Json::object();
  for (const MeasuredCurve& curve : characterization.curves)
    curves[curve.name] = {{"x", curve.x_name},        {"x_unit", curve.x_unit},
                          {"y", curve.y_name},        {"y_unit", curve.y_unit},
                          {"points", curve.x.size()}, {"definition", curve.definition}};
  Json& seconds = json["seconds"] = Json::object();
  for (const auto& [name, time] : characterization.seconds) seconds[name] = std::round(1e3 * time) * 1e-3;
  return json.dump(2) + "\n";
}

std::string to_csv(const Characterization& characterization) {
  std::string csv = "curve,x,x_unit,y,y_unit,theory\n";
  for (const MeasuredCurve& curve : characterization.curves)
    for (std::size_t i = 0; i < curve.x.size(); ++i)
      csv += fmt::format("{},{:.17g},{},{:.17g},{},{}\n", curve.name, curve.x[i], curve.x_unit, curve.y[i],
                         curve.y_unit,
                         curve.theory.empty() ? std::string() : fmt::format("{:.17g}", curve.theory[i]));
  return csv;
}

}  // namespace anticrack
