#include <benchmark/benchmark.h>

#include <algorithm>
#include <array>
#include <random>
#include <span>
#include <vector>

#include "activation.h"
#include "fields/gaussian_random_field.h"
#include "kernels.h"
#include "sample_lattice.h"

namespace anticrack {
namespace {

/// Some blocks whose particles stay where they are: all that a pass over them touches lies in the caches.
struct Blocks {
  Particles particles;
  std::vector<CellRanges> cells;
  std::vector<std::array<Node, block_cells>> leaves{8}, partials{8};  ///< one set for all
  std::vector<BlockView> views;
  std::size_t count = 0;  ///< particles in the blocks

  /// @param strain  size of b - I
  Blocks(std::span<const Vec3> positions, double cell_size, std::size_t most_blocks, double strain) {
    SparseGrid grid;
    place_particles(positions, cell_size, Vec3::Zero(), {true, true}, particles, grid, cells);
    std::mt19937 random(1);
    std::uniform_real_distribution<double> uniform(0, 1);
    for (std::size_t i = 0; i < particles.count; ++i) {
      for (int a = 0; a < 3; ++a) particles.s[a][i] = 0.25 + 0.5 * uniform(random);
      for (int e = 0; e < 6; ++e) particles.h[e][i] = strain * (uniform(random) - 0.5);
    }
    for (auto& leaf : leaves)
      for (Node& node : leaf) node = {{1e-9 * uniform(random), 0, 0}, 1, {1e-12, 0, 0}, 0};
    const std::size_t wanted = std::min(most_blocks, cells.size());
    for (std::size_t n = 0; n < wanted; ++n) {  // from everywhere in the sample
      const std::size_t b = (2 * n + 1) * cells.size() / (2 * wanted);
      count += cells[b].back() - cells[b].front();
      views.push_back({{}, {}, cells[b].data()});
      for (int o = 0; o < 8; ++o)
        if (grid.blocks()[b].reach.leaves >> o & 1)
          views[n].leaf[o] = leaves[o].data(), views[n].partial[o] = partials[o].data();
    }
  }
};

/// One block with as many particles in each cell.
Blocks uniform_block(int a_cell, double strain) {
  std::vector<Vec3> x;
  for (int cell = 0; cell < block_cells; ++cell)
    for (int n = 0; n < a_cell; ++n) x.push_back(Vec3(cell >> 4, cell >> 2 & 3, cell & 3) + Vec3::Ones());
  return {x, 1.0, 1, strain};
}

/// Blocks of the paper's cube, 131^3 lattice points, at a solid fraction.
Blocks blocks_of_sample(double phi, double strain) {
  constexpr int side = 131;
  const SampleLattice lattice{{side, side, side}, 1.0 / side};
  const auto G = GaussianRandomField::sample({10000, 9, 50, 1}, 1.0).evaluate_on_lattice(lattice, 0);
  auto sorted = G;
  const auto level = sorted.begin() + std::ptrdiff_t((1 - phi) * double(G.size()));
  std::nth_element(sorted.begin(), level, sorted.end());
  std::vector<Vec3> x;
  for (std::size_t n = 0; n < G.size(); ++n)
    if (G[n] >= *level) x.push_back(lattice.point(int(n % side), int(n / side % side), int(n / side / side)));
  return {x, 2 * lattice.spacing, 32, strain};
}

void advance(benchmark::State& state, Blocks blocks, PassKind kind, double cohesion) {
  const Material material{1e4, {10e9, 0.3}, DruckerPragerSoftening{cohesion > 0 ? 1.2 : 0, cohesion, 0}};
  const StepConstants c{1e-9, 0.01, 0.99, 1, 1e-6, MaterialConstants(material), kernels().full_width};
  const ParticlePointers pointers(blocks.particles);
  for (auto _ : state)
    for (std::size_t b = 0; b < blocks.views.size(); ++b) {
      BlockResult result;
      kernels().advance_block(kind, c, pointers, blocks.views[b], blocks.views[(b + 1) % blocks.views.size()],
                              false, result);
      benchmark::DoNotOptimize(result.sums);
    }
  state.counters["a_particle"] =
      benchmark::Counter(double(state.iterations()) * double(blocks.count),
                         benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
  state.counters["a_block"] = double(blocks.count) / double(blocks.views.size());
  state.SetLabel(kernels().simd);
}

void advance_block(benchmark::State& state, PassKind kind, double cohesion, double strain) {
  advance(state, uniform_block(int(state.range(0)), strain), kind, cohesion);
}

constexpr double never_yields = 1e12;
constexpr PassKind plastic{Model::drucker_prager_implicit, Transfer::flip};

BENCHMARK_CAPTURE(advance_block, elastic_state, plastic, never_yields, 1e-5)->Arg(8)->Arg(4)->Arg(2)->Arg(1);
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

/// Solid fraction in percent.
void advance_sample(benchmark::State& state) {
  advance(state, blocks_of_sample(0.01 * double(state.range(0)), 1e-5), plastic, never_yields);
}
BENCHMARK(advance_sample)->Arg(20)->Arg(44)->Arg(70);

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
