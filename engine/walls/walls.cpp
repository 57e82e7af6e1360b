#include "walls/walls.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "errors.h"

namespace anticrack {

Walls::Walls(const Loading& loading, WallRule rule, const Vec3& box_size, double cell_size, const Vec3& grid_offset,
             double wave_speed)
    : rule_(rule), initial_size_(box_size), cell_size_(cell_size), grid_offset_(grid_offset) {
  if (const auto* triaxial = std::get_if<TriaxialLoading>(&loading)) {
    walls_ = triaxial_walls(*triaxial, box_size, cell_size);
    ramp_time_ = triaxial->ramp_time;
  } else {
    const auto& confined = std::get<ConfinedCompression>(loading);
    walls_ = confined_compression_walls(confined, box_size);
    ramp_time_ = confined.ramp_time;
  }
  if (!(max_speed() < wave_speed))
    throw InputError("wall speed " + std::to_string(max_speed()) + " m/s; expected below the elastic wave speed " +
                     std::to_string(wave_speed) + " m/s");
}

double Walls::max_speed() const {
  double speed = 0;
  for (const Wall& wall : walls_) speed = std::max(speed, std::abs(wall.full_velocity));
  return speed;
}

Vec3 Walls::lower() const { return {walls_[0].position, walls_[2].position, walls_[4].position}; }
Vec3 Walls::upper() const { return {walls_[1].position, walls_[3].position, walls_[5].position}; }
Vec3 Walls::strain() const { return (upper() - lower()).cwiseQuotient(initial_size_) - Vec3::Ones(); }

std::array<double, 6> Walls::positions() const {
  std::array<double, 6> p;
  for (int w = 0; w < 6; ++w) p[w] = walls_[w].position;
  return p;
}
void Walls::set_positions(const std::array<double, 6>& positions) {
  for (int w = 0; w < 6; ++w) walls_[w].position = positions[w];
}

void Walls::move(double time, double dt) {
  const double factor = ramp(time);
  for (Wall& wall : walls_) wall.position += dt * factor * wall.full_velocity;
}

/// Along its axis a wall at grid coordinate X takes hold of the nodes up to `last` (lower wall) or from `last` on (upper).
struct Walls::Reach {
  double X;
  int last;
  int mirror;  ///< first free node at least half a cell inside; the ghost rule extrapolates from it
  bool upper;

  Reach(const Wall& wall, WallRule rule, double cell_size, double offset) : upper(wall.upper) {
    const double inward = wall.upper ? -1 : 1;
    X = (wall.position + inward * wall.grip_depth) / cell_size - offset;
    if (rule == WallRule::ghost) {
      mirror = upper ? int(std::floor(X - 0.5)) : int(std::ceil(X + 0.5));
      last = upper ? mirror + 1 : mirror - 1;
    } else {
      mirror = last = upper ? int(std::ceil(X)) : int(std::floor(X));
    }
  }
  bool holds(int node) const { return upper ? node >= last : node <= last; }
  bool touches_leaf(int origin) const { return holds(upper ? origin * block_edge + block_edge - 1 : origin * block_edge); }
  /// Whether a particle inside reaches the node. Farther out only what has slipped through the wall does; extrapolation
  /// would throw it away.
  bool extrapolates(int node) const { return (upper ? node - X : X - node) <= 1.5; }
  /// (x_g - x_w) / (x_j - x_w), times m_j / m_g where that is below one: behind a pore a nearly empty node j has a velocity
  /// of any size, which must not be handed to a heavy ghost. In a solid m_j >= m_g.
  double weight(int node, double mass, double mirror_mass) const {
    return (node - X) / (mirror - X) * std::min(1.0, mirror_mass / mass);
  }
};

/// The node at coordinate `to` along `axis`, level with `node` of `leaf` and at most a leaf away; nullptr if not active.
static const Node* node_along(const SparseGrid& grid, std::uint32_t leaf, Index3 node, int axis, int to) {
  const int step = (to >> 2) - grid.leaves()[leaf].origin[axis];
  if (step != 0) leaf = grid.leaves()[leaf].neighbour[2 * axis + (step > 0)];
  if (leaf == SparseGrid::none) return nullptr;
  node[axis] = to & 3;
  return &grid.leaves()[leaf].nodes[leaf_index(node[0], node[1], node[2])];
}

void Walls::constrain(SparseGrid& grid, double ramp, int axis, bool normal, WallAction& action) const {
  const Reach reach[2] = {{walls_[2 * axis], rule_, cell_size_, grid_offset_[axis]},
                          {walls_[2 * axis + 1], rule_, cell_size_, grid_offset_[axis]}};
  std::vector<std::uint32_t> near;
  for (std::uint32_t l = 0; l < grid.leaves().size(); ++l)
    for (const Reach& r : reach)
      if (r.touches_leaf(grid.leaves()[l].origin[axis]) && (near.empty() || near.back() != l)) near.push_back(l);

  struct Part {
    double impulse[2] = {}, work = 0, kinetic = 0, generalized = 0;
  };
  std::vector<Part> parts(near.size());
  tbb::parallel_for(std::size_t(0), near.size(), [&](std::size_t n) {
    const SparseGrid::Leaf& leaf = grid.leaves()[near[n]];
    for (int side = 0; side < 2; ++side) {
      const Wall& wall = walls_[2 * axis + side];
      const Reach& r = reach[side];
      if (!r.touches_leaf(leaf.origin[axis])) continue;
      for (int index = 0; index < block_cells; ++index) {
        const Index3 in_leaf{index >> 4, index >> 2 & 3, index & 3};
        const int along = leaf.origin[axis] * block_edge + in_leaf[axis];
        Node& node = leaf.nodes[index];
        if (!r.holds(along) || node.mass <= 0) continue;
        const Node* inside = rule_ == WallRule::ghost && r.extrapolates(along) ? node_along(grid, near[n], in_leaf, axis, r.mirror) : nullptr;
        for (int c = 0; c < 3; ++c) {
          if (normal != (c == axis)) continue;
          // Velocity of the wall at this node: its own along the normal; along it, zero or that of the homogeneous gradient.
          double full = wall.full_velocity;
          if (c != axis) {
            full = 0;
            if (wall.tangential == Tangential::affine) {
              const Wall &low = walls_[2 * c], &high = walls_[2 * c + 1];
              const double x = (leaf.origin[c] * block_edge + in_leaf[c] + grid_offset_[c]) * cell_size_;
              full = low.full_velocity + (high.full_velocity - low.full_velocity) * (x - low.position) / (high.position - low.position);
            }
          }
          const double v_wall = ramp * full;
          double target = v_wall;
          if (inside && inside->mass > 0) target += (inside->velocity[c] - v_wall) * r.weight(along, node.mass, inside->mass);
          const double change = target - node.velocity[c];
          const double impulse = node.mass * change;
          // With v at the middle of the step, (v^n + v^{n+1}) / 2, the work of walls and that of stresses add up to the change
          // of kinetic energy.
          const double v_old = node.velocity[c] - node.increment[c];
          parts[n].work += impulse * 0.5 * (v_old + target);
          parts[n].kinetic += impulse * (node.velocity[c] + 0.5 * change);
          parts[n].generalized += impulse * full;
          if (c == axis) parts[n].impulse[side] += impulse;
          node.velocity[c] = target;
          node.increment[c] += change;
        }
      }
    }
  });
  for (const Part& part : parts) {
    for (int side = 0; side < 2; ++side) action.normal_impulse[2 * axis + side] += part.impulse[side];
    action.work += part.work;
    action.kinetic_change += part.kinetic;
    action.generalized_impulse += part.generalized;
  }
}

WallAction Walls::apply(SparseGrid& grid, double time) const {
  WallAction action;
  // Tangential components first, so that at an edge the wall whose normal it is has the last word.
  for (int axis = 0; axis < 3; ++axis)
    if (walls_[2 * axis].tangential != Tangential::free) constrain(grid, ramp(time), axis, false, action);
  for (int axis = 0; axis < 3; ++axis) constrain(grid, ramp(time), axis, true, action);
  return action;
}

}  // namespace anticrack
