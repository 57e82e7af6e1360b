#include <benchmark/benchmark.h>

#include <algorithm>
#include <array>
#include <random>
#include <vector>

#include "fields/gaussian_random_field.h"
#include "kernels.h"

namespace anticrack {
namespace {

/// One block whose particles stay where they are: all it touches lies in the caches.
struct Block {
  Particles particles;
  std::array<std::uint32_t, block_cells + 1> cell_begin{};
  std::vector<std::array<Node, block_cells>> leaves{8}, partials{8};
  BlockView view{};

  /// @param a_cell  particles; 0: none to eight, 294 in 46 cells; -1: 92 in 17, as in a thin sample
  /// @param strain  size of b - I
  Block(int a_cell, double strain) {
    std::mt19937 random(1);
    std::uniform_real_distribution<double> uniform(0, 1);
    for (int c = 0; c < block_cells; ++c) {
      const double u = uniform(random), empty = a_cell == 0 ? 0.35 : 0.74, full = a_cell == 0 ? 0.33 : 0.11;
      const int porous = u < empty ? 0 : u < empty + full ? 8 : 1 + int(7 * uniform(random));
      cell_begin[c + 1] = cell_begin[c] + std::uint32_t(a_cell > 0 ? a_cell : porous);
    }
    const std::size_t n = particles.count = cell_begin[block_cells];
    for (auto* arrays : {&particles.s[0], &particles.v[0]})
      for (int a = 0; a < 3; ++a) arrays[a] = AlignedArray(n);
    for (auto& a : particles.h) a = AlignedArray(n);
    for (auto& a : particles.affine) a = AlignedArray(n);
    particles.kappa = AlignedArray(n);
    for (std::size_t i = 0; i < n; ++i) {
      for (int a = 0; a < 3; ++a) particles.s[a][i] = 0.25 + 0.5 * uniform(random);
      for (int e = 0; e < 6; ++e) particles.h[e][i] = strain * (uniform(random) - 0.5);
    }
    for (auto& leaf : leaves)
      for (Node& node : leaf) node = {{1e-9 * uniform(random), 0, 0}, 1, {1e-12, 0, 0}, 0};
    for (int o = 0; o < 8; ++o) view.leaf[o] = leaves[o].data();
    for (int o = 0; o < 8; ++o) view.partial[o] = partials[o].data();
    view.cell_begin = cell_begin.data();
  }
};

void advance_block(benchmark::State& state, PassKind kind, double cohesion, double strain) {
  const int a_cell = int(state.range(0));
  Block block(a_cell, strain);
  const Material material{1e4, {10e9, 0.3}, DruckerPragerSoftening{cohesion > 0 ? 1.2 : 0, cohesion, 0}};
  const StepConstants c{1e-9, 0.01, 0.99, 1, 1e-6, MaterialConstants(material), kernels().full_width};
  const ParticlePointers pointers(block.particles);
  for (auto _ : state) {
    BlockResult result;
    kernels().advance_block(kind, c, pointers, block.view, block.view, false, result);
    benchmark::DoNotOptimize(result.sums);
  }
  const double particles = double(state.iterations()) * double(block.particles.count);
  state.counters["a_particle"] =
      benchmark::Counter(particles, benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
  state.SetLabel(kernels().simd);
}

constexpr double never_yields = 1e12;
constexpr PassKind plastic{Model::drucker_prager_implicit, Transfer::flip};

BENCHMARK_CAPTURE(advance_block, elastic_state, plastic, never_yields, 1e-5)
    ->Arg(8)
    ->Arg(4)
    ->Arg(2)
    ->Arg(1)
    ->Arg(0)
    ->Arg(-1);
BENCHMARK_CAPTURE(advance_block, every_particle_yields, plastic, 0.0, 1e-5)->Arg(8);
BENCHMARK_CAPTURE(advance_block, strain_beyond_the_series, plastic, never_yields, 0.5)->Arg(8);
BENCHMARK_CAPTURE(advance_block, no_plasticity, PassKind({Model::hencky, Transfer::flip}), never_yields, 1e-5)
    ->Arg(8);
BENCHMARK_CAPTURE(advance_block, no_plasticity_pic, PassKind({Model::hencky, Transfer::pic}), never_yields,
                  1e-5)
    ->Arg(8);

BENCHMARK_CAPTURE(advance_block, apic, PassKind({Model::drucker_prager_implicit, Transfer::apic}),
                  never_yields, 1e-5)
    ->Arg(8);

void update_leaf(benchmark::State& state) {
  std::vector<std::array<Node, block_cells>> partials(std::size_t(state.range(0)));
  for (auto& partial : partials)
    for (Node& node : partial) node = {{1, 2, 3}, 1, {1, 2, 3}, 0};
  std::vector<Node*> pointers;
  for (auto& partial : partials) pointers.push_back(partial.data());
  std::array<Node, block_cells> leaf;
  const LeafView view{pointers, leaf.data()};
  for (auto _ : state) benchmark::DoNotOptimize(kernels().update_leaf(1e-6, view, view));
}
BENCHMARK(update_leaf)->Arg(1)->Arg(2)->Arg(8);

/// The paper's field: 1e4 waves on a cube of lattice points.
void random_field(benchmark::State& state) {
  const int side = int(state.range(0));
  const auto field = GaussianRandomField::sample({10000, 9, 50, 1}, 1.0);
  for (auto _ : state)
    benchmark::DoNotOptimize(field.evaluate_excess_on_lattice({{side, side, side}, 1.0 / side}, 0, 0.1));
}
BENCHMARK(random_field)->Arg(131)->Arg(256)->Arg(512)->Unit(benchmark::kMillisecond)->UseRealTime();

}  // namespace
}  // namespace anticrack

BENCHMARK_MAIN();
