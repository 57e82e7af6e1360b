#pragma once

#include <Eigen/Dense>
#include <cmath>
#include <map>
#include <vector>

#include "numerics.h"
#include "time_step.h"
#include "vec3.h"

namespace anticrack::reference {

/// Algorithm 1 as it is printed: full F, an SVD a particle, loops over a map of nodes. Slow and plain; the
/// engine must match it to rounding. Deviations from the print are those of the engine's documentation:
/// implicit return mapping by bisection, equal to the closed form, and the walls.
struct Particle {
  Vec3 x, v = Vec3::Zero();
  Mat3 F = Mat3::Identity();
  double kappa = 0;
  Mat3 C = Mat3::Zero();  ///< APIC, Jiang et al. (2015)
};

struct GridNode {
  double m = 0;
  Vec3 momentum = Vec3::Zero(), f = Vec3::Zero(), v_old = Vec3::Zero(), v = Vec3::Zero();
};

inline double spline(double u) {
  u = std::abs(u);
  if (u < 0.5) return 0.75 - u * u;
  if (u < 1.5) return 0.5 * (1.5 - u) * (1.5 - u);
  return 0;
}
inline double spline_derivative(double u) {
  const double a = std::abs(u), sign = u < 0 ? -1 : 1;
  if (a < 0.5) return -2 * u;
  if (a < 1.5) return -sign * (1.5 - a);
  return 0;
}

/// The wall rules node by node.
struct PlainWall {
  int axis;
  bool upper;
  double position, velocity;
  bool sticky = false;
};

struct Model {
  Material material;
  double dx, mass, volume, flip;
  bool apic = false;
  Vec3 offset = Vec3::Zero();
  WallRule wall_rule = WallRule::ghost;
  std::vector<PlainWall> walls;
  std::vector<Particle> particles;
  std::map<std::array<int, 3>, GridNode> grid;

  Vec3 node_position(const std::array<int, 3>& i) const { return dx * (Vec3(i[0], i[1], i[2]) + offset); }

  template <class Visit>
  void for_each_node(const Vec3& x, Visit visit) {
    const Vec3 X = x / dx - offset;
    for (int i = int(std::floor(X[0])) - 2; i <= X[0] + 2; ++i)
      for (int j = int(std::floor(X[1])) - 2; j <= X[1] + 2; ++j)
        for (int k = int(std::floor(X[2])) - 2; k <= X[2] + 2; ++k) {
          const double u[3] = {X[0] - i, X[1] - j, X[2] - k};
          const double N[3] = {spline(u[0]), spline(u[1]), spline(u[2])};
          if (N[0] * N[1] * N[2] == 0) continue;
          const Vec3 dN = Vec3(spline_derivative(u[0]) * N[1] * N[2], N[0] * spline_derivative(u[1]) * N[2],
                               N[0] * N[1] * spline_derivative(u[2])) /
                          dx;
          visit(std::array<int, 3>{i, j, k}, N[0] * N[1] * N[2], dN);
        }
  }

  Mat3 kirchhoff_stress(const Mat3& F) const {
    const Eigen::JacobiSVD<Mat3> svd(F, Eigen::ComputeFullU | Eigen::ComputeFullV);
    const Vec3 eps = svd.singularValues().array().log();
    const Vec3 tau =
        material.elasticity.lambda() * eps.sum() * Vec3::Ones() + 2 * material.elasticity.mu() * eps;
    return svd.matrixU() * tau.asDiagonal() * svd.matrixU().transpose();
  }

  void return_mapping(Vec3& eps, double& kappa) const {
    if (!material.plasticity) return;
    const auto& [gamma, c, xi] = *material.plasticity;
    const double mu = material.elasticity.mu(), K = material.elasticity.bulk_modulus();
    const double A = gamma / (std::sqrt(6.0) * mu), e = eps.sum();
    const Vec3 dev = eps - e / 3 * Vec3::Ones();
    const double S = dev.norm();
    const auto C = [&](double k) { return c * std::exp(-xi * k); };
    if (S + A * (K * e - C(kappa)) <= 0 && K * e <= C(kappa)) return;
    if (K * e >= C(kappa + S)) {
      kappa += S;
      eps = C(kappa) / (3 * K) * Vec3::Ones();
      return;
    }
    double low = 0, high = S;  // the only root of S - x + A (K e - C(kappa + x))
    for (int n = 0; n < 200; ++n) {
      const double x = 0.5 * (low + high);
      (S - x + A * (K * e - C(kappa + x)) > 0 ? low : high) = x;
    }
    kappa += high;
    eps = e / 3 * Vec3::Ones() + A * (C(kappa) - K * e) / S * dev;
  }

  /// Wall coordinate, mirror node and whether a node is held, all along the wall's axis.
  double wall_coordinate(const PlainWall& w) const { return w.position / dx - offset[w.axis]; }
  int mirror_of(const PlainWall& w) const {
    const double X = wall_coordinate(w);
    return w.upper ? int(std::floor(X - 0.5)) : int(std::ceil(X + 0.5));
  }
  /// Whether the walls of an axis have a mirror node each; those that grip a thin sample may not.
  bool have_mirrors(int axis) const {
    int mirror[2] = {};
    for (const PlainWall& w : walls)
      if (w.axis == axis) mirror[w.upper] = mirror_of(w);
    return mirror[0] < mirror[1];
  }
  bool holds(const PlainWall& w, int n) const {
    if (wall_rule == WallRule::paper) return w.upper ? n >= wall_coordinate(w) : n <= wall_coordinate(w);
    return w.upper ? n > mirror_of(w) : n < mirror_of(w);
  }
  /// v_g = b + r v_M for a node: its free node M, and the factor of each wall that holds it, tangential ones
  /// first.
  struct Tie {
    std::array<int, 3> free;
    double r = 1, b = 0;
    bool held = false, extrapolated = true;
  };
  Tie tie_of(const std::array<int, 3>& i, int c) const {
    Tie t{i};
    for (const bool normal : {false, true})
      for (const PlainWall& w : walls) {
        if ((w.axis == c) != normal || (!normal && !w.sticky) || !holds(w, i[w.axis])) continue;
        const double X = wall_coordinate(w), v_wall = normal ? w.velocity : 0;
        const double rho = (i[w.axis] - X) / (mirror_of(w) - X);
        t.held = true;
        t.extrapolated = t.extrapolated && std::abs(i[w.axis] - X) <= 1.5 && have_mirrors(w.axis);
        t.free[w.axis] = mirror_of(w);
        t.b = v_wall + rho * (t.b - v_wall);
        t.r *= rho;
      }
    return t;
  }

  void apply_walls() {
    for (int c = 0; c < 3; ++c) {
      std::map<std::array<int, 3>, std::pair<double, double>>
          sums;  // of a free node: sum r m (v - b), sum r^2 m
      for (const auto& [i, node] : grid) {
        const Tie t = tie_of(i, c);
        if (t.held && (!t.extrapolated || wall_rule == WallRule::paper)) continue;
        sums[t.free].first += t.r * node.m * (node.v[c] - t.b);
        sums[t.free].second += t.r * t.r * node.m;
      }
      for (auto& [i, node] : grid) {
        const Tie t = tie_of(i, c);
        if (t.extrapolated && grid.count(t.free) && wall_rule == WallRule::ghost) {
          const auto& [momentum, mass] = sums.at(t.free);
          node.v[c] = t.b + t.r * momentum / mass;
        } else if (t.held) {
          node.v[c] = 0;
          for (const PlainWall& w : walls)
            if (w.axis == c && holds(w, i[c])) node.v[c] = w.velocity;
        }
      }
    }
  }

  void step(double dt) {
    grid.clear();
    for (const Particle& p : particles) {
      const Mat3 tau = kirchhoff_stress(p.F);
      for_each_node(p.x, [&](const std::array<int, 3>& i, double N, const Vec3& dN) {
        GridNode& node = grid[i];
        node.m += mass * N;
        node.momentum += mass * N * (p.v + p.C * (node_position(i) - p.x));
        node.f -= volume * tau * dN;
      });
    }
    for (auto& [i, node] : grid) {
      node.v_old = node.momentum / node.m;
      node.v = node.v_old + dt / node.m * node.f;
    }
    apply_walls();
    for (Particle& p : particles) {
      Vec3 pic = Vec3::Zero(), increment = Vec3::Zero();
      Mat3 L = Mat3::Zero(), B = Mat3::Zero();
      for_each_node(p.x, [&](const std::array<int, 3>& i, double N, const Vec3& dN) {
        const GridNode& node = grid.at(i);
        pic += N * node.v;
        increment += N * (node.v - node.v_old);
        L += node.v * dN.transpose();
        B += N * node.v * (node_position(i) - p.x).transpose();
      });
      const Mat3 F = (Mat3::Identity() + dt * L) * p.F;
      const Eigen::JacobiSVD<Mat3> svd(F, Eigen::ComputeFullU | Eigen::ComputeFullV);
      Vec3 eps = svd.singularValues().array().log();
      return_mapping(eps, p.kappa);
      p.F = svd.matrixU() * Vec3(eps.array().exp()).asDiagonal() * svd.matrixV().transpose();
      p.v = apic ? pic : flip * (p.v + increment) + (1 - flip) * pic;
      if (apic) p.C = 4 / (dx * dx) * B;
      p.x += dt * pic;
    }
    for (PlainWall& w : walls) w.position += dt * w.velocity;
  }
};

}  // namespace anticrack::reference
