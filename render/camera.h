#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "vec3.h"

namespace anticrack {

/// Axis-aligned box [m].
struct Box {
  Vec3 lower = Vec3::Zero();
  Vec3 upper = Vec3::Zero();

  Box united(const Box& other) const { return {lower.cwiseMin(other.lower), upper.cwiseMax(other.upper)}; }
};

/// Where the camera stands, seen from the sample. y is up.
struct View {
  double azimuth = 32;    ///< [degrees] 0 looks along -z, positive moves the camera towards +x
  double elevation = 22;  ///< [degrees] in (-90, 90)
};

/// Orthographic camera: a length parallel to the picture measures the same everywhere, so one scale bar
/// holds.
class Camera {
 public:
  /// Sees the whole box with a margin, a fraction of the picture's smaller side.
  static Camera fit(const Box& box, const View& view, int width, int height, double margin = 0.02) {
    Camera camera(view, width, height);
    const Vec3 extent = camera.extent(box);
    const double usable = 1 - 2 * margin;
    camera.pixel_ = std::max(extent.x() / (usable * width), extent.y() / (usable * height));
    camera.centre_ = 0.5 * (box.lower + box.upper);
    // Surfaces and spheres stand out of the box by up to 0.6 spacings of its eight or more particles a side.
    camera.depth_ = 0.5 * extent.z() + 0.1 * extent.norm();
    return camera;
  }

  /// Width over height of the box's picture.
  static double aspect(const Box& box, const View& view) {
    const Vec3 extent = Camera(view, 1, 1).extent(box);
    return extent.x() / extent.y();
  }

  int width() const { return width_; }
  int height() const { return height_; }
  double pixel_size() const { return pixel_; }       ///< [m]
  double depth_range() const { return 2 * depth_; }  ///< [m] from the near to the far plane
  Vec3 right() const { return right_; }
  Vec3 up() const { return up_; }
  Vec3 direction() const { return forward_; }  ///< of every ray, unit length

  /// Point of the near plane under a picture point; (0, 0) is the upper left corner, one unit a pixel.
  Vec3 origin(double column, double row) const {
    return centre_ - depth_ * forward_ +
           pixel_ * ((column - 0.5 * width_) * right_ + (0.5 * height_ - row) * up_);
  }

  /// Column and row [pixels], and depth behind the near plane [m].
  Vec3 project(const Vec3& x) const {
    const Vec3 d = x - centre_;
    return {0.5 * width_ + d.dot(right_) / pixel_, 0.5 * height_ - d.dot(up_) / pixel_,
            d.dot(forward_) + depth_};
  }

 private:
  Camera(const View& view, int width, int height) : width_(width), height_(height) {
    const double a = view.azimuth * std::numbers::pi / 180;
    const double e = view.elevation * std::numbers::pi / 180;
    forward_ = -Vec3(std::sin(a) * std::cos(e), std::sin(e), std::cos(a) * std::cos(e));
    right_ = Vec3(std::cos(a), 0, -std::sin(a));
    up_ = right_.cross(forward_);
  }

  /// Lengths of the box along right, up and forward.
  Vec3 extent(const Box& box) const {
    const Vec3 edges = box.upper - box.lower;
    return {edges.dot(right_.cwiseAbs()), edges.dot(up_.cwiseAbs()), edges.dot(forward_.cwiseAbs())};
  }

  int width_, height_;
  Vec3 right_, up_, forward_;
  Vec3 centre_ = Vec3::Zero();
  double depth_ = 1;
  double pixel_ = 1;
};

}  // namespace anticrack
