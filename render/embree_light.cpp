#include <tbb/parallel_for.h>

#include <algorithm>

#include "embree_scene.h"

namespace anticrack {

namespace {

constexpr int lanes = embree_lanes;
constexpr float infinity = std::numeric_limits<float>::infinity();

/// Traces up to eight rays of one direction, each from `from` to `to[i]`; bit i of the result: ray i is not
/// blocked.
unsigned unblocked(RTCScene scene, const Point (&origin)[lanes], const Point& direction, float from,
                   const float (&to)[lanes], unsigned active) {
  alignas(32) RTCRay8 ray;
  alignas(32) int valid[lanes];
  for (int l = 0; l < lanes; ++l) {
    valid[l] = active >> l & 1 ? -1 : 0;
    ray.org_x[l] = origin[l][0];
    ray.org_y[l] = origin[l][1];
    ray.org_z[l] = origin[l][2];
    ray.dir_x[l] = direction[0];
    ray.dir_y[l] = direction[1];
    ray.dir_z[l] = direction[2];
    ray.tnear[l] = from;
    ray.tfar[l] = to[l];
    ray.time[l] = 0;
    ray.mask[l] = ~0u;
    ray.id[l] = 0;
    ray.flags[l] = 0;
  }
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  rtcOccluded8(valid, scene, &context, &ray);
  unsigned open = 0;
  for (int l = 0; l < lanes; ++l) open |= unsigned(valid[l] != 0 && ray.tfar[l] != -infinity) << l;
  return open;
}

}  // namespace

float visible_sky(const Point& normal, std::uint64_t visible) {
  const auto directions = sky_directions();
  float seen = 0;
  float all = 0;
  for (std::size_t i = 0; i < directions.size(); ++i) {
    const float light = sky_radiance(directions[i]) * std::max(0.0f, dot(normal, directions[i]));
    all += light;
    seen += (visible >> i & 1) != 0 ? light : 0;
  }
  return seen / all;
}

void EmbreeScene::Data::bake_vertices() {
  const std::size_t count = mesh->position.size();
  sky.assign(count, 0);
  key.assign(count, 0);
  const float lift = 0.2f * mesh->spacing;  // off the surface, so that a vertex does not block itself
  tbb::parallel_for(std::size_t(0), (count + lanes - 1) / lanes, [&](std::size_t packet) {
    const std::size_t first = packet * lanes;
    const int used = int(std::min<std::size_t>(lanes, count - first));
    Point origin[lanes]{};
    Point normal[lanes]{};
    for (int l = 0; l < used; ++l) {
      normal[l] = mesh->normal[first + std::size_t(l)];
      for (std::size_t c = 0; c < 3; ++c) {
        origin[l][c] = mesh->position[first + std::size_t(l)][c] + lift * normal[l][c];
      }
    }
    const auto trace = [&](const Point& direction) {
      unsigned facing = 0;
      for (int l = 0; l < used; ++l) facing |= unsigned(dot(normal[l], direction) > 0) << l;
      if (facing == 0) return 0u;
      // A ray ends where it leaves through the cut plane: the removed half casts no shadow.
      float to[lanes];
      std::fill(to, to + lanes, infinity);
      const float approach = cut ? dot(cut->plane().normal, direction) : 0;
      if (approach > 0) {
        for (int l = 0; l < used; ++l) to[l] = std::max(0.0f, -cut->plane().distance(origin[l]) / approach);
      }
      return unblocked(scene, origin, direction, 0, to, facing);
    };

    std::uint64_t open[lanes]{};
    int lit[lanes]{};
    for (std::size_t i = 0; i < sky_directions().size(); ++i) {
      const unsigned mask = trace(sky_directions()[i]);
      for (int l = 0; l < used; ++l) open[l] |= std::uint64_t(mask >> l & 1) << i;
    }
    for (const Point& direction : key_directions()) {
      const unsigned mask = trace(direction);
      for (int l = 0; l < used; ++l) lit[l] += int(mask >> l & 1);
    }
    for (int l = 0; l < used; ++l) {
      sky[first + std::size_t(l)] = visible_sky(normal[l], open[l]);
      key[first + std::size_t(l)] = float(lit[l]) / float(key_directions().size());
    }
  });
}

void EmbreeScene::Data::bake_spheres(const std::vector<std::uint8_t>& wanted) {
  visible.assign(spheres.size(), ~std::uint64_t(0));
  key.assign(spheres.size(), 0);
  std::vector<std::size_t> list;
  for (std::size_t s = 0; s < wanted.size(); ++s) {
    if (wanted[s] != 0) list.push_back(s);
  }
  tbb::parallel_for(std::size_t(0), (list.size() + lanes - 1) / lanes, [&](std::size_t packet) {
    const std::size_t first = packet * lanes;
    const int used = int(std::min<std::size_t>(lanes, list.size() - first));
    Point origin[lanes]{};
    for (int l = 0; l < used; ++l) {
      const auto& s = spheres[list[first + std::size_t(l)]];
      origin[l] = {s[0], s[1], s[2]};
    }
    const float from = 1.01f * spheres[0][3];  // rays start on the sphere itself
    float to[lanes];
    std::fill(to, to + lanes, infinity);
    const unsigned all = (1u << used) - 1;
    std::uint64_t open[lanes]{};
    int lit[lanes]{};
    for (std::size_t i = 0; i < sky_directions().size(); ++i) {
      const unsigned mask = unblocked(scene, origin, sky_directions()[i], from, to, all);
      for (int l = 0; l < used; ++l) open[l] |= std::uint64_t(mask >> l & 1) << i;
    }
    for (const Point& direction : key_directions()) {
      const unsigned mask = unblocked(scene, origin, direction, from, to, all);
      for (int l = 0; l < used; ++l) lit[l] += int(mask >> l & 1);
    }
    for (int l = 0; l < used; ++l) {
      visible[list[first + std::size_t(l)]] = open[l];
      key[list[first + std::size_t(l)]] = float(lit[l]) / float(key_directions().size());
    }
  });
}

}  // namespace anticrack
