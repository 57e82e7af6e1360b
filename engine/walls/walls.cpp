#include "walls/walls.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_reduce.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "errors.h"

namespace anticrack {

Walls::Walls(const Loading& loading, WallRule rule, const Vec3& box_size, double cell_size,
             const Vec3& grid_offset, double wave_speed)
    : rule_(rule), initial_size_(box_size), cell_size_(cell_size), grid_offset_(grid_offset) {
  if (const auto* triaxial = std::get_if<TriaxialLoading>(&loading)) {
    walls_ = triaxial_walls(*triaxial, box_size, cell_size);
    ramp_time_ = triaxial->ramp_time;
  } else {
    const auto& confined = std::get<ConfinedCompression>(loading);
    walls_ = confined_compression_walls(confined, box_size);
    ramp_time_ = confined.ramp_time;
  }
  for (int a = 0; a < 3; ++a)
    for (int c = 0; c < 3; ++c)
      constraining_[c] |= std::uint32_t(a == c || walls_[2 * a].tangential != Tangential::free) << a;
  if (!(max_speed() < wave_speed))
    throw InputError("wall speed " + std::to_string(max_speed()) +
                     " m/s; expected below the elastic wave speed " + std::to_string(wave_speed) + " m/s");
}

double Walls::max_speed() const {
  double speed = 0;
  for (const Wall& wall : walls_) speed = std::max(speed, std::abs(wall.full_velocity));
  return speed;
}

Vec3 Walls::lower() const {
  return {walls_[0].position, walls_[2].position, walls_[4].position};
}
Vec3 Walls::upper() const {
  return {walls_[1].position, walls_[3].position, walls_[5].position};
}
Vec3 Walls::strain() const {
  return (upper() - lower()).cwiseQuotient(initial_size_) - Vec3::Ones();
}

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

/// Along its axis a wall at grid coordinate X takes hold of the nodes up to `last` (lower wall) or from
/// `last` on (upper).
struct Walls::Reach {
  double X;
  int last;
  int mirror;  ///< first free node at least half a cell inside; the ghost rule extrapolates from it
  bool upper;
  static constexpr int most_ghosts = 3;
  int ghosts = 0;                 ///< planes outward from the mirror that a particle inside reaches
  double ratio[most_ghosts + 1];  ///< (x_g - x_w) / (x_j - x_w) of the k-th plane outward from the mirror

  Reach(const Wall& wall, WallRule rule, double cell_size, double offset) : upper(wall.upper) {
    const double inward = wall.upper ? -1 : 1;
    X = (wall.position + inward * wall.grip_depth) / cell_size - offset;
    if (rule == WallRule::ghost) {
      mirror = upper ? int(std::floor(X - 0.5)) : int(std::ceil(X + 0.5));
      last = upper ? mirror + 1 : mirror - 1;
    } else {
      mirror = last = upper ? int(std::ceil(X)) : int(std::floor(X));
    }
    while (ghosts < most_ghosts && extrapolates(ghost(ghosts + 1))) ++ghosts;
    for (int k = 0; k <= ghosts; ++k) ratio[k] = (ghost(k) - X) / (mirror - X);
  }
  bool holds(int node) const { return upper ? node >= last : node <= last; }
  bool touches_leaf(int origin) const {
    return holds(upper ? origin * block_edge + block_edge - 1 : origin * block_edge);
  }
  /// Whether a particle inside reaches the node. Farther out only what has slipped through the wall does;
  /// extrapolation would throw it away.
  bool extrapolates(int node) const { return (upper ? node - X : X - node) <= 1.5; }
  int ghost(int k) const { return upper ? mirror + k : mirror - k; }  ///< k-th node outward from the mirror
};

double Walls::from_centre(int axis, int node) const {
  const double centre = 0.5 * (walls_[2 * axis].position + walls_[2 * axis + 1].position);
  return (node + grid_offset_[axis]) * cell_size_ - centre;
}

/// Velocity at the end of the ramp of a wall along component c: its own along the normal; along it zero, or
/// that of the homogeneous gradient.
double Walls::full_velocity_at(const Wall& wall, int c, int node_c) const {
  if (c == wall.axis) return wall.full_velocity;
  if (wall.tangential != Tangential::affine) return 0;
  const Wall &low = walls_[2 * c], &high = walls_[2 * c + 1];
  const double x = (node_c + grid_offset_[c]) * cell_size_;
  return low.full_velocity +
         (high.full_velocity - low.full_velocity) * (x - low.position) / (high.position - low.position);
}

/// The active node at `at`, which lies at most a leaf away from `leaf`; nullptr if there is none or it has no
/// mass.
static Node* node_at(const SparseGrid& grid, std::uint32_t leaf, const Index3& at) {
  const Index3 origin{at[0] >> 2, at[1] >> 2, at[2] >> 2};
  for (int a = 0; a < 3 && leaf != SparseGrid::none; ++a) {
    const int step = origin[a] - grid.leaves()[leaf].origin[a];
    if (step != 0) leaf = grid.leaves()[leaf].neighbour[2 * a + (step > 0)];
  }
  if (leaf == SparseGrid::none || grid.leaves()[leaf].origin != origin) leaf = grid.find_leaf(origin);
  if (leaf == SparseGrid::none) return nullptr;
  Node* node = &grid.leaves()[leaf].nodes[leaf_index(at[0] & 3, at[1] & 3, at[2] & 3)];
  return node->mass > 0 ? node : nullptr;
}

/// Sums of what one task did to its nodes.
struct Walls::Part {
  WallAction action;

  /// `x`: c-th coordinate of the node from the centre of the box. `full` is the wall's velocity at the end of
  /// the ramp, `normal_wall` the wall that c is normal to, or -1.
  void set_velocity(Node& node, int c, double x, double target, double full, int normal_wall) {
    const double change = target - node.velocity[c], impulse = node.mass * change;
    // Change of kinetic energy = stress power with v^{n+1} (which strains the particles) + impulse . v^{n+1}
    // - m |dv|^2 / 2. Summed over tied nodes impulse . v^{n+1} is the net impulse times the wall's velocity;
    // the last term is lost in the impact, and where the particles' velocity says nothing of a ghost's.
    const double jump = target - (node.velocity[c] - node.increment[c]);
    action.work += impulse * target;
    action.impact_loss += 0.5 * node.mass * jump * jump;
    action.kinetic_change += impulse * (node.velocity[c] + 0.5 * change);
    action.generalized_impulse += impulse * full;
    action.virial[c] += impulse * x;
    if (normal_wall >= 0) action.normal_impulse[normal_wall] += impulse;
    action.max_speed = std::max(action.max_speed, std::sqrt(3.0) * std::abs(target));
    node.velocity[c] = target;
    node.increment[c] += change;
  }
};

/// What the walls of an axis are to a plane of nodes: the one that holds it, the one whose mirror it is, or
/// none (-1).
struct Walls::Role {
  int holding = -1, mirroring = -1;
  bool any() const { return holding >= 0 || mirroring >= 0; }
};

/// The nodes that the walls of some axes tie to a mirror node, itself first. Components that the same axes
/// constrain share them.
struct Walls::Ties {
  struct Tied {
    Node* node;
    std::array<std::int8_t, 3> out;  ///< planes outward from the mirror
    double ratio;                    ///< r_g: of its velocity to the mirror's, were the walls at rest
  };
  static constexpr int planes = Reach::most_ghosts + 1, most = planes * planes * planes;
  std::uint32_t axes = 0;  ///< bit a
  int count = 0;
  std::array<Tied, most> nodes;

  void find(const SparseGrid& grid, std::uint32_t leaf, const Index3& mirror, std::uint32_t along,
            const std::array<Role, 3>& roles, const std::array<Reach, 6>& reach) {
    axes = along;
    count = 0;
    int last[3];
    for (int a = 0; a < 3; ++a) last[a] = axes >> a & 1 ? reach[roles[a].mirroring].ghosts : 0;
    std::array<std::int8_t, 3> out;
    for (out[0] = 0; out[0] <= last[0]; ++out[0])
      for (out[1] = 0; out[1] <= last[1]; ++out[1])
        for (out[2] = 0; out[2] <= last[2]; ++out[2]) {
          Index3 at = mirror;
          double ratio = 1;
          for (int a = 0; a < 3; ++a) {
            if (out[a] == 0) continue;
            at[a] = reach[roles[a].mirroring].ghost(out[a]);
            ratio *= reach[roles[a].mirroring].ratio[out[a]];
          }
          if (Node* node = node_at(grid, leaf, at)) nodes[count++] = {node, out, ratio};
        }
  }
};

/// Whether a mirror node sees to the components of a held node that the walls of `axes` constrain.
bool Walls::is_ghost(const SparseGrid& grid, std::uint32_t leaf, const Index3& at, std::uint32_t axes,
                     const std::array<Role, 3>& roles, const std::array<Reach, 6>& reach) const {
  if (rule_ != WallRule::ghost) return false;
  Index3 mirror = at;
  for (int a = 0; a < 3; ++a) {
    if (!(axes >> a & 1)) continue;
    const Reach& r = reach[roles[a].holding];
    if (!r.extrapolates(at[a])) return false;
    mirror[a] = r.mirror;
  }
  return node_at(grid, leaf, mirror);
}

/// A component of a node beyond the walls of `axes` that no mirror node sees to takes a wall's velocity, its
/// normal one's if it can.
void Walls::set_held(const Index3& at, Node& node, int c, std::uint32_t axes, double ramp,
                     const std::array<Role, 3>& roles, Part& part) const {
  int last = -1;
  for (int a = 0; a < 3; ++a)
    if ((axes >> a & 1) && (last < 0 || a == c || last / 2 != c)) last = roles[a].holding;
  const double full = full_velocity_at(walls_[last], c, at[c]);
  part.set_velocity(node, c, from_centre(c, at[c]), ramp * full, full, last / 2 == c ? last : -1);
}

/// A component of a mirror node M. The ghost rule ties the ghosts to it,
///   v_g = b_g + r_g v_M,  one factor v <- v_w + (x_g - x_w)/(x_M - x_w) (v - v_w) an axis, tangential walls
///   first,
/// so that all of them are one unknown, which takes the momentum of all: v_M = sum r m (v - b) / sum r^2 m.
/// Were the forces on ghosts dropped instead, a uniform stress would not be in equilibrium at the wall.
void Walls::set_tied(const Ties& ties, const Index3& mirror, int c, double ramp,
                     const std::array<Role, 3>& roles, const std::array<Reach, 6>& reach, Part& part) const {
  double b[Ties::most], wall_velocity[3] = {}, momentum = 0, mass = 0;
  int last = -1;
  bool moving = false;
  for (int a = 0; a < 3; ++a) {
    if (!(ties.axes >> a & 1)) continue;
    const int wall = roles[a].mirroring;
    wall_velocity[a] = ramp * full_velocity_at(walls_[wall], c, mirror[c]);
    moving |= wall_velocity[a] != 0;
    if (last < 0 || a == c || last / 2 != c) last = wall;
  }
  for (int n = 0; n < ties.count; ++n) {
    const auto& [node, out, r] = ties.nodes[n];
    b[n] = 0;
    if (moving)
      for (const int a : {(c + 1) % 3, (c + 2) % 3, c})
        if (out[a] > 0)
          b[n] = wall_velocity[a] + reach[roles[a].mirroring].ratio[out[a]] * (b[n] - wall_velocity[a]);
    momentum += r * node->mass * (node->velocity[c] - b[n]);
    mass += r * r * node->mass;
  }
  const double v = momentum / mass, full = full_velocity_at(walls_[last], c, mirror[c]);
  for (int n = 0; n < ties.count; ++n) {
    const auto& [node, out, r] = ties.nodes[n];
    const int at = out[c] > 0 ? reach[roles[c].mirroring].ghost(out[c]) : mirror[c];
    part.set_velocity(*node, c, from_centre(c, at), b[n] + r * v, full, last / 2 == c ? last : -1);
  }
}

/// Every component of a node is set by the task of its mirror node, or by its own if it has none: no two
/// tasks meet.
void Walls::constrain_leaf(const SparseGrid& grid, std::uint32_t l, double ramp,
                           const std::array<Reach, 6>& reach, Part& part) const {
  const SparseGrid::Leaf& leaf = grid.leaves()[l];
  Role planes[3][block_edge];
  for (int a = 0; a < 3; ++a)
    for (int k = 0; k < block_edge; ++k)
      for (int w = 2 * a; w < 2 * a + 2; ++w) {
        const int at = leaf.origin[a] * block_edge + k;
        if (reach[w].holds(at)) planes[a][k].holding = w;
        if (rule_ == WallRule::ghost && reach[w].mirror == at) planes[a][k].mirroring = w;
      }
  for (int index = 0; index < block_cells; ++index) {
    const Index3 in_leaf{index >> 4, index >> 2 & 3, index & 3};
    const std::array<Role, 3> roles{planes[0][in_leaf[0]], planes[1][in_leaf[1]], planes[2][in_leaf[2]]};
    if (!(roles[0].any() || roles[1].any() || roles[2].any())) continue;
    Node& node = leaf.nodes[index];
    if (node.mass <= 0) continue;
    Index3 at;
    std::uint32_t holding = 0, mirroring = 0;  // bit a
    for (int a = 0; a < 3; ++a) {
      at[a] = leaf.origin[a] * block_edge + in_leaf[a];
      holding |= std::uint32_t(roles[a].holding >= 0) << a;
      mirroring |= std::uint32_t(roles[a].mirroring >= 0) << a;
    }
    // Components that the same axes constrain share what is looked up.
    Ties ties;
    std::uint32_t held_along = 0;
    bool ghost = false;
    for (int c = 0; c < 3; ++c) {
      const std::uint32_t held = holding & constraining_[c], mirrored = mirroring & constraining_[c];
      if (held) {
        if (held != held_along) ghost = is_ghost(grid, l, at, held, roles, reach);
        held_along = held;
        if (!ghost) set_held(at, node, c, held, ramp, roles, part);
      } else if (mirrored) {
        if (mirrored != ties.axes) ties.find(grid, l, at, mirrored, roles, reach);
        set_tied(ties, at, c, ramp, roles, reach, part);
      }
    }
  }
}

WallAction Walls::apply(SparseGrid& grid, double time) const {
  const auto reach_of = [&](int w) { return Reach(walls_[w], rule_, cell_size_, grid_offset_[w / 2]); };
  const std::array<Reach, 6> reach{reach_of(0), reach_of(1), reach_of(2),
                                   reach_of(3), reach_of(4), reach_of(5)};
  const auto is_near = [&](const Index3& origin) {
    for (int w = 0; w < 6; ++w)
      if (reach[w].touches_leaf(origin[w / 2]) || reach[w].mirror >> 2 == origin[w / 2]) return true;
    return false;
  };
  constexpr std::size_t grain = 32;  // leaves
  return tbb::parallel_deterministic_reduce(
             tbb::blocked_range<std::size_t>(0, grid.leaves().size(), grain), Part(),
             [&](const tbb::blocked_range<std::size_t>& leaves, Part part) {
               for (std::size_t l = leaves.begin(); l < leaves.end(); ++l)
                 if (is_near(grid.leaves()[l].origin))
                   constrain_leaf(grid, std::uint32_t(l), ramp(time), reach, part);
               return part;
             },
             [](Part a, const Part& b) {
               a.action.add(b.action);
               return a;
             })
      .action;
}

void WallAction::add(const WallAction& other) {
  for (int w = 0; w < 6; ++w) normal_impulse[w] += other.normal_impulse[w];
  work += other.work;
  kinetic_change += other.kinetic_change;
  impact_loss += other.impact_loss;
  generalized_impulse += other.generalized_impulse;
  virial += other.virial;
  max_speed = std::max(max_speed, other.max_speed);
}

}  // namespace anticrack
