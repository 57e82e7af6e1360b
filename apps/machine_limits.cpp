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
  const auto a = hn::Set(d, 0.999999), b = hn::Set(d, 1e-9);
  // Different, or the compiler makes one chain of them.
  const auto chain = [&](int n) HWY_ATTR { return hn::Iota(d, result + 10 * n); };
  auto x0 = chain(0), x1 = chain(1), x2 = chain(2), x3 = chain(3), x4 = chain(4), x5 = chain(5),
       x6 = chain(6), x7 = chain(7), x8 = chain(8), x9 = chain(9), x10 = chain(10), x11 = chain(11);
  for (std::size_t i = 0; i < rounds; ++i) {
    x0 = hn::MulAdd(x0, a, b);
    x1 = hn::MulAdd(x1, a, b);
    x2 = hn::MulAdd(x2, a, b);
    x3 = hn::MulAdd(x3, a, b);
    x4 = hn::MulAdd(x4, a, b);
    x5 = hn::MulAdd(x5, a, b);
    x6 = hn::MulAdd(x6, a, b);
    x7 = hn::MulAdd(x7, a, b);
    x8 = hn::MulAdd(x8, a, b);
    x9 = hn::MulAdd(x9, a, b);
    x10 = hn::MulAdd(x10, a, b);
    x11 = hn::MulAdd(x11, a, b);
  }
  const auto sum = ((x0 + x1) + (x2 + x3)) + ((x4 + x5) + (x6 + x7)) + ((x8 + x9) + (x10 + x11));
  result += hn::GetLane(hn::SumOfLanes(d, sum));
  return 12.0 * double(rounds) * double(hn::Lanes(d));
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
