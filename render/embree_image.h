#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "camera.h"
#include "color_map.h"
#include "cut_section.h"
#include "image.h"
#include "mesh.h"

namespace anticrack {

/// A picture and the numbers under it, one a pixel.
struct RenderLayers {
  Image color;
  std::vector<float> depth;   ///< [m] behind the camera's near plane; infinite where nothing was hit
  std::vector<float> scalar;  ///< the coloured quantity; NaN where nothing was hit
};

/// Ray-traced picture of a surface or of spheres (Embree). Building it makes the search tree; `bake_light`
/// traces sky and key light once a vertex (or visible sphere); after that every colour scale, and for a
/// surface every camera, costs its primary rays only. All results are the same bits for any number of
/// threads.
class EmbreeScene {
 public:
  /// @param mesh  must outlive the scene
  /// @param cut   removes what lies beyond its plane and caps the solid there
  explicit EmbreeScene(const Mesh& mesh, std::optional<CutSection> cut = {});
  /// Spheres whose centre lies beyond the cut are left out. @throws InputError  if none is left
  explicit EmbreeScene(const SphereCloud& spheres, std::optional<CutPlane> cut = {});
  ~EmbreeScene();
  EmbreeScene(EmbreeScene&&) noexcept;

  /// @param camera  spheres: only those that it sees are worth the rays
  void bake_light(const Camera& camera);

  /// @param samples  rays a pixel, > 0 (rounded up to a multiple of 8); 16 gives clean edges
  /// @throws InputError  if the light is not baked
  RenderLayers render(const Camera& camera, const ColorScale& scale, int samples = 16) const;

  struct Data;  ///< defined where Embree is seen

 private:
  std::unique_ptr<Data> data_;
};

}  // namespace anticrack
