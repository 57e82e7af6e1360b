#include "quick_light.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "lighting.h"

namespace anticrack {

namespace {

constexpr int sky_count = 14;
constexpr float opacity = 3.5f;  // of a solid cell: e^-3.5 passes

const std::array<Point, sky_count + 1>& sweep_directions() {
  static const auto all = [] {
    std::array<Point, sky_count + 1> d{};
    for (std::size_t i = 0; i < 6; ++i) d[i][i / 2] = i % 2 == 0 ? 1 : -1;
    const float s = 1 / std::sqrt(3.0f);
    for (std::size_t i = 0; i < 8; ++i) d[6 + i] = {i & 1 ? s : -s, i & 2 ? s : -s, i & 4 ? s : -s};
    d[sky_count] = key_direction;
    return d;
  }();
  return all;
}

}  // namespace

QuickLight::QuickLight(const SolidField& field, const std::optional<CutPlane>& cut) {
  std::array<int, 3> low{}, high{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    low[axis] = field.blocks().front().origin[axis];
    high[axis] = low[axis];
    for (const auto& block : field.blocks()) {
      low[axis] = std::min(low[axis], block.origin[axis]);
      high[axis] = std::max(high[axis], block.origin[axis] + SolidField::edge);
    }
  }
  int longest = 0;
  for (std::size_t axis = 0; axis < 3; ++axis) longest = std::max(longest, high[axis] - low[axis]);
  const int nodes = std::max(2, (longest + 191) / 192);  // along a coarse cell
  cell_ = nodes * field.spacing();
  for (std::size_t axis = 0; axis < 3; ++axis) {
    origin_[axis] = (low[axis] + 0.5 * (nodes - 1)) * field.spacing();
    count_[axis] = std::max(2, (high[axis] - low[axis] + nodes - 1) / nodes);  // `at` interpolates
  }

  std::vector<float> solid(std::size_t(count_[0]) * std::size_t(count_[1]) * std::size_t(count_[2]), 0);
  const float h = float(field.spacing());
  const float share = 1 / float(nodes * nodes * nodes);
  for (const auto& block : field.blocks()) {
    for (int n = 0; n < SolidField::nodes; ++n) {
      const float f = std::min(block.fraction[std::size_t(n)], 1.0f);
      if (f == 0) continue;
      const int node[3] = {block.origin[0] + (n & 7), block.origin[1] + (n >> 3 & 7),
                           block.origin[2] + (n >> 6)};
      if (cut && cut->distance({h * float(node[0]), h * float(node[1]), h * float(node[2])}) > 0) continue;
      solid[index((node[0] - low[0]) / nodes, (node[1] - low[1]) / nodes, (node[2] - low[2]) / nodes)] +=
          share * f;
    }
  }
  light_.resize(solid.size());
  tbb::parallel_for(0, directions, [&](int d) { sweep(d, solid); });
}

void QuickLight::sweep(int direction, const std::vector<float>& solid) {
  // Layers across the axis along which the light runs most; the layer nearest to the light is lit in full.
  const Point& towards = sweep_directions()[std::size_t(direction)];
  int axis = 0;
  for (int a = 1; a < 3; ++a) {
    if (std::abs(towards[std::size_t(a)]) > std::abs(towards[std::size_t(axis)])) axis = a;
  }
  const int u = (axis + 1) % 3;
  const int v = (axis + 2) % 3;
  const float along = towards[std::size_t(axis)];
  const float shift_u = towards[std::size_t(u)] / std::abs(along);
  const float shift_v = towards[std::size_t(v)] / std::abs(along);
  const float length = 1 / std::abs(along);
  const int nu = count_[std::size_t(u)];
  const int nv = count_[std::size_t(v)];
  const int layers = count_[std::size_t(axis)];
  std::vector<float> passed(std::size_t(nu) * std::size_t(nv), 1);  // behind the layer before
  std::vector<float> next(passed.size());
  for (int step = 0; step < layers; ++step) {
    const int layer = along > 0 ? layers - 1 - step : step;
    for (int j = 0; j < nv; ++j) {
      for (int i = 0; i < nu; ++i) {
        const float s = float(i) + shift_u;
        const float t = float(j) + shift_v;
        const int i0 = int(std::floor(s));
        const int j0 = int(std::floor(t));
        const float fs = s - float(i0);
        const float ft = t - float(j0);
        const auto before = [&](int a, int b) {
          return a < 0 || b < 0 || a >= nu || b >= nv ? 1.0f : passed[std::size_t(a + nu * b)];
        };
        const float arrives = (1 - ft) * ((1 - fs) * before(i0, j0) + fs * before(i0 + 1, j0)) +
                              ft * ((1 - fs) * before(i0, j0 + 1) + fs * before(i0 + 1, j0 + 1));
        int at[3];
        at[axis] = layer;
        at[u] = i;
        at[v] = j;
        const std::size_t cell = index(at[0], at[1], at[2]);
        light_[cell][std::size_t(direction)] = arrives;
        next[std::size_t(i + nu * j)] = arrives * std::exp(-opacity * length * solid[cell]);
      }
    }
    passed.swap(next);
  }
}

QuickLight::Transmitted QuickLight::at(const Point& x) const {
  std::array<int, 3> first{};
  float f[3];
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double s = std::clamp((double(x[axis]) - origin_[axis]) / cell_, 0.0, count_[axis] - 1.001);
    first[axis] = int(s);
    f[axis] = float(s - first[axis]);
  }
  Transmitted sum{};
  for (int c = 0; c < 8; ++c) {
    const float w = (c & 1 ? f[0] : 1 - f[0]) * (c & 2 ? f[1] : 1 - f[1]) * (c & 4 ? f[2] : 1 - f[2]);
    const Transmitted& corner =
        light_[index(first[0] + (c & 1), first[1] + (c >> 1 & 1), first[2] + (c >> 2))];
    for (std::size_t d = 0; d < directions; ++d) sum[d] += w * corner[d];
  }
  return sum;
}

PointLight QuickLight::at_vertices(const Mesh& mesh) const {
  PointLight light;
  light.sky.resize(mesh.position.size());
  light.key.resize(mesh.position.size());
  tbb::parallel_for(std::size_t(0), mesh.position.size(), [&](std::size_t i) {
    const Point& normal = mesh.normal[i];
    Point x = mesh.position[i];
    for (std::size_t c = 0; c < 3; ++c) x[c] += float(cell_) * normal[c];
    const Transmitted arrives = at(x);
    float seen = 0;
    float all = 0;
    for (std::size_t d = 0; d < sky_count; ++d) {
      const Point& direction = sweep_directions()[d];
      const float w = sky_radiance(direction) * std::max(0.0f, dot(normal, direction));
      seen += w * arrives[d];
      all += w;
    }
    light.sky[i] = seen / all;
    light.key[i] = arrives[sky_count];
  });
  return light;
}

PointLight QuickLight::at_particles(std::span<const Point> positions) const {
  PointLight light;
  light.sky.resize(positions.size());
  light.key.resize(positions.size());
  tbb::parallel_for(std::size_t(0), positions.size(), [&](std::size_t i) {
    Transmitted arrives = at(positions[i]);
    light.key[i] = arrives[sky_count];
    std::partial_sort(arrives.begin(), arrives.begin() + sky_count / 2, arrives.begin() + sky_count,
                      std::greater<>());
    for (int d = 0; d < sky_count / 2; ++d) light.sky[i] += arrives[std::size_t(d)] / (sky_count / 2);
  });
  return light;
}

}  // namespace anticrack
