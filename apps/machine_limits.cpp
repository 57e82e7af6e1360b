#include "machine_limits.h"

#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <vector>

// The kernels' instruction sets: see engine/kernels.cpp.
#define HWY_DISABLED_TARGETS (HWY_SSSE3 | HWY_SSE4 | HWY_AVX3_DL)
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "machine_limits.cpp"
#include <hwy/foreach_target.h>
// Highway asks for this order.
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace anticrack {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

/// Twelve chains hide the latency of two multiply-add pipes. Returns how many lane operations it did.
double multiply_add(std::size_t rounds, double& result) {
  const hn::CappedTag<double, 8> d;
  constexpr int chains = 12;
  const auto a = hn::Set(d, 0.999999), b = hn::Set(d, 1e-9);
  hn::Vec<decltype(d)> x[chains];
  // Different, or the compiler makes one chain of them.
  for (int n = 0; n < chains; ++n) x[n] = hn::Iota(d, result + 10 * n);
  for (std::size_t i = 0; i < rounds; ++i)
    for (int n = 0; n < chains; ++n) x[n] = hn::MulAdd(x[n], a, b);
  for (int n = 0; n < chains; ++n) result += hn::GetLane(hn::SumOfLanes(d, x[n]));
  return double(chains) * double(rounds) * double(hn::Lanes(d));
}

}  // namespace HWY_NAMESPACE
}  // namespace anticrack
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace anticrack {

HWY_EXPORT(multiply_add);

namespace {

constexpr int repetitions = 5;

template <class Work>
double best_seconds(Work work) {
  double best = 1e300;
  for (int n = 0; n < repetitions; ++n) {
    const auto start = std::chrono::steady_clock::now();
    work();
    best = std::min(best, std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
  }
  return best;
}

}  // namespace

MachineLimits measure_machine_limits() {
  const std::size_t threads = std::size_t(tbb::this_task_arena::max_concurrency());
  const std::size_t tasks = 8 * threads;
  std::vector<double> results(tasks), operations(tasks);
  const double compute_seconds = best_seconds([&] {
    tbb::parallel_for(std::size_t(0), tasks, [&](std::size_t t) {
      operations[t] = HWY_DYNAMIC_DISPATCH(multiply_add)(1'000'000, results[t]);
    });
  });
  double all_operations = 0;
  for (const double n : operations) all_operations += n;

  constexpr std::size_t count = 12'000'000;
  std::vector<double> a(count), b(count, 1.0), c(count, 2.0);
  const double stream_seconds = best_seconds([&] {
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, count, count / (4 * threads)),
                      [&](const auto& range) {
                        for (std::size_t i = range.begin(); i < range.end(); ++i) a[i] = b[i] + 3.0 * c[i];
                      });
  });
  return {all_operations / compute_seconds, 3.0 * sizeof(double) * double(count) / stream_seconds};
}

}  // namespace anticrack
#endif
