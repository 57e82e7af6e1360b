#pragma once

#include <cstdint>
#include <vector>

#include "huge_pages.h"

namespace anticrack {

/// Fixed-size array of doubles on a 64-byte boundary, with a tail that full vector loads may read.
class AlignedArray {
 public:
  AlignedArray() = default;
  explicit AlignedArray(std::size_t size);  ///< zeros
  static AlignedArray uninitialized(std::size_t size);
  double* data() { return memory_.get() + shift_; }
  const double* data() const { return memory_.get() + shift_; }
  std::size_t size() const { return size_; }
  double& operator[](std::size_t i) { return data()[i]; }
  double operator[](std::size_t i) const { return data()[i]; }

 private:
  static constexpr std::size_t tail = 8;
  std::size_t size_ = 0;
  std::size_t shift_ = 0;
  PageArray<double> memory_;
};

/// Arrays of the particles that only some scenes need.
struct ParticleFields {
  bool kappa;   ///< plasticity
  bool affine;  ///< APIC
};

/// State of the particles: one array a component, 13 doubles a particle (12 without plasticity, 9 more with
/// APIC).
///
/// The particles of a block (4 x 4 x 4 dual cells) lie together, sorted by cell. Positions are relative to
/// the cell under which a particle is stored, so they keep their digits anywhere in space. A particle with a
/// component of s outside [0, 1] has left that cell since the last sort: it is a *stray* until the next one.
struct Particles {
  std::size_t count = 0;
  AlignedArray s[3];              ///< place in the dual cell [cells]
  AlignedArray v[3];              ///< velocity [m/s]
  AlignedArray h[6];              ///< b^E - I [-], order xx yy zz xy xz yz
  AlignedArray kappa;             ///< accumulated |dev eps^p| [-]; empty without plasticity
  AlignedArray affine[9];         ///< dx C [m/s], row major: what v changes by across a cell; APIC only
  std::vector<std::uint32_t> id;  ///< seeding order

  static constexpr std::size_t bytes_per_particle(ParticleFields fields) {
    return (12 + (fields.kappa ? 1 : 0) + (fields.affine ? 9 : 0)) * sizeof(double) + sizeof(std::uint32_t);
  }
  std::size_t bytes_per_particle() const {
    return bytes_per_particle({kappa.size() > 0, affine[0].size() > 0});
  }
  /// Every array of doubles that travels with a particle.
  std::vector<AlignedArray*> arrays() {
    std::vector<AlignedArray*> all;
    for (auto& a : s) all.push_back(&a);
    for (auto& a : v) all.push_back(&a);
    for (auto& a : h) all.push_back(&a);
    if (kappa.size()) all.push_back(&kappa);
    for (auto& a : affine)
      if (a.size()) all.push_back(&a);
    return all;
  }
};

}  // namespace anticrack
