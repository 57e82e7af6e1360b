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
  bool by_ghosts;  ///< extrapolates beyond the mirror; otherwise the nodes that it holds take its velocity
  static constexpr int most_ghosts = 3;
  int ghosts = 0;                 ///< planes outward from the mirror that a particle inside reaches
  double ratio[most_ghosts + 1];  ///< (x_g - x_w) / (x_j - x_w) of the k-th plane outward from the mirror

  Reach(const Wall& wall, WallRule rule, double cell_size, double offset)
      : upper(wall.upper), by_ghosts(rule == WallRule::ghost) {
    const double inward = wall.upper ? -1 : 1;
    X = (wall.position + inward * wall.grip_depth) / cell_size - offset;
    if (by_ghosts) {
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

/// A leaf and the leaves around it.
class Walls::Surroundings {
 public:
  Surroundings(const SparseGrid& grid, std::uint32_t leaf)
      : origin(grid.leaves()[leaf].origin), grid_(grid), leaf_(leaf) {}

  /// The leaf so many leaves away, at most one along each axis; nullptr if there is none.
  const SparseGrid::Leaf* leaf(const Index3& step) {
    const int which = 13 + 9 * step[0] + 3 * step[1] + step[2];
    if (!(known_ >> which & 1)) {
      known_ |= 1u << which;
      found_[which] = find(step);
    }
    return found_[which];
  }

  const Index3 origin;  ///< leaf coordinate

 private:
  const SparseGrid::Leaf* find(const Index3& step) const {
    std::uint32_t leaf = leaf_;
    for (int a = 0; a < 3 && leaf != SparseGrid::none; ++a)
      if (step[a] != 0) leaf = grid_.leaves()[leaf].neighbour[2 * a + (step[a] > 0)];
    // There may be none on the way.
    if (leaf == SparseGrid::none)
      leaf = grid_.find_leaf({origin[0] + step[0], origin[1] + step[1], origin[2] + step[2]});
    return leaf == SparseGrid::none ? nullptr : &grid_.leaves()[leaf];
  }

  const SparseGrid& grid_;
  std::uint32_t leaf_, known_ = 0;
  std::array<const SparseGrid::Leaf*, 27> found_;
};

/// Sets one component of some nodes. Its sums stay in registers; those of the action might alias a node.
struct Walls::Setting {
  double impulse = 0, moment = 0, work = 0, fastest = 0;
  double impact_loss = 0, kinetic_change = 0;  ///< doubled

  /// `x`: c-th coordinate of the node from the centre of the box.
  void set_velocity(Node& node, int c, double x, double target) {
    const double change = target - node.velocity[c], by_wall = node.mass * change;
    // Change of kinetic energy = stress power with v^{n+1} (which strains the particles) + impulse . v^{n+1}
    // - m |dv|^2 / 2. Summed over tied nodes impulse . v^{n+1} is the net impulse times the wall's velocity;
    // the last term is lost in the impact, and where the particles' velocity says nothing of a ghost's.
    const double jump = node.increment[c] + change;
    impulse += by_wall;
    moment += by_wall * x;
    work += by_wall * target;
    impact_loss += node.mass * jump * jump;
    kinetic_change += by_wall * (node.velocity[c] + target);
    fastest = std::max(fastest, std::abs(target));
    node.velocity[c] = target;
    node.increment[c] = jump;
  }

  /// `full` is the wall's velocity at the end of the ramp, `normal_wall` the wall that c is normal to, or -1.
  void add_to(WallAction& action, int c, double full, int normal_wall) const {
    action.work += work;
    action.impact_loss += 0.5 * impact_loss;
    action.kinetic_change += 0.5 * kinetic_change;
    action.generalized_impulse += impulse * full;
    action.virial[c] += moment;
    if (normal_wall >= 0) action.normal_impulse[normal_wall] += impulse;
    action.max_speed = std::max(action.max_speed, std::sqrt(3.0) * fastest);
  }
};

/// Nodes of a leaf in plane k of an axis, bit leaf_index.
static constexpr std::uint64_t plane(int axis, int k) {
  constexpr std::uint64_t lowest[3] = {0xFFFF, 0x000F000F000F000F, 0x1111111111111111};
  return lowest[axis] << (k * (16 >> 2 * axis));
}

/// What the walls of an axis are to a plane of nodes.
struct Walls::Role {
  enum Kind { free, mirror, ghost, held };
  Kind kind = free;  ///< `held`: held, but out of reach of the mirror nodes
  int wall = -1;
  int to_mirror = 0;  ///< leaves from a ghost to its mirror
  bool operator==(const Role&) const = default;

  Role() = default;
  Role(int axis, int node, const std::array<Reach, 6>& reach) {
    for (int w = 2 * axis; w < 2 * axis + 2; ++w) {
      const Reach& r = reach[w];
      if (!r.holds(node)) {
        if (r.by_ghosts && r.mirror == node && kind <= mirror) kind = mirror, wall = w;
      } else if (r.by_ghosts && r.extrapolates(node)) {
        kind = ghost, wall = w, to_mirror = (r.mirror >> 2) - (node >> 2);
      } else {
        kind = held, wall = w, to_mirror = 0;
      }
    }
  }
};

/// The planes of a leaf along an axis, those of one role together.
struct Walls::Slices {
  struct Slice {
    Role role;
    std::uint64_t nodes;  ///< bit leaf_index
  };
  int count = 0;
  Slice slices[block_edge];

  void add(const Role& role, std::uint64_t nodes) {
    if (count == 0 || !(slices[count - 1].role == role)) slices[count++] = {role, 0};
    slices[count - 1].nodes |= nodes;
  }
  const Slice* begin() const { return slices; }
  const Slice* end() const { return slices + count; }
};

/// The mirror nodes of the same walls in a leaf and the nodes tied to them, which lie alike for all. Mirror
/// nodes are counted from the first one in the leaf's order: bit i and index i are the i-th after it, or the
/// node tied to that.
struct Walls::Ties {
  struct Tied {
    Node* nodes;
    std::uint64_t occupied;
    std::array<std::int8_t, 3> out;  ///< planes outward from the mirror
    double ratio;                    ///< r_g: of its velocity to the mirror's, were the walls at rest
  };
  static constexpr int planes = Reach::most_ghosts + 1, most = planes * planes * planes;
  Index3 first;  ///< mirror node
  Index3 walls;  ///< of axis a, or -1
  std::uint32_t components;
  int count = 0;
  std::array<Tied, most> tied;  ///< mirror nodes first

  Ties(Surroundings& around, const Index3& first, std::uint64_t mirrors, const Index3& walls,
       std::uint32_t components, const std::array<Reach, 6>& reach)
      : first(first), walls(walls), components(components) {
    int last[3];
    for (int a = 0; a < 3; ++a) last[a] = walls[a] >= 0 ? reach[walls[a]].ghosts : 0;
    std::array<std::int8_t, 3> out;
    for (out[0] = 0; out[0] <= last[0]; ++out[0])
      for (out[1] = 0; out[1] <= last[1]; ++out[1])
        for (out[2] = 0; out[2] <= last[2]; ++out[2]) {
          Index3 at = first, step;
          double ratio = 1;
          for (int a = 0; a < 3; ++a) {
            if (out[a] > 0) at[a] = reach[walls[a]].ghost(out[a]), ratio *= reach[walls[a]].ratio[out[a]];
            step[a] = (at[a] >> 2) - around.origin[a];
          }
          const SparseGrid::Leaf* const leaf = around.leaf(step);
          if (!leaf) continue;
          const int index = leaf_index(at[0] & 3, at[1] & 3, at[2] & 3);
          tied[count++] = {leaf->nodes + index, leaf->occupied >> index & mirrors, out, ratio};
        }
  }

  void prefetch() const {
    for (int n = 0; n < count; ++n)
      for (std::uint64_t rest = tied[n].occupied; rest; rest &= rest - 1)
        __builtin_prefetch(&tied[n].nodes[std::countr_zero(rest)], 1);
  }
};

/// Nodes beyond `walls` (of axis a, or -1) that no mirror node sees to take a wall's velocity, a normal one's
/// if they can.
void Walls::set_held(Node& node, const Index3& at, std::uint32_t components, const Index3& walls, double ramp,
                     WallAction& action) const {
  for (int c = 0; c < 3; ++c) {
    if (!(components >> c & 1)) continue;
    const int wall = walls[c] >= 0 ? walls[c] : *std::ranges::max_element(walls);
    const double full = full_velocity_at(walls_[wall], c, at[c]);
    Setting setting;
    setting.set_velocity(node, c, from_centre(c, at[c]), ramp * full);
    setting.add_to(action, c, full, walls[c]);
  }
}

/// Component c of mirror nodes M. The ghost rule ties the ghosts to them,
///   v_g = b_g + r_g v_M,  one factor v <- v_w + (x_g - x_w)/(x_M - x_w) (v - v_w) an axis, tangential walls
///   first,
/// so that all of them are one unknown, which takes the momentum of all: v_M = sum r m (v - b) / sum r^2 m.
/// Were the forces on ghosts dropped instead, a uniform stress would not be in equilibrium at the wall.
void Walls::set_tied(const Ties& ties, int c, double ramp, const std::array<Reach, 6>& reach,
                     WallAction& action) const {
  const int normal_wall = ties.walls[c];
  const int first = leaf_index(ties.first[0] & 3, ties.first[1] & 3, ties.first[2] & 3);
  const double outward = normal_wall >= 0 && !walls_[normal_wall].upper ? -cell_size_ : cell_size_;
  for (int at = ties.first[c]; at <= (ties.first[c] | 3); ++at) {  // b depends on this coordinate only
    std::uint64_t mirrors = ties.tied[0].occupied & plane(c, at & 3) >> first;
    if (!mirrors) continue;
    double wall_velocity[3] = {}, full = 0;
    for (const int a : {(c + 1) % 3, (c + 2) % 3, c}) {
      if (ties.walls[a] < 0) continue;
      full = full_velocity_at(walls_[ties.walls[a]], c, at);
      wall_velocity[a] = ramp * full;
    }
    const double centre_to_mirror = from_centre(c, at);
    double b[Ties::most], x[Ties::most];
    for (int n = 0; n < ties.count; ++n) {
      const auto& out = ties.tied[n].out;
      x[n] = centre_to_mirror + out[c] * outward;
      b[n] = 0;
      for (const int a : {(c + 1) % 3, (c + 2) % 3, c})
        if (out[a] > 0)
          b[n] = wall_velocity[a] + reach[ties.walls[a]].ratio[out[a]] * (b[n] - wall_velocity[a]);
    }
    Setting setting;
    for (; mirrors; mirrors &= mirrors - 1) {
      const int i = std::countr_zero(mirrors);
      double momentum = 0, mass = 0;
      for (int n = 0; n < ties.count; ++n) {
        const Node& node = ties.tied[n].nodes[i];
        const double r = ties.tied[n].ratio;
        momentum += r * node.mass * (node.velocity[c] - b[n]);
        mass += r * r * node.mass;
      }
      const double v = momentum / mass;
      for (int n = 0; n < ties.count; ++n)
        if (ties.tied[n].occupied >> i & 1)
          setting.set_velocity(ties.tied[n].nodes[i], c, x[n], b[n] + ties.tied[n].ratio * v);
    }
    setting.add_to(action, c, full, normal_wall);
  }
}

/// Every node belongs to the task of its mirror node's leaf, or of its own if there is no such leaf: no two
/// tasks meet. The ties are only collected, and set when their nodes have come from memory.
void Walls::constrain_leaf(const SparseGrid& grid, std::uint32_t l, double ramp,
                           const std::array<Reach, 6>& reach, std::vector<Ties>& ties,
                           WallAction& action) const {
  const SparseGrid::Leaf& leaf = grid.leaves()[l];
  std::array<Slices, 3> slices;
  Slices whole;
  whole.add({}, ~std::uint64_t{0});
  for (int a = 0; a < 3; ++a)
    for (int k = 0; k < block_edge; ++k)
      slices[a].add(Role(a, leaf.origin[a] * block_edge + k, reach), plane(a, k));
  Surroundings around(grid, l);
  const auto coordinates = [&](int index) {
    return Index3{leaf.origin[0] * block_edge + (index >> 4), leaf.origin[1] * block_edge + (index >> 2 & 3),
                  leaf.origin[2] * block_edge + (index & 3)};
  };
  const auto constrain = [&](const Constraint& constraint, const std::array<Role, 3>& roles,
                             std::uint64_t nodes) {
    const Role::Kind kind = std::max({roles[0].kind, roles[1].kind, roles[2].kind});
    if (kind == Role::free) return;
    Index3 walls, step;
    for (int a = 0; a < 3; ++a) {
      walls[a] = kind == Role::mirror || roles[a].kind >= Role::ghost ? roles[a].wall : -1;
      step[a] = roles[a].to_mirror;
    }
    if (kind == Role::ghost && around.leaf(step)) return;  // that leaf's task
    if (kind != Role::mirror) {
      for (nodes &= leaf.occupied; nodes; nodes &= nodes - 1) {
        const int index = std::countr_zero(nodes);
        set_held(leaf.nodes[index], coordinates(index), constraint.components, walls, ramp, action);
      }
      return;
    }
    const int first = std::countr_zero(nodes);
    ties.emplace_back(around, coordinates(first), nodes >> first, walls, constraint.components, reach);
    ties.back().prefetch();
    // Ghosts whose mirror node has no mass.
    for (int n = 1; n < ties.back().count; ++n) {
      const auto& [tied, occupied, out, r] = ties.back().tied[n];
      for (std::uint64_t rest = occupied & ~ties.back().tied[0].occupied; rest; rest &= rest - 1) {
        const int i = std::countr_zero(rest);
        Index3 at = coordinates(first + i), holding{-1, -1, -1};
        for (int a = 0; a < 3; ++a)
          if (out[a] > 0) at[a] = reach[walls[a]].ghost(out[a]), holding[a] = walls[a];
        set_held(tied[i], at, constraint.components, holding, ramp, action);
      }
    }
  };
  for (const Constraint& constraint : constraints_) {
    const auto along = [&](int a) -> const Slices& { return constraint.axes >> a & 1 ? slices[a] : whole; };
    for (const auto& x : along(0))
      for (const auto& y : along(1))
        for (const auto& z : along(2))
          constrain(constraint, {x.role, y.role, z.role}, x.nodes & y.nodes & z.nodes);
  }
}

WallAction Walls::apply(SparseGrid& grid, double time) const {
  const auto reach_of = [&](int w) { return Reach(walls_[w], rule_, cell_size_, grid_offset_[w / 2]); };
  std::array<Reach, 6> reach{reach_of(0), reach_of(1), reach_of(2), reach_of(3), reach_of(4), reach_of(5)};
  // Walls that grip a thin sample may leave one plane of nodes between them, which cannot mirror both.
  for (int a = 0; a < 3; ++a)
    if (reach[2 * a].mirror >= reach[2 * a + 1].mirror)
      reach[2 * a].by_ghosts = reach[2 * a + 1].by_ghosts = false;
  const auto is_near = [&](const Index3& origin) {
    for (int w = 0; w < 6; ++w)
      if (reach[w].touches_leaf(origin[w / 2]) || reach[w].mirror >> 2 == origin[w / 2]) return true;
    return false;
  };
  constexpr std::size_t grain = 32;  // leaves
  return tbb::parallel_deterministic_reduce(
      tbb::blocked_range<std::size_t>(0, grid.leaves().size(), grain), WallAction(),
      [&](const tbb::blocked_range<std::size_t>& leaves, WallAction action) {
        std::vector<Ties> ties;
        ties.reserve(leaves.size());
        for (std::size_t l = leaves.begin(); l < leaves.end(); ++l)
          if (is_near(grid.leaves()[l].origin))
            constrain_leaf(grid, std::uint32_t(l), ramp(time), reach, ties, action);
        for (const Ties& t : ties)
          for (int c = 0; c < 3; ++c)
            if (t.components >> c & 1) set_tied(t, c, ramp(time), reach, action);
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
