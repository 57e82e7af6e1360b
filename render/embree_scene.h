#pragma once

#include <embree3/rtcore.h>

#include <limits>

#include "embree_image.h"
#include "lighting.h"

namespace anticrack {

constexpr int embree_lanes = 8;

/// What EmbreeScene holds; private to its two sources.
struct EmbreeScene::Data {
  RTCDevice device = nullptr;
  RTCScene scene = nullptr;
  const Mesh* mesh = nullptr;  ///< null in sphere mode
  std::optional<CutSection> cut;

  std::vector<std::array<float, 4>> spheres;  ///< x y z r, as Embree reads it; those that the cut leaves
  std::vector<float> sphere_scalar;

  std::vector<float> sky;              ///< baked, one a vertex: visible part of the sky's light
  std::vector<float> key;              ///< one a vertex or sphere: visible part of the key light
  std::vector<std::uint64_t> visible;  ///< one a sphere, bit i: sky direction i is not blocked

  Data();
  ~Data();
  Data(const Data&) = delete;
  Data& operator=(const Data&) = delete;
  void commit(RTCGeometry geometry);

  struct PrimaryPacket {
    alignas(32) RTCRayHit8 rays;
    bool hit[embree_lanes];  ///< something was hit: `rays` holds it, or the cap does
    bool cap[embree_lanes];  ///< the cut plane inside the solid
    CutSection::Sample section[embree_lanes];
  };
  /// Eight of a pixel's primary rays.
  void trace_primary(const Camera& camera, int column, int row, int packet, PrimaryPacket& out) const;

  void bake_vertices();
  void bake_spheres(const std::vector<std::uint8_t>& wanted);
};

/// The part of the sky's light over a hemisphere that comes from visible directions, in [0, 1].
/// @param visible  bit i: sky_directions()[i] is not blocked
float visible_sky(const Point& normal, std::uint64_t visible);

}  // namespace anticrack
