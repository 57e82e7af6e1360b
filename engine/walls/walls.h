#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "sparse_grid.h"
#include "vec3.h"
#include "walls/loading.h"

namespace anticrack {

/// What a wall asks of the velocity along it.
enum class Tangential { free, fixed, affine };

/// A rigid plane that bounds the sample.
struct Wall {
  int axis;              ///< of its normal
  bool upper;            ///< on the side of large coordinates
  double position;       ///< [m]
  double full_velocity;  ///< along +axis, at the end of the ramp [m/s]
  Tangential tangential = Tangential::free;
  double grip_depth = 0;  ///< how far inside its position it takes hold of nodes [m]
};

/// What the walls did to the grid in one step. Index 2 * axis + upper.
struct WallAction {
  std::array<double, 6> normal_impulse{};  ///< by the wall on the sample, along +axis [N s]
  double work = 0;                         ///< impulse . velocity [J]
  double impact_loss = 0;          ///< kinetic energy lost where a node takes on a wall's velocity [J]
  double kinetic_change = 0;       ///< of the grid, by setting the velocities [J]
  double generalized_impulse = 0;  ///< sum of impulse . (full wall velocity) [J]; W2 is the rate of its force
  Vec3 virial = Vec3::Zero();  ///< sum of impulse_c x_c about the centre of the box, for c = x, y, z [N s m]
  double max_speed = 0;        ///< bound on the speed of the nodes set [m/s]

  void add(const WallAction& other);
};

/// The six walls of the sample box and their motion, line 6 of Algorithm 1.
class Walls {
 public:
  /// @throws InputError  if a wall is faster than the elastic wave `wave_speed` [m/s]
  Walls(const Loading& loading, WallRule rule, const Vec3& box_size, double cell_size,
        const Vec3& grid_offset, double wave_speed);

  /// Enforces the walls on the updated nodal velocities. Where walls meet, each sets its own normal
  /// component.
  WallAction apply(SparseGrid& grid, double time) const;

  void move(double time, double dt);  ///< advances the positions from `time` to `time + dt`

  double ramp(double time) const { return ramp_time_ > 0 && time < ramp_time_ ? time / ramp_time_ : 1.0; }
  double max_speed() const;                                     ///< [m/s] at the end of the ramp
  Vec3 lower() const;                                           ///< [m]
  Vec3 upper() const;                                           ///< [m]
  double volume() const { return (upper() - lower()).prod(); }  ///< of the whole box, solid and void [m^3]
  Vec3 strain() const;  ///< nominal (engineering) strain of the box along each axis; negative in compression
  std::array<double, 6> positions() const;
  void set_positions(const std::array<double, 6>& positions);  ///< to resume a run

 private:
  /// Components in which the walls of the same axes have a say, and set together.
  struct Constraint {
    std::uint32_t axes, components;  ///< bit a
  };
  struct Reach;  // the nodes that a wall takes hold of
  struct Role;
  struct Slices;
  struct Setting;
  struct Ties;
  class Surroundings;
  double from_centre(int axis, int node) const;  ///< [m]
  double full_velocity_at(const Wall& wall, int component, int node_component) const;
  void set_held(Node& node, const Index3& at, std::uint32_t components, const Index3& walls, double ramp,
                WallAction& action) const;
  void set_tied(const Ties& ties, int component, double ramp, const std::array<Reach, 6>& reach,
                WallAction& action) const;
  void constrain_leaf(const SparseGrid& grid, std::uint32_t leaf, double ramp,
                      const std::array<Reach, 6>& reach, std::vector<Ties>& ties, WallAction& action) const;

  std::array<Wall, 6> walls_;
  std::vector<Constraint> constraints_;
  WallRule rule_;
  Vec3 initial_size_;
  double cell_size_;
  Vec3 grid_offset_;
  double ramp_time_;
};

/// The walls of a triaxial run in a box [0, size]; `paper` walls grip one cell deep where they pull.
std::array<Wall, 6> triaxial_walls(const TriaxialLoading& loading, const Vec3& size, double cell_size);

/// Platens along the axis, frictionless side walls at rest.
std::array<Wall, 6> confined_compression_walls(const ConfinedCompression& loading, const Vec3& size);

}  // namespace anticrack
