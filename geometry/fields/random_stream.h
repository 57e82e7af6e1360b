#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>

namespace anticrack {

/// One block of Philox 4x32-10 (Salmon et al. 2011, "Parallel random numbers: as easy as 1, 2, 3"): four
/// random words that are a pure function of counter and key.
inline std::array<std::uint32_t, 4> philox(std::array<std::uint32_t, 4> counter,
                                           std::array<std::uint32_t, 2> key) {
  for (int round = 0; round < 10; ++round) {
    const std::uint64_t a = std::uint64_t(0xD2511F53u) * counter[0];
    const std::uint64_t b = std::uint64_t(0xCD9E8D57u) * counter[2];
    counter = {std::uint32_t(b >> 32) ^ counter[1] ^ key[0], std::uint32_t(b),
               std::uint32_t(a >> 32) ^ counter[3] ^ key[1], std::uint32_t(a)};
    key[0] += 0x9E3779B9u;
    key[1] += 0xBB67AE85u;
  }
  return counter;
}

/// Random numbers of item `index` under `seed`: the same whichever thread draws them and in whichever order.
class RandomStream {
 public:
  RandomStream(std::uint64_t seed, std::uint64_t index)
      : key_{std::uint32_t(seed), std::uint32_t(seed >> 32)}, index_(index) {}

  /// Uniform in [0, 1), 53 bits.
  double uniform() {
    if (next_ == 4) refill();
    const std::uint64_t high = words_[next_], low = words_[next_ + 1];
    next_ += 2;
    return double((high << 21) ^ (low >> 11)) * 0x1p-53;
  }

  /// Standard normal (Box and Muller 1958, one of the pair).
  double normal() {
    const double radius = std::sqrt(-2.0 * std::log(1.0 - uniform()));
    return radius * std::cos(2.0 * std::numbers::pi * uniform());
  }

  /// Gamma law of the given shape, >= 1, and scale 1 (Marsaglia and Tsang 2000).
  double gamma(double shape) {
    const double d = shape - 1.0 / 3.0, c = 1.0 / std::sqrt(9.0 * d);
    for (;;) {
      const double x = normal(), root = 1.0 + c * x, v = root * root * root;
      if (v > 0 && std::log(1.0 - uniform()) < 0.5 * x * x + d * (1.0 - v + std::log(v))) return d * v;
    }
  }

 private:
  void refill() {
    words_ = philox({block_++, 0, std::uint32_t(index_), std::uint32_t(index_ >> 32)}, key_);
    next_ = 0;
  }

  std::array<std::uint32_t, 2> key_;
  std::uint64_t index_;
  std::uint32_t block_ = 0;
  std::array<std::uint32_t, 4> words_{};
  int next_ = 4;
};

}  // namespace anticrack
