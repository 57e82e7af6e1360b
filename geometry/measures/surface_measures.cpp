#include "measures/surface_measures.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <tuple>
#include <vector>

#include "errors.h"

namespace anticrack {
namespace {

constexpr double pi = std::numbers::pi;

// Sum of term(n) in an order that does not depend on threads.
template <typename Term>
double sum_in_order(std::size_t count, const Term& term) {
  constexpr std::size_t chunk = 4096;
  std::vector<double> sums((count + chunk - 1) / chunk, 0.0);
  tbb::parallel_for(std::size_t(0), sums.size(), [&](std::size_t c) {
    double sum = 0;
    for (std::size_t n = c * chunk; n < std::min(count, (c + 1) * chunk); ++n) sum += term(n);
    sums[c] = sum;
  });
  double sum = 0;
  for (double part : sums) sum += part;
  return sum;
}

using Triangle = std::array<Vec3, 3>;

Triangle corners(const SurfaceMesh& mesh, std::size_t n) {
  const auto& [a, b, c] = mesh.triangles[n];
  return {mesh.points[a].cast<double>(), mesh.points[b].cast<double>(), mesh.points[c].cast<double>()};
}

bool contains(const Window& window, const Vec3& x) {
  return (x.array() >= window.lower.array()).all() && (x.array() < window.upper.array()).all();
}

// Area of the part of a triangle inside the window: cut at each of the six planes (Sutherland & Hodgman
// 1974).
double area_inside(const Triangle& triangle, const Window& window) {
  if (contains(window, triangle[0]) && contains(window, triangle[1]) && contains(window, triangle[2]))
    return 0.5 * (triangle[1] - triangle[0]).cross(triangle[2] - triangle[0]).norm();
  std::array<Vec3, 9> polygon{triangle[0], triangle[1], triangle[2]}, cut;
  int count = 3;
  for (int plane = 0; plane < 6 && count > 0; ++plane) {
    const int axis = plane / 2;
    const double side = plane % 2 ? -1 : 1, bound = plane % 2 ? window.upper[axis] : window.lower[axis];
    const auto height = [&](const Vec3& x) { return side * (x[axis] - bound); };
    int kept = 0;
    for (int n = 0; n < count; ++n) {
      const Vec3 &a = polygon[n], &b = polygon[(n + 1) % count];
      const double at_a = height(a), at_b = height(b);
      if (at_a >= 0) cut[kept++] = a;
      if ((at_a >= 0) != (at_b >= 0)) cut[kept++] = a + at_a / (at_a - at_b) * (b - a);
    }
    polygon = cut;
    count = kept;
  }
  Vec3 twice = Vec3::Zero();
  for (int n = 1; n + 1 < count; ++n) twice += (polygon[n] - polygon[0]).cross(polygon[n + 1] - polygon[0]);
  return 0.5 * twice.norm();
}

// Length of the part of a segment inside the window.
double length_inside(const Vec3& a, const Vec3& b, const Window& window) {
  double from = 0, to = 1;
  for (int axis = 0; axis < 3; ++axis) {
    const double along = b[axis] - a[axis];
    if (along == 0) {
      if (a[axis] < window.lower[axis] || a[axis] >= window.upper[axis]) return 0;
      continue;
    }
    double enter = (window.lower[axis] - a[axis]) / along, leave = (window.upper[axis] - a[axis]) / along;
    if (along < 0) std::swap(enter, leave);
    from = std::max(from, enter);
    to = std::min(to, leave);
  }
  return from < to ? (to - from) * (b - a).norm() : 0;
}

// An edge as one triangle has it: from the lower to the higher point, or back.
struct HalfEdge {
  std::uint32_t low, high;
  std::uint32_t triangle;
  bool forward;

  auto key() const { return std::array<std::uint32_t, 2>{low, high}; }
};

std::vector<HalfEdge> sorted_half_edges(const SurfaceMesh& mesh) {
  std::vector<HalfEdge> edges(3 * mesh.triangles.size());
  tbb::parallel_for(std::size_t(0), mesh.triangles.size(), [&](std::size_t n) {
    for (int c = 0; c < 3; ++c) {
      const std::uint32_t from = mesh.triangles[n][c], to = mesh.triangles[n][(c + 1) % 3];
      edges[3 * n + c] = {std::min(from, to), std::max(from, to), std::uint32_t(n), from < to};
    }
  });
  tbb::parallel_sort(edges.begin(), edges.end(), [](const HalfEdge& a, const HalfEdge& b) {
    return std::tie(a.low, a.high, a.triangle) < std::tie(b.low, b.high, b.triangle);
  });
  return edges;
}

// First half edge of each edge, and the end.
std::vector<std::size_t> first_of_each(const std::vector<HalfEdge>& edges) {
  std::vector<std::size_t> first;
  for (std::size_t n = 0; n < edges.size(); ++n)
    if (n == 0 || edges[n].key() != edges[n - 1].key()) first.push_back(n);
  first.push_back(edges.size());
  return first;
}

// Angle by which the surface turns at an edge, > 0 where the solid is convex. Four or more triangles may meet
// at an edge: the solid's wedges lie between a forward triangle and the next backward one, turning from the
// forward one against its normal.
double turn_at(const SurfaceMesh& mesh, const HalfEdge* begin, const HalfEdge* end) {
  const Vec3 axis =
      (mesh.points[begin->high].cast<double>() - mesh.points[begin->low].cast<double>()).normalized();
  const Vec3 reference = axis.unitOrthogonal(), across = axis.cross(reference);
  std::vector<double> forward, backward;
  for (const HalfEdge* edge = begin; edge != end; ++edge) {
    const auto [a, b, c] = corners(mesh, edge->triangle);
    const Vec3 normal = (b - a).cross(c - a);
    const Vec3 inward = edge->forward ? normal.cross(axis) : axis.cross(normal);  // into the triangle
    if (!(inward.squaredNorm() > 0)) continue;                                    // no area: no direction
    (edge->forward ? forward : backward).push_back(std::atan2(inward.dot(across), inward.dot(reference)));
  }
  double turn = 0;
  for (double from : forward) {
    double wedge = 2 * pi;
    for (double to : backward) {
      const double angle = from - to;
      wedge = std::min(wedge, angle <= 0 ? angle + 2 * pi : angle);
    }
    if (!backward.empty()) turn += pi - wedge;
  }
  return turn;
}

double integral_of_mean_curvature(const SurfaceMesh& mesh, const Window& window) {
  const std::vector<HalfEdge> edges = sorted_half_edges(mesh);
  const std::vector<std::size_t> first = first_of_each(edges);
  return sum_in_order(first.size() - 1, [&](std::size_t n) {
    const HalfEdge& edge = edges[first[n]];
    const double length =
        length_inside(mesh.points[edge.low].cast<double>(), mesh.points[edge.high].cast<double>(), window);
    return length > 0 ? 0.5 * length * turn_at(mesh, &edges[first[n]], &edges[first[n + 1]]) : 0.0;
  });
}

// 2 pi less the angles of the triangles around each point inside.
double integral_of_gaussian_curvature(const SurfaceMesh& mesh, const Window& window) {
  std::vector<double> angles(mesh.points.size(), 0.0);
  std::vector<std::uint8_t> used(mesh.points.size(), 0);
  std::vector<std::array<float, 3>> corner_angles(mesh.triangles.size());
  tbb::parallel_for(std::size_t(0), mesh.triangles.size(), [&](std::size_t n) {
    const Triangle x = corners(mesh, n);
    for (int c = 0; c < 3; ++c) {
      const Vec3 u = x[(c + 1) % 3] - x[c], v = x[(c + 2) % 3] - x[c];
      corner_angles[n][c] = float(std::atan2(u.cross(v).norm(), u.dot(v)));
    }
  });
  for (std::size_t n = 0; n < mesh.triangles.size(); ++n)
    for (int c = 0; c < 3; ++c) {
      angles[mesh.triangles[n][c]] += corner_angles[n][c];
      used[mesh.triangles[n][c]] = 1;
    }
  return sum_in_order(mesh.points.size(), [&](std::size_t n) {
    return used[n] && contains(window, mesh.points[n].cast<double>()) ? 2 * pi - angles[n] : 0.0;
  });
}

}  // namespace

double SurfaceMeasures::euler() const {
  return gaussian_curvature / (4 * pi);
}

SurfaceMeasures measure_surface(const SurfaceMesh& mesh) {
  const Vec3 everywhere = Vec3::Constant(std::numeric_limits<double>::max());
  return measure_surface(mesh, {-everywhere, everywhere});
}

SurfaceMeasures measure_surface(const SurfaceMesh& mesh, const Window& window) {
  if (!(window.lower.array() < window.upper.array()).all())
    throw InputError(
        fmt::format("surface in a window from ({:g}, {:g}, {:g}) m to ({:g}, {:g}, {:g}) m; expected "
                    "edges > 0",
                    window.lower[0], window.lower[1], window.lower[2], window.upper[0], window.upper[1],
                    window.upper[2]));
  return {.area = sum_in_order(mesh.triangles.size(),
                               [&](std::size_t n) { return area_inside(corners(mesh, n), window); }),
          .mean_curvature = integral_of_mean_curvature(mesh, window),
          .gaussian_curvature = integral_of_gaussian_curvature(mesh, window)};
}

Window inner_window(const Vec3& size, double margin) {
  Window window{Vec3::Constant(margin), size - Vec3::Constant(margin)};
  if (!(margin >= 0) || !(window.lower.array() < window.upper.array()).all())
    throw InputError(
        fmt::format("window {:g} m inside of a box of {:g} m x {:g} m x {:g} m; expected a margin >= 0 "
                    "that leaves something",
                    margin, size[0], size[1], size[2]));
  return window;
}

double enclosed_volume(const SurfaceMesh& mesh) {
  return sum_in_order(mesh.triangles.size(),
                      [&](std::size_t n) {
                        const auto [a, b, c] = corners(mesh, n);
                        return a.dot(b.cross(c));
                      }) /
         6;
}

std::int64_t euler_number(const SurfaceMesh& mesh) {
  std::vector<std::uint8_t> used(mesh.points.size(), 0);
  for (const auto& triangle : mesh.triangles)
    for (std::uint32_t point : triangle) used[point] = 1;
  const auto points = std::ranges::count(used, 1);
  const auto edges = std::int64_t(first_of_each(sorted_half_edges(mesh)).size()) - 1;
  return points - edges + std::int64_t(mesh.triangles.size());
}

}  // namespace anticrack
