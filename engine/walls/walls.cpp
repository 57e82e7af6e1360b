#include "walls/walls.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_reduce.h>

#include <algorithm>
#include <bit>
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
  for (int c = 0; c < 3; ++c) {
    std::uint32_t axes = 1u << c;
    for (int a = 0; a < 3; ++a) axes |= std::uint32_t(walls_[2 * a].tangential != Tangential::free) << a;
    const auto same = std::ranges::find(constraints_, axes, &Constraint::axes);
    if (same != constraints_.end())
      same->components |= 1u << c;
    else
      constraints_.push_back({axes, 1u << c});
  }
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

/// The nodes of a leaf and of the leaves around it.
class Walls::Surroundings {
 public:
  Surroundings(const SparseGrid& grid, std::uint32_t leaf)
      : grid_(grid), leaf_(leaf), origin_(grid.leaves()[leaf].origin) {
    found_[at_centre] = grid.leaves()[leaf].nodes;
  }

  /// The active node at `at`, at most a leaf away; nullptr if there is none or it has no mass.
  Node* node(const Index3& at) {
    const int x = (at[0] >> 2) - origin_[0], y = (at[1] >> 2) - origin_[1], z = (at[2] >> 2) - origin_[2];
    const int which = at_centre + 9 * x + 3 * y + z;
    if (!(known_ >> which & 1)) {
      known_ |= 1u << which;
      found_[which] = find({x, y, z});
    }
    if (!found_[which]) return nullptr;
    Node* node = found_[which] + leaf_index(at[0] & 3, at[1] & 3, at[2] & 3);
    return node->mass > 0 ? node : nullptr;
  }

 private:
  Node* find(const Index3& step) const {
    std::uint32_t leaf = leaf_;
    for (int a = 0; a < 3 && leaf != SparseGrid::none; ++a)
      if (step[a] != 0) leaf = grid_.leaves()[leaf].neighbour[2 * a + (step[a] > 0)];
    // There may be none on the way.
    if (leaf == SparseGrid::none)
      leaf = grid_.find_leaf({origin_[0] + step[0], origin_[1] + step[1], origin_[2] + step[2]});
    return leaf == SparseGrid::none ? nullptr : grid_.leaves()[leaf].nodes;
  }

  static constexpr int at_centre = 13;
  const SparseGrid& grid_;
  std::uint32_t leaf_;
  Index3 origin_;
  std::uint32_t known_ = 1u << at_centre;
  std::array<Node*, 27> found_;
};

/// Sets one component of some nodes. Its sums stay in registers; those of the action might alias a node.
struct Walls::Setting {
  double impulse = 0, moment = 0, work = 0, impact_loss = 0, kinetic_change = 0, fastest = 0;

  /// `x`: c-th coordinate of the node from the centre of the box.
  void set_velocity(Node& node, int c, double x, double target) {
    const double change = target - node.velocity[c], by_wall = node.mass * change;
    // Change of kinetic energy = stress power with v^{n+1} (which strains the particles) + impulse . v^{n+1}
    // - m |dv|^2 / 2. Summed over tied nodes impulse . v^{n+1} is the net impulse times the wall's velocity;
    // the last term is lost in the impact, and where the particles' velocity says nothing of a ghost's.
    const double jump = target - (node.velocity[c] - node.increment[c]);
    impulse += by_wall;
    moment += by_wall * x;
    work += by_wall * target;
    impact_loss += 0.5 * node.mass * jump * jump;
    kinetic_change += by_wall * (node.velocity[c] + 0.5 * change);
    fastest = std::max(fastest, std::abs(target));
    node.velocity[c] = target;
    node.increment[c] += change;
  }

  /// `full` is the wall's velocity at the end of the ramp, `normal_wall` the wall that c is normal to, or -1.
  void add_to(WallAction& action, int c, double full, int normal_wall) const {
    action.work += work;
    action.impact_loss += impact_loss;
    action.kinetic_change += kinetic_change;
    action.generalized_impulse += impulse * full;
    action.virial[c] += moment;
    if (normal_wall >= 0) action.normal_impulse[normal_wall] += impulse;
    action.max_speed = std::max(action.max_speed, std::sqrt(3.0) * fastest);
  }
};

/// What the walls of an axis are to a plane of nodes: the one that holds it, the one whose mirror it is, or
/// none (-1).
struct Walls::Role {
  int holding = -1, mirroring = -1;
};

/// The nodes that the walls of some axes tie to a mirror node, itself first.
struct Walls::Ties {
  struct Tied {
    Node* node;
    std::array<std::int8_t, 3> out;  ///< planes outward from the mirror
    double ratio;                    ///< r_g: of its velocity to the mirror's, were the walls at rest
  };
  static constexpr int planes = Reach::most_ghosts + 1, most = planes * planes * planes;
  int count = 0;
  std::array<Tied, most> nodes;
  double mass = 0;  ///< sum r^2 m [kg]

  Ties(Surroundings& around, const Index3& mirror, std::uint32_t axes, const std::array<Role, 3>& roles,
       const std::array<Reach, 6>& reach) {
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
          Node* node = around.node(at);
          if (!node) continue;
          nodes[count++] = {node, out, ratio};
          mass += ratio * ratio * node->mass;
        }
  }
};

/// Whether a mirror node sees to the components of a held node that the walls of `axes` constrain.
bool Walls::is_ghost(Surroundings& around, const Index3& at, std::uint32_t axes,
                     const std::array<Role, 3>& roles, const std::array<Reach, 6>& reach) const {
  if (rule_ != WallRule::ghost) return false;
  Index3 mirror = at;
  for (int a = 0; a < 3; ++a) {
    if (!(axes >> a & 1)) continue;
    const Reach& r = reach[roles[a].holding];
    if (!r.extrapolates(at[a])) return false;
    mirror[a] = r.mirror;
  }
  return around.node(mirror);
}

/// A component of a node beyond the walls of `axes` that no mirror node sees to takes a wall's velocity, its
/// normal one's if it can.
void Walls::set_held(const Index3& at, Node& node, int c, std::uint32_t axes, double ramp,
                     const std::array<Role, 3>& roles, WallAction& action) const {
  int last = -1;
  for (int a = 0; a < 3; ++a)
    if ((axes >> a & 1) && (last < 0 || a == c || last / 2 != c)) last = roles[a].holding;
  const double full = full_velocity_at(walls_[last], c, at[c]);
  Setting setting;
  setting.set_velocity(node, c, from_centre(c, at[c]), ramp * full);
  setting.add_to(action, c, full, last / 2 == c ? last : -1);
}

/// A component of a mirror node M. The ghost rule ties the ghosts to it,
///   v_g = b_g + r_g v_M,  one factor v <- v_w + (x_g - x_w)/(x_M - x_w) (v - v_w) an axis, tangential walls
///   first,
/// so that all of them are one unknown, which takes the momentum of all: v_M = sum r m (v - b) / sum r^2 m.
/// Were the forces on ghosts dropped instead, a uniform stress would not be in equilibrium at the wall.
void Walls::set_tied(const Ties& ties, const Index3& mirror, int c, std::uint32_t axes, double ramp,
                     const std::array<Role, 3>& roles, const std::array<Reach, 6>& reach,
                     WallAction& action) const {
  double wall_velocity[3] = {}, full = 0;
  bool moving = false;
  int normal_wall = -1;
  for (const int a : {(c + 1) % 3, (c + 2) % 3, c}) {
    if (!(axes >> a & 1)) continue;
    const int wall = roles[a].mirroring;
    full = full_velocity_at(walls_[wall], c, mirror[c]);
    wall_velocity[a] = ramp * full;
    moving |= full != 0;
    if (a == c) normal_wall = wall;
  }
  double b[Ties::most], momentum = 0;
  for (int n = 0; n < ties.count; ++n) {
    const auto& [node, out, r] = ties.nodes[n];
    b[n] = 0;
    if (moving)
      for (const int a : {(c + 1) % 3, (c + 2) % 3, c})
        if (out[a] > 0)
          b[n] = wall_velocity[a] + reach[roles[a].mirroring].ratio[out[a]] * (b[n] - wall_velocity[a]);
    momentum += r * node->mass * (node->velocity[c] - b[n]);
  }
  const double v = momentum / ties.mass, x = from_centre(c, mirror[c]);
  const double outward = normal_wall >= 0 && !walls_[normal_wall].upper ? -cell_size_ : cell_size_;
  Setting setting;
  for (int n = 0; n < ties.count; ++n) {
    const auto& [node, out, r] = ties.nodes[n];
    setting.set_velocity(*node, c, x + out[c] * outward, b[n] + r * v);
  }
  setting.add_to(action, c, full, normal_wall);
}

/// Every component of a node is set by the task of its mirror node, or by its own if it has none: no two
/// tasks meet.
void Walls::constrain_leaf(const SparseGrid& grid, std::uint32_t l, double ramp,
                           const std::array<Reach, 6>& reach, WallAction& action) const {
  const SparseGrid::Leaf& leaf = grid.leaves()[l];
  Role planes[3][block_edge];
  std::uint64_t near = 0;  // bit leaf_index: nodes in a plane that has a role
  for (int a = 0; a < 3; ++a)
    for (int k = 0; k < block_edge; ++k)
      for (int w = 2 * a; w < 2 * a + 2; ++w) {
        constexpr std::uint64_t lowest_plane[3] = {0xFFFF, 0x000F000F000F000F, 0x1111111111111111};
        const int at = leaf.origin[a] * block_edge + k;
        const bool mirrors = rule_ == WallRule::ghost && reach[w].mirror == at;
        if (reach[w].holds(at)) planes[a][k].holding = w;
        if (mirrors) planes[a][k].mirroring = w;
        if (mirrors || reach[w].holds(at)) near |= lowest_plane[a] << (k * (16 >> 2 * a));
      }
  for (std::uint64_t nodes = near; nodes; nodes &= nodes - 1)
    __builtin_prefetch(&leaf.nodes[std::countr_zero(nodes)], 1);
  Surroundings around(grid, l);
  for (; near; near &= near - 1) {
    const int index = std::countr_zero(near);
    Node& node = leaf.nodes[index];
    if (node.mass <= 0) continue;
    const Index3 in_leaf{index >> 4, index >> 2 & 3, index & 3};
    const std::array<Role, 3> roles{planes[0][in_leaf[0]], planes[1][in_leaf[1]], planes[2][in_leaf[2]]};
    Index3 at;
    std::uint32_t holding = 0, mirroring = 0;  // bit a
    for (int a = 0; a < 3; ++a) {
      at[a] = leaf.origin[a] * block_edge + in_leaf[a];
      holding |= std::uint32_t(roles[a].holding >= 0) << a;
      mirroring |= std::uint32_t(roles[a].mirroring >= 0) << a;
    }
    for (const Constraint& constraint : constraints_) {
      const std::uint32_t held = holding & constraint.axes, mirrored = mirroring & constraint.axes;
      if (held) {
        if (is_ghost(around, at, held, roles, reach)) continue;
        for (int c = 0; c < 3; ++c)
          if (constraint.components >> c & 1) set_held(at, node, c, held, ramp, roles, action);
      } else if (mirrored) {
        const Ties ties(around, at, mirrored, roles, reach);
        for (int c = 0; c < 3; ++c)
          if (constraint.components >> c & 1) set_tied(ties, at, c, mirrored, ramp, roles, reach, action);
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
      tbb::blocked_range<std::size_t>(0, grid.leaves().size(), grain), WallAction(),
      [&](const tbb::blocked_range<std::size_t>& leaves, WallAction action) {
        for (std::size_t l = leaves.begin(); l < leaves.end(); ++l)
          if (is_near(grid.leaves()[l].origin))
            constrain_leaf(grid, std::uint32_t(l), ramp(time), reach, action);
        return action;
      },
      [](WallAction a, const WallAction& b) {
        a.add(b);
        return a;
      });
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
