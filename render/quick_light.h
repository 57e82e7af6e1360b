#pragma once

#include <array>
#include <optional>
#include <span>
#include <vector>

#include "mesh.h"
#include "solid_field.h"

namespace anticrack {

/// Light that reaches points of a scene: what a preview has instead of traced rays. Both in [0, 1].
struct PointLight {
  std::vector<float> sky;  ///< visible part of the sky's light
  std::vector<float> key;  ///< visible part of the key light
};

/// Estimates sky and key light by sweeping parallel light through a coarse lattice of the solid, once for
/// each of a few directions: each layer passes on what the layer before let through. Some tenths of a second
/// where rays take ten.
class QuickLight {
 public:
  /// The coarse cell is two particle spacings, or 1/192 of the longest side if that is more.
  /// @param cut  what lies beyond it casts no shadow
  explicit QuickLight(const SolidField& field, const std::optional<CutPlane>& cut = {});

  PointLight at_vertices(const Mesh& mesh) const;
  /// For particles, which have no normal: the half of the directions that is brightest.
  PointLight at_particles(std::span<const Point> positions) const;

 private:
  static constexpr int directions = 15;  ///< 6 faces and 8 corners of a cube, and the key light
  using Transmitted = std::array<float, directions>;

  void sweep(int direction, const std::vector<float>& solid);
  std::size_t index(int i, int j, int k) const { return std::size_t(i + count_[0] * (j + count_[1] * k)); }
  Transmitted at(const Point& x) const;

  double cell_ = 0;
  std::array<double, 3> origin_{};  ///< [m] centre of the first cell
  std::array<int, 3> count_{};
  std::vector<Transmitted> light_;
};

}  // namespace anticrack
