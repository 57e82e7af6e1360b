#include "embree_image.h"

#include <embree3/rtcore.h>
#include <tbb/blocked_range2d.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "errors.h"
#include "lighting.h"

namespace anticrack {

namespace {

constexpr int lanes = 8;

/// The sky's light over a hemisphere, from those directions of a fixed set that are visible.
class Sky {
 public:
  Sky() {
    for (const Point& d : sky_directions()) weight_.push_back(sky_radiance(d));
  }
  /// @param visible  bit i: direction i is not blocked
  float operator()(const Point& normal, std::uint64_t visible) const {
    const auto directions = sky_directions();
    float seen = 0;
    float all = 0;
    for (std::size_t i = 0; i < directions.size(); ++i) {
      const float w = weight_[i] * std::max(0.0f, dot(normal, directions[i]));
      all += w;
      seen += (visible >> i & 1) != 0 ? w : 0;
    }
    return seen / all;
  }

 private:
  std::vector<float> weight_;
};

const Sky& sky() {
  static const Sky instance;
  return instance;
}

void raise_embree_error(void*, RTCError, const char* message) {
  throw InputError(std::string("Embree: ") + message);
}

}  // namespace

struct EmbreeScene::Data {
  RTCDevice device = nullptr;
  RTCScene scene = nullptr;
  const Mesh* mesh = nullptr;
  const SolidField* field = nullptr;
  std::optional<CutPlane> cut;

  // Sphere mode: what the cut leaves, x y z r each as Embree reads it.
  std::vector<std::array<float, 4>> spheres;
  std::vector<float> sphere_scalar;

  std::vector<float> sky;              // baked, one a vertex
  std::vector<float> key;              // visible part of the key light
  std::vector<std::uint64_t> visible;  // baked, one a sphere: which sky directions

  Data() {
    device = rtcNewDevice(nullptr);  // never threads=N: that would limit TBB for the whole process
    if (device == nullptr) throw InputError("Embree could not start on this processor");
    rtcSetDeviceErrorFunction(device, raise_embree_error, nullptr);
    scene = rtcNewScene(device);
    rtcSetSceneFlags(scene, RTC_SCENE_FLAG_ROBUST);
  }
  ~Data() {
    rtcReleaseScene(scene);
    rtcReleaseDevice(device);
  }
  Data(const Data&) = delete;
  Data& operator=(const Data&) = delete;

  void commit(RTCGeometry geometry) {
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene, geometry);
    rtcReleaseGeometry(geometry);
    rtcCommitScene(scene);
  }

  /// How far a ray may go before it leaves the solid's side of the cut; the removed half casts no shadow.
  float reach(const Point& origin, const Point& direction) const {
    if (!cut) return std::numeric_limits<float>::infinity();
    const float approach = dot(cut->normal, direction);
    if (approach <= 0) return std::numeric_limits<float>::infinity();
    return std::max(0.0f, -cut->distance(origin) / approach);
  }

  void bake_vertices();
  void bake_spheres();
};

namespace {

/// Traces up to eight rays of one direction; bit i of the result: ray i is not blocked.
/// @param origin   eight points
/// @param from     distance along the ray at which it starts
template <class Reach>
unsigned unblocked(RTCScene scene, const Point (&origin)[lanes], const Point& direction, float from,
                   unsigned active, Reach&& reach) {
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
    ray.tfar[l] = reach(origin[l], direction);
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
  for (int l = 0; l < lanes; ++l) {
    open |= unsigned(valid[l] != 0 && !(ray.tfar[l] == -std::numeric_limits<float>::infinity())) << l;
  }
  return open;
}

}  // namespace

EmbreeScene::EmbreeScene(const Mesh& mesh, const SolidField& field, std::optional<CutPlane> cut)
    : data_(std::make_unique<Data>()) {
  data_->mesh = &mesh;
  data_->field = &field;
  data_->cut = cut;
  RTCGeometry geometry = rtcNewGeometry(data_->device, RTC_GEOMETRY_TYPE_TRIANGLE);
  // Embree reads 16 bytes at the last vertex: a buffer of its own is padded, ours is not.
  auto* vertices = static_cast<Point*>(rtcSetNewGeometryBuffer(
      geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, sizeof(Point), mesh.position.size()));
  std::copy(mesh.position.begin(), mesh.position.end(), vertices);
  rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, mesh.triangle.data(), 0,
                             sizeof(mesh.triangle[0]), mesh.triangle.size());
  data_->commit(geometry);
}

EmbreeScene::EmbreeScene(const SphereCloud& cloud, std::optional<CutPlane> cut)
    : data_(std::make_unique<Data>()) {
  for (std::size_t i = 0; i < cloud.position.size(); ++i) {
    const Point& x = cloud.position[i];
    if (cut && cut->distance(x) > 0) continue;
    data_->spheres.push_back({x[0], x[1], x[2], cloud.radius});
    data_->sphere_scalar.push_back(cloud.scalar[i]);
  }
  if (data_->spheres.empty()) throw InputError("the cut plane removes every particle");
  RTCGeometry geometry = rtcNewGeometry(data_->device, RTC_GEOMETRY_TYPE_SPHERE_POINT);
  rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT4, data_->spheres.data(), 0,
                             sizeof(data_->spheres[0]), data_->spheres.size());
  data_->commit(geometry);
}

EmbreeScene::~EmbreeScene() = default;
EmbreeScene::EmbreeScene(EmbreeScene&&) noexcept = default;

void EmbreeScene::bake_light() {
  if (data_->mesh != nullptr) {
    data_->bake_vertices();
  } else {
    data_->bake_spheres();
  }
}

void EmbreeScene::Data::bake_vertices() {
  const std::size_t count = mesh->position.size();
  sky.assign(count, 0);
  key.assign(count, 0);
  const float lift =
      0.2f * float(field->spacing());  // off the surface, so that a vertex does not block itself
  const auto limit = [this](const Point& origin, const Point& direction) { return reach(origin, direction); };
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
    const auto facing = [&](const Point& direction) {
      unsigned mask = 0;
      for (int l = 0; l < used; ++l) mask |= unsigned(dot(normal[l], direction) > 0) << l;
      return mask;
    };

    std::uint64_t visible[lanes]{};
    const auto directions = sky_directions();
    for (std::size_t i = 0; i < directions.size(); ++i) {
      const unsigned active = facing(directions[i]);
      if (active == 0) continue;
      const unsigned open = unblocked(scene, origin, directions[i], 0, active, limit);
      for (int l = 0; l < used; ++l) visible[l] |= std::uint64_t(open >> l & 1) << i;
    }
    int lit[lanes]{};
    for (const Point& direction : key_directions()) {
      const unsigned active = facing(direction);
      if (active == 0) continue;
      const unsigned open = unblocked(scene, origin, direction, 0, active, limit);
      for (int l = 0; l < used; ++l) lit[l] += int(open >> l & 1);
    }
    for (int l = 0; l < used; ++l) {
      sky[first + std::size_t(l)] = anticrack::sky()(normal[l], visible[l]);
      key[first + std::size_t(l)] = float(lit[l]) / float(key_directions().size());
    }
  });
}

void EmbreeScene::Data::bake_spheres() {
  const std::size_t count = spheres.size();
  visible.assign(count, 0);
  key.assign(count, 0);
  tbb::parallel_for(std::size_t(0), (count + lanes - 1) / lanes, [&](std::size_t packet) {
    const std::size_t first = packet * lanes;
    const int used = int(std::min<std::size_t>(lanes, count - first));
    Point origin[lanes]{};
    for (int l = 0; l < used; ++l) {
      const auto& s = spheres[first + std::size_t(l)];
      origin[l] = {s[0], s[1], s[2]};
    }
    const float from = 1.01f * spheres[first][3];
    const auto limit = [](const Point&, const Point&) { return std::numeric_limits<float>::infinity(); };
    const unsigned active = (1u << used) - 1;
    const auto directions = sky_directions();
    for (std::size_t i = 0; i < directions.size(); ++i) {
      const unsigned open = unblocked(scene, origin, directions[i], from, active, limit);
      for (int l = 0; l < used; ++l) visible[first + std::size_t(l)] |= std::uint64_t(open >> l & 1) << i;
    }
    for (const Point& direction : key_directions()) {
      const unsigned open = unblocked(scene, origin, direction, from, active, limit);
      for (int l = 0; l < used; ++l) {
        key[first + std::size_t(l)] += float(open >> l & 1) / float(key_directions().size());
      }
    }
  });
}

namespace {

struct Shaded {
  std::array<float, 3> color{1, 1, 1};  // linear light; white where nothing was hit
  float depth = std::numeric_limits<float>::infinity();
  float scalar = std::numeric_limits<float>::quiet_NaN();
};

Point normalized(const Point& v) {
  const float length = std::sqrt(dot(v, v));
  return {v[0] / length, v[1] / length, v[2] / length};
}

std::array<float, 3> scaled(const std::array<float, 3>& color, float factor) {
  return {factor * color[0], factor * color[1], factor * color[2]};
}

/// Sub-pixel positions: the R2 sequence (Roberts 2018), the same in every pixel.
std::array<double, 2> pixel_sample(int i) {
  const double u = 0.5 + 0.7548776662466927 * i;
  const double v = 0.5 + 0.5698402909980532 * i;
  return {u - std::floor(u), v - std::floor(v)};
}

}  // namespace

RenderLayers EmbreeScene::render(const Camera& camera, const ColorScale& scale, int samples) const {
  const Data& d = *data_;
  if (d.key.empty()) throw InputError("the light of the scene is not baked; call bake_light first");
  if (samples < 1) throw InputError("samples = " + std::to_string(samples) + " a pixel; expected > 0");
  const int packets = (samples + lanes - 1) / lanes;
  const Vec3 forward = camera.direction();
  const Point direction{float(forward.x()), float(forward.y()), float(forward.z())};
  const float approach = d.cut ? dot(d.cut->normal, direction) : 0;

  const auto shade_mesh_hit = [&](const RTCRayHit8& hit, int l) {
    const auto& t = d.mesh->triangle[hit.hit.primID[l]];
    const float u = hit.hit.u[l];
    const float v = hit.hit.v[l];
    const float w = 1 - u - v;
    const auto mix = [&](const std::vector<float>& values) {
      return w * values[t[0]] + u * values[t[1]] + v * values[t[2]];
    };
    Point normal;
    for (std::size_t c = 0; c < 3; ++c) {
      normal[c] = w * d.mesh->normal[t[0]][c] + u * d.mesh->normal[t[1]][c] + v * d.mesh->normal[t[2]][c];
    }
    const float cosine = std::max(0.0f, dot(normalized(normal), key_direction));
    const float light = light_factor(mix(d.sky), mix(d.key) * cosine);
    const float value = mix(d.mesh->scalar);
    return Shaded{scaled(scale.map->linear_rgb(scale.position(value)), light), hit.ray.tfar[l], value};
  };
  const auto shade_sphere_hit = [&](const RTCRayHit8& hit, int l) {
    const std::size_t s = hit.hit.primID[l];
    const Point normal = normalized({hit.hit.Ng_x[l], hit.hit.Ng_y[l], hit.hit.Ng_z[l]});
    const float cosine = std::max(0.0f, dot(normal, key_direction));
    const float light = light_factor(sky()(normal, d.visible[s]), d.key[s] * cosine);
    const float value = d.sphere_scalar[s];
    return Shaded{scaled(scale.map->linear_rgb(scale.position(value)), light), hit.ray.tfar[l], value};
  };
  // The cap shows the colour bar's colours unshaded.
  const auto shade_cap = [&](float value, float depth) {
    return Shaded{scale.map->linear_rgb(scale.position(value)), depth, value};
  };

  const auto trace_packet = [&](int column, int row, int packet, Shaded(&out)[lanes]) {
    alignas(32) RTCRayHit8 hit;
    alignas(32) int valid[lanes];
    for (int l = 0; l < lanes; ++l) {
      const auto [du, dv] = pixel_sample(packet * lanes + l);
      const Vec3 o = camera.origin(column + du, row + dv);
      const Point origin{float(o.x()), float(o.y()), float(o.z())};
      float from = 0;
      float to = std::numeric_limits<float>::infinity();
      bool traced = true;
      out[l] = Shaded{};
      if (d.cut && d.mesh != nullptr) {
        const float to_plane = -d.cut->distance(origin) / approach;
        if (approach < 0) {
          from = std::max(0.0f, to_plane);
          Point entry;
          for (std::size_t c = 0; c < 3; ++c) entry[c] = origin[c] + from * direction[c];
          const SolidField::Sample inside = d.field->at(entry);
          if (from > 0 && inside.fraction >= SolidField::surface_fraction) {
            out[l] = shade_cap(inside.scalar, from);
            traced = false;
          }
        } else if (approach > 0) {
          to = to_plane;
          traced = to_plane > 0;
        } else {
          traced = d.cut->distance(origin) <= 0;
        }
      }
      valid[l] = traced ? -1 : 0;
      hit.ray.org_x[l] = origin[0];
      hit.ray.org_y[l] = origin[1];
      hit.ray.org_z[l] = origin[2];
      hit.ray.dir_x[l] = direction[0];
      hit.ray.dir_y[l] = direction[1];
      hit.ray.dir_z[l] = direction[2];
      hit.ray.tnear[l] = from;
      hit.ray.tfar[l] = to;
      hit.ray.time[l] = 0;
      hit.ray.mask[l] = ~0u;
      hit.ray.id[l] = 0;
      hit.ray.flags[l] = 0;
      hit.hit.geomID[l] = RTC_INVALID_GEOMETRY_ID;
      hit.hit.instID[0][l] = RTC_INVALID_GEOMETRY_ID;
    }
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
    rtcIntersect8(valid, d.scene, &context, &hit);
    for (int l = 0; l < lanes; ++l) {
      if (valid[l] == 0 || hit.hit.geomID[l] == RTC_INVALID_GEOMETRY_ID) continue;
      out[l] = d.mesh != nullptr ? shade_mesh_hit(hit, l) : shade_sphere_hit(hit, l);
    }
  };

  RenderLayers layers;
  layers.color = Image(camera.width(), camera.height());
  layers.depth.resize(layers.color.pixels.size());
  layers.scalar.resize(layers.color.pixels.size());
  tbb::parallel_for(
      tbb::blocked_range2d<int>(0, camera.height(), 16, 0, camera.width(), 16), [&](const auto& tile) {
        for (int row = tile.rows().begin(); row < tile.rows().end(); ++row) {
          for (int column = tile.cols().begin(); column < tile.cols().end(); ++column) {
            std::array<float, 3> sum{};
            Shaded centre;
            for (int packet = 0; packet < packets; ++packet) {
              Shaded out[lanes];
              trace_packet(column, row, packet, out);
              if (packet == 0) centre = out[0];  // the first sample is the pixel's centre
              for (const Shaded& s : out) {
                for (std::size_t c = 0; c < 3; ++c) sum[c] += s.color[c];
              }
            }
            const float n = float(packets * lanes);
            layers.color.at(column, row) = {encode_srgb(sum[0] / n), encode_srgb(sum[1] / n),
                                            encode_srgb(sum[2] / n)};
            const std::size_t pixel = std::size_t(row) * std::size_t(camera.width()) + std::size_t(column);
            layers.depth[pixel] = centre.depth;
            layers.scalar[pixel] = centre.scalar;
          }
        }
      });
  return layers;
}

}  // namespace anticrack
