#include "embree_image.h"

#include <tbb/blocked_range2d.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <string>

#include "embree_scene.h"
#include "errors.h"

namespace anticrack {

namespace {

constexpr int lanes = embree_lanes;

void raise_embree_error(void*, RTCError, const char* message) {
  throw InputError(std::string("Embree: ") + message);
}

/// Sub-pixel positions: the R2 sequence (Roberts 2018), the same in every pixel; the first is the centre.
std::array<double, 2> pixel_sample(int i) {
  const double u = 0.5 + 0.7548776662466927 * i;
  const double v = 0.5 + 0.5698402909980532 * i;
  return {u - std::floor(u), v - std::floor(v)};
}

template <class Work>
void for_each_pixel(const Camera& camera, Work&& work) {
  tbb::parallel_for(tbb::blocked_range2d<int>(0, camera.height(), 16, 0, camera.width(), 16),
                    [&](const auto& tile) {
                      for (int row = tile.rows().begin(); row < tile.rows().end(); ++row) {
                        for (int column = tile.cols().begin(); column < tile.cols().end(); ++column)
                          work(column, row);
                      }
                    });
}

}  // namespace

EmbreeScene::Data::Data() {
  device = rtcNewDevice(nullptr);  // never threads=N: that would limit TBB for the whole process
  if (device == nullptr) throw InputError("Embree could not start on this processor");
  rtcSetDeviceErrorFunction(device, raise_embree_error, nullptr);
  scene = rtcNewScene(device);
  rtcSetSceneFlags(scene, RTC_SCENE_FLAG_ROBUST);
}

EmbreeScene::Data::~Data() {
  rtcReleaseScene(scene);
  rtcReleaseDevice(device);
}

void EmbreeScene::Data::commit(RTCGeometry geometry) {
  rtcCommitGeometry(geometry);
  rtcAttachGeometry(scene, geometry);
  rtcReleaseGeometry(geometry);
  rtcCommitScene(scene);
}

EmbreeScene::EmbreeScene(const Mesh& mesh, std::optional<CutSection> cut) : data_(std::make_unique<Data>()) {
  data_->mesh = &mesh;
  data_->cut = std::move(cut);
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

void EmbreeScene::bake_light(const Camera& camera) {
  if (data_->mesh != nullptr) return data_->bake_vertices();

  // A sphere that eight rays a pixel do not meet fills too little of a pixel to matter.
  std::vector<std::uint8_t> seen(data_->spheres.size(), 0);
  for_each_pixel(camera, [&](int column, int row) {
    Data::PrimaryPacket packet;
    data_->trace_primary(camera, column, row, 0, packet);
    for (int l = 0; l < lanes; ++l) {
      if (packet.hit[l]) std::atomic_ref(seen[packet.rays.hit.primID[l]]).store(1, std::memory_order_relaxed);
    }
  });
  data_->bake_spheres(seen);
}

void EmbreeScene::Data::trace_primary(const Camera& camera, int column, int row, int packet,
                                      PrimaryPacket& out) const {
  const Vec3 forward = camera.direction();
  const Point direction{float(forward.x()), float(forward.y()), float(forward.z())};
  const bool cutting = cut && mesh != nullptr;
  const float approach = cutting ? dot(cut->plane().normal, direction) : 0;
  auto& [ray, hit] = out.rays;
  alignas(32) int valid[lanes];
  for (int l = 0; l < lanes; ++l) {
    const auto [du, dv] = pixel_sample(packet * lanes + l);
    const Vec3 o = camera.origin(column + du, row + dv);
    const Point origin{float(o.x()), float(o.y()), float(o.z())};
    float from = 0;
    float to = std::numeric_limits<float>::infinity();
    bool traced = true;
    out.cap[l] = false;
    if (cutting) {
      const float outside = cut->plane().distance(origin);
      const float to_plane = -outside / approach;
      if (approach < 0 && outside > 0) {
        // The ray starts on the plane; where that is inside the solid, it has arrived.
        from = to_plane;
        Point entry;
        for (std::size_t c = 0; c < 3; ++c) entry[c] = origin[c] + from * direction[c];
        out.section[l] = cut->at(entry);
        out.cap[l] = out.section[l].solid;
        traced = !out.cap[l];
      } else if (approach > 0) {
        to = to_plane;
        traced = to_plane > 0;
      } else {
        traced = outside <= 0;
      }
    }
    valid[l] = traced ? -1 : 0;
    ray.org_x[l] = origin[0];
    ray.org_y[l] = origin[1];
    ray.org_z[l] = origin[2];
    ray.dir_x[l] = direction[0];
    ray.dir_y[l] = direction[1];
    ray.dir_z[l] = direction[2];
    ray.tnear[l] = from;
    ray.tfar[l] = out.cap[l] ? from : to;
    ray.time[l] = 0;
    ray.mask[l] = ~0u;
    ray.id[l] = 0;
    ray.flags[l] = 0;
    hit.geomID[l] = RTC_INVALID_GEOMETRY_ID;
    hit.instID[0][l] = RTC_INVALID_GEOMETRY_ID;
  }
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  rtcIntersect8(valid, scene, &context, &out.rays);
  for (int l = 0; l < lanes; ++l) out.hit[l] = out.cap[l] || hit.geomID[l] != RTC_INVALID_GEOMETRY_ID;
}

namespace {

struct Shading {
  float scalar;
  float light;
};

Point normalized(const Point& v) {
  const float length = std::sqrt(dot(v, v));
  return {v[0] / length, v[1] / length, v[2] / length};
}

Shading shade_mesh(const EmbreeScene::Data& data, const RTCHit8& hit, int l) {
  const Mesh& mesh = *data.mesh;
  const auto& t = mesh.triangle[hit.primID[l]];
  const float u = hit.u[l];
  const float v = hit.v[l];
  const float w = 1 - u - v;
  const auto mix = [&](const auto& value) { return w * value(t[0]) + u * value(t[1]) + v * value(t[2]); };
  const auto of = [&](const std::vector<float>& values) { return mix([&](auto i) { return values[i]; }); };
  Point normal;
  for (std::size_t c = 0; c < 3; ++c) normal[c] = mix([&](auto i) { return mesh.normal[i][c]; });
  const float cosine = std::max(0.0f, dot(normalized(normal), key_direction));
  return {of(mesh.scalar), light_factor(of(data.sky), of(data.key) * cosine)};
}

Shading shade_sphere(const EmbreeScene::Data& data, const RTCHit8& hit, int l) {
  const std::size_t s = hit.primID[l];
  const Point normal = normalized({hit.Ng_x[l], hit.Ng_y[l], hit.Ng_z[l]});
  const float cosine = std::max(0.0f, dot(normal, key_direction));
  return {data.sphere_scalar[s], light_factor(visible_sky(normal, data.visible[s]), data.key[s] * cosine)};
}

/// The cap has exactly the colours of the colour bar, and a thin dark edge that tells it from the surface
/// behind.
Shading shade_cap(const CutSection::Sample& section) {
  return {section.scalar, section.outline ? 0.3f : 1.0f};
}

}  // namespace

RenderLayers EmbreeScene::render(const Camera& camera, const ColorScale& scale, int samples) const {
  const Data& data = *data_;
  if (data.key.empty()) throw InputError("the light of the scene is not baked; call bake_light first");
  if (samples < 1) throw InputError("samples = " + std::to_string(samples) + " a pixel; expected > 0");
  const int packets = (samples + lanes - 1) / lanes;

  RenderLayers layers;
  layers.color = Image(camera.width(), camera.height());
  layers.depth.assign(layers.color.pixels.size(), std::numeric_limits<float>::infinity());
  layers.scalar.assign(layers.color.pixels.size(), std::numeric_limits<float>::quiet_NaN());
  for_each_pixel(camera, [&](int column, int row) {
    const std::size_t pixel = std::size_t(row) * std::size_t(camera.width()) + std::size_t(column);
    std::array<float, 3> sum{};
    for (int p = 0; p < packets; ++p) {
      Data::PrimaryPacket packet;
      data.trace_primary(camera, column, row, p, packet);
      for (int l = 0; l < lanes; ++l) {
        if (!packet.hit[l]) {
          for (float& s : sum) s += 1;  // white ground
          continue;
        }
        const Shading shading = packet.cap[l]          ? shade_cap(packet.section[l])
                                : data.mesh != nullptr ? shade_mesh(data, packet.rays.hit, l)
                                                       : shade_sphere(data, packet.rays.hit, l);
        const auto color = scale.map->linear_rgb(scale.position(shading.scalar));
        for (std::size_t c = 0; c < 3; ++c) sum[c] += shading.light * color[c];
        if (p == 0 && l == 0) {
          layers.depth[pixel] = packet.rays.ray.tfar[l];
          layers.scalar[pixel] = shading.scalar;
        }
      }
    }
    for (std::size_t c = 0; c < 3; ++c)
      layers.color.pixels[pixel][c] = encode_srgb(sum[c] / float(packets * lanes));
  });
  return layers;
}

}  // namespace anticrack
