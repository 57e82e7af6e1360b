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

struct Range {
  double low = INFINITY, high = -INFINITY;

  void add(double value) {
    low = std::min(low, value);
    high = std::max(high, value);
  }
};

/// Where the solid lies along the normal.
Range solid_range(const SolidField& field, const Vec3& normal) {
  Range range;
  for (const SolidField::Block& block : field.blocks())
    for (int n = 0; n < SolidField::nodes; ++n) {
      if (block.fraction[std::size_t(n)] < field.surface_fraction()) continue;
      constexpr int edge = SolidField::edge;
      const int index[3] = {n % edge, n / edge % edge, n / (edge * edge)};
      double along = 0;
      for (int a = 0; a < 3; ++a) along += normal[a] * (block.origin[std::size_t(a)] + index[a]);
      range.add(along * field.spacing());
    }
  return range;
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

  const double h = field.spacing();
  const Range solid = solid_range(field, normal);  // the surface is less than a node farther out
  if (plane_.offset < solid.low - h || plane_.offset > solid.high + h) {
    throw InputError("cut plane: offset " + std::to_string(plane_.offset) +
                     " m misses the sample, which spans " + std::to_string(solid.low) + " to " +
                     std::to_string(solid.high) + " m along the normal");
  }

  // The raster covers the projection of every block onto the plane.
  const Vec3 right = normal.unitOrthogonal();
  const Vec3 up = normal.cross(right);
  Range across[2];
  for (const SolidField::Block& block : field.blocks()) {
    for (int c = 0; c < 8; ++c) {
      Vec3 x;
      for (int axis = 0; axis < 3; ++axis) {
        x[axis] = h * (block.origin[std::size_t(axis)] + (c >> axis & 1) * SolidField::edge);
      }
      across[0].add(x.dot(right));
      across[1].add(x.dot(up));
    }
  }
  step_ = float(h / 2);
  outline_ = float(h / 7);
  surface_fraction_ = field.surface_fraction();
  width_ = int(std::ceil((across[0].high - across[0].low) / step_)) + 1;
  height_ = int(std::ceil((across[1].high - across[1].low) / step_)) + 1;
  right_ = to_point(right);
  up_ = to_point(up);
  origin_ = to_point(across[0].low * right + across[1].low * up + double(plane_.offset) * normal);

  raster_.resize(std::size_t(width_) * std::size_t(height_));
  tbb::parallel_for(0, height_, [&](int row) {
    for (int column = 0; column < width_; ++column) {
      const Vec3 x = (across[0].low + column * double(step_)) * right +
                     (across[1].low + row * double(step_)) * up + double(plane_.offset) * normal;
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
