#include "loading_advice.h"

#include <gtest/gtest.h>

#include <regex>

#include "observables/loading_law.h"

namespace anticrack {
namespace {

SimulationSetup setup_with(const Loading& loading) {
  const Material solid{1e4, {10e9, 0.3}, DruckerPragerSoftening{1.2, 2.5e6, 1e6}};
  return {Vec3(1, 2, 1), 1e-3, 0.2, solid, loading, {}};
}

/// The rate that a line of the advice names.
double rate_after(const std::string& text, const std::string& start) {
  std::smatch found;
  const std::regex line(start + ".*--set loading\\.(?:speed|strain_rate)=([0-9.e+-]+)");
  return std::regex_search(text, found, line) ? std::stod(found[1]) : 0;
}

TEST(LoadingAdvice, RatesThatItNamesHaveTheErrorsThatItNames) {
  SimulationSetup setup = setup_with(TriaxialLoading{0, -1, 5e-4, WallKind::sticky});
  const std::string advice = loading_advice(setup, 2e-4, 100);
  for (const auto& [line, error] : {std::pair{"failure stress within 5 %", "5 % in the failure stress"},
                                    {"moduli within 1 %", "1 % in the moduli"},
                                    {"moduli within 5 %", "5 % in the moduli"}}) {
    std::get<TriaxialLoading>(setup.loading).strain_rate = rate_after(advice, line);
    const std::string then = loading_advice(setup, 2e-4, 100);
    EXPECT_NE(then.find(error), std::string::npos) << line << "\n" << advice << then;
  }
}

TEST(LoadingAdvice, FollowsThePassagesOfTheWaveWhateverTheLoadingIsCalled) {
  // Two platens at 1 mm/s on 2 m and walls at 5e-4 / s: the same rate of strain.
  const auto passages = [](const std::string& text) {
    return std::stod(text.substr(text.find("after ") + 6));
  };
  const std::string platens = loading_advice(setup_with(ConfinedCompression{1, true, 1e-3}), 2e-4, 100),
                    walls =
                        loading_advice(setup_with(TriaxialLoading{0, -1, 5e-4, WallKind::sticky}), 2e-4, 100);
  // Confined compression fails later. Three digits are printed.
  EXPECT_NEAR(passages(platens) / passages(walls),
              loading_law::confined_failure_strain / loading_law::triaxial_failure_strain, 0.01);
  EXPECT_NE(platens.find("--set loading.speed="), std::string::npos) << platens;
  EXPECT_NE(walls.find("--set loading.strain_rate="), std::string::npos) << walls;
}

TEST(LoadingAdvice, AnElasticSolidHasNoFailureToSpeakOf) {
  SimulationSetup setup = setup_with(ConfinedCompression{1, false, 5});
  setup.material.plasticity.reset();
  const std::string advice = loading_advice(setup, 2e-4, 100);
  EXPECT_EQ(advice.find("failure"), std::string::npos) << advice;
  EXPECT_NE(advice.find("of strain in one passage"), std::string::npos) << advice;
}

}  // namespace
}  // namespace anticrack
