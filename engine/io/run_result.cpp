#include "io/run_result.h"

#include <nlohmann/json.hpp>

#include "files/atomic_file.h"

namespace anticrack {
namespace {

// The library itself writes numbers that are not finite as null.
nlohmann::ordered_json number_or_null(const std::optional<double>& value) {
  return value ? nlohmann::ordered_json(*value) : nlohmann::ordered_json(nullptr);
}

}  // namespace

void write_run_result(const RunResult& result, const std::filesystem::path& file) {
  nlohmann::ordered_json json;
  json["loading"] = result.loading;
  json["walls"] = result.walls;
  json["wall_rule"] = result.wall_rule;
  json["stopped_by"] = result.stopped_by;
  json["K"] = number_or_null(result.K);
  json["G"] = number_or_null(result.G);
  json["failure"] = nullptr;
  if (const auto& failure = result.failure) {
    json["failure"] = {{"strain", failure->strain},
                       {"p", failure->p},
                       {"q", failure->q},
                       {"step", failure->step},
                       {"time", failure->time}};
  }
  json["particles"] = result.particles;
  json["steps"] = result.steps;
  json["wall_seconds"] = result.wall_seconds;
  json["particle_steps_per_second"] = result.particle_steps_per_second;
  json["solid_fraction"] = {{"asked", number_or_null(result.solid_fraction_asked)},
                            {"achieved", result.solid_fraction_achieved}};
  json["quasi_static"] = {{"kinetic_over_internal", result.quasi_static.kinetic_over_internal},
                          {"wall_over_volume_stress", result.quasi_static.wall_over_volume_stress},
                          {"energy_residual", result.quasi_static.energy_residual},
                          {"wave_passages", result.quasi_static.wave_passages},
                          {"verdict", result.quasi_static.verdict}};
  // Labels come from scenes: bytes that are not UTF-8 must not cost the result of a run.
  write_text_atomically(file,
                        json.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n");
}

}  // namespace anticrack
