// Whole steps on demand, so that two builds can take turns: see compare_steps.sh.
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <iostream>
#include <string>
#include <vector>

#include "common_options.h"
#include "sample.h"
#include "scene.h"
#include "simulation.h"

namespace anticrack {
namespace {

/// Reads a number of steps a line, makes them, and answers with the ns a particle-step that they took: all
/// together, grid, walls, sort, pass, strays, as `anticrack bench` has them.
void serve(const Scene& scene) {
  const Sample sample = load_sample(scene);
  Simulation simulation(setup_of(scene, sample.lattice), sample.positions);
  const double particles = double(simulation.particles().count);
  std::printf("%.0f\n", particles);
  std::fflush(stdout);
  for (int steps; std::cin >> steps;) {
    const PhaseSeconds before = simulation.phase_seconds();
    const auto start = std::chrono::steady_clock::now();
    for (int n = 0; n < steps; ++n) simulation.step(false);
    const std::chrono::duration<double> all = std::chrono::steady_clock::now() - start;
    const PhaseSeconds after = simulation.phase_seconds();
    const auto ns = [&](double seconds) { return 1e9 * seconds / (steps * particles); };
    std::printf("%.4f %.4f %.4f %.4f %.4f %.4f\n", ns(all.count()), ns(after.grid - before.grid),
                ns(after.walls - before.walls), ns(after.sort - before.sort), ns(after.pass - before.pass),
                ns(after.strays - before.strays));
    std::fflush(stdout);
  }
}

}  // namespace
}  // namespace anticrack

int main(int count, char** arguments) try {
  const int threads = count > 1 ? std::atoi(arguments[1]) : 0;
  if (count < 3 || threads < 1) {
    std::fputs("usage: step_benchmark THREADS SCENE [KEY=VALUE]...\n", stderr);
    return 2;
  }
  const std::vector<std::string> overrides(arguments + 3, arguments + count);
  const anticrack::ThreadLimit limit(threads);
  anticrack::serve(anticrack::read_scene(arguments[2], overrides));
} catch (const std::exception& error) {
  std::fprintf(stderr, "step_benchmark: %s\n", error.what());
  return 2;
}
