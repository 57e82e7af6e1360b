#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "level_sets/cut_solid.h"

namespace anticrack {

/// For every point of a padded lattice near the boundary of a solid, roughly the closest point of it within
/// the sample box: where Newton's method starts. Four bytes a lattice point.
class ClosestSeeds {
 public:
  /// First order beside the surface, then handed on from neighbour to neighbour, one ring of lattice points
  /// after the other, to a distance of three points and more. Same bits on any number of threads. Sheets that
  /// pass between lattice points count also where no lattice point between them is solid.
  explicit ClosestSeeds(const CutSolid& solid);

  /// None, for a lattice of as many points.
  explicit ClosestSeeds(const Index3& points);

  /// Replaces the seed of a lattice point; one that is farther than the seeds reach is none.
  void put(const Index3& index, const Vec3& seed);

  /// That of a lattice point itself, index space; nothing outside the padded lattice.
  std::optional<Vec3> of(const Index3& index) const;

  struct Choice {
    std::optional<Vec3> first;   ///< the nearest; nothing if the surface is not near
    std::optional<Vec3> second;  ///< one elsewhere on the surface that is hardly farther
  };

  /// Of the seeds of (i, j, k) and its six neighbours, index space.
  Choice at(int i, int j, int k) const;

  /// All seeds of (i, j, k) and the 26 points around it that lie apart, the nearest first, index space.
  std::vector<Vec3> all_around(int i, int j, int k) const;

 private:
  struct Offset {
    Index3 way;   // from a lattice point to a seed, in the unit of `packed_`
    int squared;  // its length squared
  };

  using Plane =
      std::vector<std::uint32_t>;  // points of a plane of the padded lattice: i + width j from its corner

  void start_ring(const CutSolid& solid, std::vector<Plane>& found);
  std::optional<Vec3> first_order(const Sheet& sheet, const Index3& index) const;
  std::optional<Vec3> to_boundary(const CutSolid& solid, const Sheet& sheet, const Index3& index,
                                  const Vec3& step) const;
  std::vector<Plane> grow_ring(int ring, const std::vector<Plane>& frontier);
  std::uint32_t in_plane(int i, int j) const;
  std::optional<Offset> neighbour(const Index3& point, const Index3& step, int last_ring) const;
  std::uint32_t load(std::size_t offset) const;

  Index3 points_;
  PaddedField layout_;  // of `packed_`: a field without values
  std::vector<std::uint32_t> packed_;
};

}  // namespace anticrack
