#include "loading_advice.h"

#include <fmt/format.h>

#include "observables/loading_law.h"
#include "progress.h"
#include "time_step.h"

namespace anticrack {

namespace {

double wall_speed(const SimulationSetup& setup) {
  if (const auto* confined = std::get_if<ConfinedCompression>(&setup.loading)) return confined->speed;
  const auto& triaxial = std::get<TriaxialLoading>(setup.loading);
  const Vec3 factor(triaxial.beta2 + triaxial.beta1, triaxial.beta2 - triaxial.beta1, triaxial.beta2);
  return triaxial.strain_rate * factor.cwiseProduct(setup.box_size).cwiseAbs().maxCoeff();
}

/// "loading.speed=0.62" or "loading.strain_rate=0.0005", `times` as fast as it stands.
std::string as_key(const Loading& loading, double times) {
  if (const auto* confined = std::get_if<ConfinedCompression>(&loading))
    return fmt::format("loading.speed={:.3g}", times * confined->speed);
  return fmt::format("loading.strain_rate={:.3g}", times * std::get<TriaxialLoading>(loading).strain_rate);
}

std::string percent(double share) {
  return share < 0.3 ? fmt::format("up to {:.2g} %", 100 * share) : std::string("more than 30 %");
}

}  // namespace

double strain_rate(const SimulationSetup& setup) {
  if (const auto* confined = std::get_if<ConfinedCompression>(&setup.loading))
    return (confined->both_platens ? 2 : 1) * confined->speed / setup.box_size[confined->axis];
  const auto& triaxial = std::get<TriaxialLoading>(setup.loading);
  const Vec3 factor(triaxial.beta2 + triaxial.beta1, triaxial.beta2 - triaxial.beta1, triaxial.beta2);
  return 2 * triaxial.strain_rate * factor.cwiseAbs().maxCoeff();
}

double expected_failure_strain(const Material& material, const Loading& loading) {
  const bool confined = std::holds_alternative<ConfinedCompression>(loading);
  return (confined ? loading_law::confined_failure_strain : loading_law::triaxial_failure_strain) *
         material.plasticity->cohesion / material.elasticity.young_modulus;
}

std::string loading_advice(const SimulationSetup& setup, double until_strain, double seconds) {
  using namespace loading_law;
  const double c = elastic_wave_speed(setup.material), passage = setup.box_size.maxCoeff() / c;
  std::string text = fmt::format("loading: walls at {:.3g} m/s, {:.2g} of the elastic wave speed; ",
                                 wall_speed(setup), wall_speed(setup) / c);
  if (const auto& plasticity = setup.material.plasticity; !plasticity || plasticity->cohesion == 0)
    return text + fmt::format("{:.3g} of strain in one passage of the wave\n", strain_rate(setup) * passage);
  const double strain = expected_failure_strain(setup.material, setup.loading);
  const double passages = strain / (strain_rate(setup) * passage);
  text += fmt::format(
      "failure expected near strain {:.2g}, after {:.3g} passages of the wave\n"
      "error: {} in the moduli, {} in the failure stress\n",
      strain, passages, percent(modulus_error(passages)), percent(failure_stress_error(passages)));
  const auto line = [&](const char* what, double needed) {
    const double times = passages / needed;
    text += fmt::format("  {:<32} --set {}, {}", what, as_key(setup.loading, times),
                        duration_text(seconds / times));
    if (strain < 0.5 * until_strain)
      text += fmt::format(", of which {} to failure", duration_text(seconds / times * strain / until_strain));
    text += '\n';
  };
  for (const double error : {0.05, 0.01})
    line(fmt::format("moduli within {:.0f} %:", 100 * error).c_str(), passages_for_modulus(error));
  for (const double error : {0.05, 0.01})
    line(fmt::format("failure stress within {:.0f} %:", 100 * error).c_str(),
         passages_for_failure_stress(error));
  return text;
}

}  // namespace anticrack
