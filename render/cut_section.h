#pragma once

#include "mesh.h"
#include "solid_field.h"

namespace anticrack {

/// The picture inside the plane of a cut: solid fraction and scalar on a square raster of half the particle
/// spacing.
class CutSection {
 public:
  /// Covers the whole field. @throws InputError  if the normal has no length or the plane misses the solid
  CutSection(const CutPlane& plane, const SolidField& field);

  struct Sample {
    bool solid = false;
    bool outline = false;  ///< within a seventh of a particle spacing of the solid's edge
    float scalar = 0;
  };
  Sample at(const Point& x) const;  ///< x is projected onto the plane

  const CutPlane& plane() const { return plane_; }
  Point corner(int right, int up) const;  ///< of the raster, right and up 0 or 1 [m]
  int width() const { return width_; }
  int height() const { return height_; }
  float surface_fraction() const { return surface_fraction_; }  ///< solid where the fraction is at least this
  /// Solid fraction and solid fraction x scalar of each raster point, rows along the section's first
  /// direction.
  const std::vector<std::array<float, 2>>& raster() const { return raster_; }

 private:
  CutPlane plane_;
  Point origin_{}, right_{}, up_{};
  float step_ = 0;
  float outline_ = 0;
  float surface_fraction_ = 0;
  int width_ = 0;
  int height_ = 0;
  std::vector<std::array<float, 2>> raster_;
};

}  // namespace anticrack
