#include "cut_section.h"

#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <string>

#include "errors.h"
#include "lighting.h"
#include "vec3.h"

namespace anticrack {

namespace {

Point to_point(const Vec3& v) {
  return {float(v.x()), float(v.y()), float(v.z())};
}

}  // namespace

CutSection::CutSection(const CutPlane& plane, const SolidField& field) {
  Vec3 normal(plane.normal[0], plane.normal[1], plane.normal[2]);
  const double length = normal.norm();
  if (!(length > 0) || !std::isfinite(length) || !std::isfinite(plane.offset)) {
    throw InputError("cut plane: expected a normal with a length and a finite offset");
  }
  normal /= length;
  plane_ = {to_point(normal), float(plane.offset / length)};

  // The raster covers the projection of every block onto the plane.
  const double h = field.spacing();
  const Vec3 right = normal.unitOrthogonal();
  const Vec3 up = normal.cross(right);
  double low[3] = {INFINITY, INFINITY, INFINITY};
  double high[3] = {-INFINITY, -INFINITY, -INFINITY};
  for (const SolidField::Block& block : field.blocks()) {
    for (int c = 0; c < 8; ++c) {
      Vec3 x;
      for (int axis = 0; axis < 3; ++axis) {
        x[axis] = h * (block.origin[std::size_t(axis)] + (c >> axis & 1) * SolidField::edge);
      }
      const double along[3] = {x.dot(right), x.dot(up), x.dot(normal)};
      for (int i = 0; i < 3; ++i) {
        low[i] = std::min(low[i], along[i]);
        high[i] = std::max(high[i], along[i]);
      }
    }
  }
  if (plane_.offset < low[2] || plane_.offset > high[2]) {
    throw InputError("cut plane: offset " + std::to_string(plane_.offset) +
                     " m misses the sample, which spans " + std::to_string(low[2]) + " to " +
                     std::to_string(high[2]) + " m along the normal");
  }
  step_ = float(h / 2);
  outline_ = float(h / 7);
  surface_fraction_ = field.surface_fraction();
  width_ = int(std::ceil((high[0] - low[0]) / step_)) + 1;
  height_ = int(std::ceil((high[1] - low[1]) / step_)) + 1;
  right_ = to_point(right);
  up_ = to_point(up);
  origin_ = to_point(low[0] * right + low[1] * up + double(plane_.offset) * normal);

  raster_.resize(std::size_t(width_) * std::size_t(height_));
  tbb::parallel_for(0, height_, [&](int row) {
    for (int column = 0; column < width_; ++column) {
      const Vec3 x = (low[0] + column * double(step_)) * right + (low[1] + row * double(step_)) * up +
                     double(plane_.offset) * normal;
      const SolidField::Sample s = field.at(to_point(x));
      raster_[std::size_t(row) * std::size_t(width_) + std::size_t(column)] = {s.fraction,
                                                                               s.fraction * s.scalar};
    }
  });
}

CutSection::Sample CutSection::at(const Point& x) const {
  const Point d{x[0] - origin_[0], x[1] - origin_[1], x[2] - origin_[2]};
  const float s = dot(d, right_) / step_;
  const float t = dot(d, up_) / step_;
  if (!(s >= 0 && t >= 0 && s < float(width_ - 1) && t < float(height_ - 1))) return {};
  const int column = int(s);
  const int row = int(t);
  const float fs = s - float(column);
  const float ft = t - float(row);
  const auto* v = &raster_[std::size_t(row) * std::size_t(width_) + std::size_t(column)];
  const auto mix = [&](std::size_t c) {
    return (1 - ft) * ((1 - fs) * v[0][c] + fs * v[1][c]) +
           ft * ((1 - fs) * v[width_][c] + fs * v[width_ + 1][c]);
  };
  const float fraction = mix(0);
  if (fraction < surface_fraction_) return {};
  const float slope_s = (1 - ft) * (v[1][0] - v[0][0]) + ft * (v[width_ + 1][0] - v[width_][0]);
  const float slope_t = (1 - fs) * (v[width_][0] - v[0][0]) + fs * (v[width_ + 1][0] - v[1][0]);
  const float slope = std::hypot(slope_s, slope_t) / step_;
  return {true, fraction - surface_fraction_ < outline_ * slope, mix(1) / fraction};
}

Point CutSection::corner(int right, int up) const {
  Point x = origin_;
  for (std::size_t c = 0; c < 3; ++c) {
    x[c] += step_ * (float(right * (width_ - 1)) * right_[c] + float(up * (height_ - 1)) * up_[c]);
  }
  return x;
}

}  // namespace anticrack
