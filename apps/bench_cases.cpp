#include "bench_cases.h"

#include <algorithm>
#include <cmath>
#include <memory>

#include "sample.h"

namespace anticrack {

namespace {

constexpr int side = 131;  ///< lattice points, the paper's
constexpr double spacing = 1.0 / side;

/// A block of the lattice, cell by cell full.
std::vector<Vec3> full_lattice(const Index3& points, double dy = spacing) {
  std::vector<Vec3> x;
  for (int i = 0; i < points[0]; ++i)
    for (int j = 0; j < points[1]; ++j)
      for (int k = 0; k < points[2]; ++k)
        x.push_back({spacing * (i + 0.5), dy * (j + 0.5), spacing * (k + 0.5)});
  return x;
}

BenchCase full_block(std::string series, double value, int points) {
  const Index3 all{points, points, points};
  return {std::move(series), value, setup_of(paper_scene(), {all, spacing}), full_lattice(all)};
}

BenchCase level_cut(std::string series, double value, double phi) {
  const Scene scene = paper_scene(phi);
  return {std::move(series), value, setup_of(scene, *scene.lattice), load_sample(scene).positions};
}

/// The paper's sample side by side until there are `count` particles, or a cube cut from its corner.
BenchCase of_count(double count) {
  BenchCase one = level_cut("particles", count, 0.44);
  const double copies = count / double(one.positions.size());
  Index3 n{1, 1, 1};
  for (int a = 0; double(n[0]) * n[1] * n[2] < copies; a = (a + 1) % 3) ++n[a];
  const double edge = std::min(1.0, std::cbrt(copies));
  std::vector<Vec3> x;
  x.reserve(std::size_t(count));
  for (int i = 0; i < n[0]; ++i)
    for (int j = 0; j < n[1]; ++j)
      for (int k = 0; k < n[2]; ++k)
        for (const Vec3& p : one.positions)
          if (p.maxCoeff() < edge && double(x.size()) < count) x.push_back(p + Vec3(i, j, k));
  one.positions = std::move(x);
  one.setup.box_size = edge * Vec3(n[0], n[1], n[2]);
  return one;
}

/// Simple shear of a block without cohesion and friction, so that every particle yields in every step;
/// `yielding` false: the same with the paper's cohesion.
BenchCase sheared(bool yielding) {
  BenchCase c = full_block("yielding", yielding ? 1 : 0, 100);
  if (!yielding) return c;
  c.setup.material.plasticity = DruckerPragerSoftening{0, 0, 1e6};
  const double rate = 10;
  for (const Vec3& x : c.positions) c.velocities.push_back({rate * x[1], 0, 0});
  return c;
}

/// A block that flies so fast that a share of its particles changes cell in a step.
BenchCase flying(double share) {
  BenchCase c = full_block("strays", share, 100);
  c.setup.box_size *= 3;
  for (Vec3& x : c.positions) x += Vec3(100, 100, 100) * spacing;
  const double nu = c.setup.material.elasticity.poisson_ratio,
               speed_of_step =
                   std::sqrt((c.setup.material.elasticity.lambda() + 2 * c.setup.material.elasticity.mu()) /
                             c.setup.material.density) /
                   std::sqrt((1 - 2 * nu) / 3);
  c.velocities.assign(c.positions.size(), Vec3(share * speed_of_step, 0, 0));
  return c;
}

}  // namespace

Scene paper_scene(double phi) {
  Scene scene;
  scene.lattice = SampleLattice{{side, side, side}, spacing};
  scene.microstructure = GaussianRandomFieldSource{{10000, 9, 50, 1}, phi};
  scene.material = {1e4, {10e9, 0.3}, DruckerPragerSoftening{1.2, 2.5e6, 1e6}};
  scene.loading = TriaxialLoading{0, -1, 5e-4, WallKind::sticky};
  return scene;
}

std::vector<BenchCaseMaker> option_cases() {
  // The same particles for all.
  const auto base = std::make_shared<BenchCase>(level_cut("everything", 0, 0.44));
  const auto with = [&](const std::string& name, auto change) {
    return [base, name, change] {
      BenchCase c = *base;
      c.series = name;
      change(c);
      return c;
    };
  };
  return {
      with("everything: softening Drucker-Prager, PIC-FLIP, history", [](BenchCase&) {}),
      with("no history", [](BenchCase& c) { c.history_every = 0; }),
      with("paper's return mapping",
           [](BenchCase& c) { c.setup.numerics.return_mapping = ReturnMapping::paper; }),
      with("PIC only", [](BenchCase& c) { c.setup.numerics.flip = 0; }),
      with("APIC", [](BenchCase& c) { c.setup.numerics.transfer = TransferScheme::apic; }),
      with("elastic only", [](BenchCase& c) { c.setup.material.plasticity.reset(); }),
      with("elastic, PIC only, no history",
           [](BenchCase& c) {
             c.setup.material.plasticity.reset();
             c.setup.numerics.flip = 0;
             c.history_every = 0;
           }),
  };
}

std::vector<BenchCaseMaker> curve_cases(double most) {
  std::vector<BenchCaseMaker> cases;
  for (const double n : {1e5, 3e5, 1e6, 3e6, 1e7, 2e7, 5e7})
    if (n <= most) cases.push_back([n] { return of_count(n); });
  for (const double phi : {0.2, 0.34, 0.44, 0.54, 0.7})
    cases.push_back([phi] { return level_cut("solid fraction", phi, phi); });
  cases.push_back([] { return full_block("solid fraction", 1, side); });
  for (const double crowd : {8, 12, 16, 20})
    cases.push_back([crowd] {
      BenchCase c = full_block("particles a cell", crowd, 100);
      c.positions = full_lattice({100, 100, 100}, spacing * 8 / crowd);
      return c;
    });
  for (const bool yielding : {false, true}) cases.push_back([yielding] { return sheared(yielding); });
  for (const double share : {0.0, 0.01, 0.02, 0.05}) cases.push_back([share] { return flying(share); });
  return cases;
}

}  // namespace anticrack
