#include "level_sets/closest_point.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>

namespace anticrack {
namespace {

// Axes along which the point is held on a face of the box: -1 lower, +1 upper, 0 free.
using Held = std::array<int, 3>;

// An orthonormal basis of the directions that are free and normal to `gradient` (itself free); missing ones
// are zero.
std::array<Vec3, 2> tangents(const Vec3& gradient, const Held& held) {
  const int held_axes = std::abs(held[0]) + std::abs(held[1]) + std::abs(held[2]);
  if (held_axes == 0) {
    const Vec3 first = gradient.unitOrthogonal();
    return {first, gradient.cross(first).normalized()};
  }
  if (held_axes == 1) {
    const Vec3 face(std::abs(held[0]), std::abs(held[1]), std::abs(held[2]));
    return {gradient.cross(face).normalized(), Vec3::Zero()};
  }
  return {Vec3::Zero(), Vec3::Zero()};
}

// Newton's step to the minimum of |y - x|^2 / 2 on {field = 0} from y, within the free axes; x_y = x - y.
// With the Lagrangian |y - x|^2 / 2 - lambda f, the part along the gradient solves the constraint, and the
// part along the tangents T solves (T^t M T) s = T^t (x - y - M normal), M = I - lambda H; T^t M T is kept
// positive, so that the step heads for a minimum.
Vec3 step_on_sheet(const FieldJet& jet, const Vec3& free_gradient, const Vec3& x_y, const Held& held) {
  const double squared = free_gradient.squaredNorm();
  const Vec3 normal = free_gradient * (-jet.value / squared);
  const double lambda = -x_y.dot(free_gradient) / squared;
  const Mat3 m = Mat3::Identity() - lambda * jet.hessian;
  const auto [t0, t1] = tangents(free_gradient, held);
  const Vec3 residual = x_y - m * normal;
  double a = t0.dot(m * t0), b = t0.dot(m * t1), c = t1.isZero() ? 1.0 : t1.dot(m * t1);
  const double r0 = t0.dot(residual), r1 = t1.dot(residual);
  constexpr double least = 0.2;
  const double smallest = 0.5 * (a + c) - std::sqrt(0.25 * (a - c) * (a - c) + b * b);
  if (smallest < least) a += least - smallest, c += least - smallest;
  const double determinant = a * c - b * b;
  return normal + t0 * ((c * r0 - b * r1) / determinant) + t1 * ((a * r1 - b * r0) / determinant);
}

// Coefficients of the combination of two vectors whose products with them are `products`.
Eigen::Vector2d combine(const std::array<Vec3, 2>& vectors, const Eigen::Vector2d& products) {
  const double a = vectors[0].squaredNorm(), b = vectors[0].dot(vectors[1]), c = vectors[1].squaredNorm();
  return Eigen::Vector2d(c * products[0] - b * products[1], a * products[1] - b * products[0]) /
         (a * c - b * b);
}

// Whether the sine of the angle at which two sheets cross is larger.
bool cross(const std::array<Vec3, 2>& gradients, double sine) {
  return gradients[0].cross(gradients[1]).squaredNorm() >
         sine * sine * gradients[0].squaredNorm() * gradients[1].squaredNorm();
}

// The same for the curve {f_0 = f_1 = 0}: one direction is left, none if a face of the box is held.
Vec3 step_on_crease(const std::array<FieldJet, 2>& jets, const std::array<Vec3, 2>& free_gradients,
                    const Vec3& x_y, const Held& held) {
  const Eigen::Vector2d to_sheets = combine(free_gradients, -Eigen::Vector2d(jets[0].value, jets[1].value));
  const Vec3 normal = to_sheets[0] * free_gradients[0] + to_sheets[1] * free_gradients[1];
  if (held != Held{}) return normal;
  const Eigen::Vector2d lambda =
      combine(free_gradients, -Eigen::Vector2d(x_y.dot(free_gradients[0]), x_y.dot(free_gradients[1])));
  const Mat3 m = Mat3::Identity() - lambda[0] * jets[0].hessian - lambda[1] * jets[1].hessian;
  const Vec3 tangent = free_gradients[0].cross(free_gradients[1]).normalized();
  constexpr double least = 0.2;
  return normal + tangent * (tangent.dot(x_y - m * normal) / std::max(least, tangent.dot(m * tangent)));
}

Vec3 without(Vec3 vector, const Held& held) {
  for (int axis = 0; axis < 3; ++axis)
    if (held[axis] != 0) vector[axis] = 0.0;
  return vector;
}

FieldJet jet_of(const Sheet& sheet, const Vec3& y, bool finely) {
  FieldJet jet = finely ? interpolate_jet_finely(*sheet.field, y) : interpolate_jet(*sheet.field, y);
  jet.value -= sheet.level;
  return jet;
}

// What is left of `pull` after the sheets have taken what lies along their free gradients.
Vec3 along_sheets(const Vec3& pull, const std::array<FieldJet, 2>& jets,
                  const std::array<Vec3, 2>& free_gradients, std::size_t sheets) {
  if (sheets == 1)
    return pull + jets[0].gradient * (-pull.dot(free_gradients[0]) / free_gradients[0].squaredNorm());
  const Eigen::Vector2d taken =
      combine(free_gradients, {pull.dot(free_gradients[0]), pull.dot(free_gradients[1])});
  return pull - taken[0] * jets[0].gradient - taken[1] * jets[1].gradient;
}

// The last correction, along the gradients.
Vec3 polish(std::span<const Sheet> sheets, const Vec3& y, const std::array<Vec3, 2>& gradients) {
  const auto value = [&](std::size_t n) { return interpolate_value(*sheets[n].field, y) - sheets[n].level; };
  if (sheets.size() == 1) return y - gradients[0] * (value(0) / gradients[0].squaredNorm());
  const Eigen::Vector2d way = combine(gradients, -Eigen::Vector2d(value(0), value(1)));
  return y + way[0] * gradients[0] + way[1] * gradients[1];
}

constexpr double most_settled = 0.15;    // the largest last step of any search
constexpr double finely_settled = 0.01;  // that on the septic interpolants

// Newton's method, one step after the other, and what the last one knew.
class Search {
 public:
  Search(std::span<const Sheet> sheets, const Vec3& x, const Vec3& start)
      : sheets_(sheets), x_(x), y_(start), lower_(Vec3::Constant(-0.5)) {
    const Index3& points = sheets[0].field->points;
    upper_ = Vec3(points[0], points[1], points[2]) - Vec3::Constant(0.5);
  }

  enum class End { settled, unsettled, nowhere };  // nowhere: a step could not be computed
  // On the cubic interpolants until a step is at most `settled`.
  End settle(double settled);
  // On the septic interpolants from here, whose surface lies elsewhere by less than half a voxel.
  std::optional<Vec3> refine();
  // The last correction, on the quintic interpolants.
  std::optional<Vec3> polished() const;

  double last_step() const { return step_.norm(); }
  bool needs_finer() const;

 private:
  bool advance(bool finely, bool damped);
  bool release();
  Vec3 in_box(const Vec3& y) const { return y.cwiseMax(lower_).cwiseMin(upper_); }

  std::span<const Sheet> sheets_;
  Vec3 x_, y_, lower_, upper_;
  Held held_{};
  std::array<FieldJet, 2> jets_;
  std::array<Vec3, 2> gradients_;  // within the free axes
  Vec3 step_ = Vec3::Zero();
  bool stopped_ = false;  // at a face
};

// False if no step can be computed. `damped`: half a step where it leads back, to and fro across the minimum.
bool Search::advance(bool finely, bool damped) {
  constexpr double least_sine = 0.01;  // of an angle from which the step to a crease can be computed
  for (std::size_t n = 0; n < sheets_.size(); ++n) {
    jets_[n] = jet_of(sheets_[n], y_, finely);
    gradients_[n] = without(jets_[n].gradient, held_);
    if (!(gradients_[n].squaredNorm() > 1e-12)) return false;
  }
  if (sheets_.size() == 2 && !cross(gradients_, least_sine)) return false;
  Vec3 step = sheets_.size() == 1 ? step_on_sheet(jets_[0], gradients_[0], x_ - y_, held_)
                                  : step_on_crease(jets_, gradients_, x_ - y_, held_);
  const double length = step.norm();
  if (length > 1.0) step /= length;
  if (damped && step.dot(step_) < 0) step *= 0.5;
  step_ = step;
  y_ += step;
  stopped_ = false;
  for (int axis = 0; axis < 3; ++axis) {
    if (y_[axis] < lower_[axis] || y_[axis] > upper_[axis]) {
      held_[axis] = y_[axis] < lower_[axis] ? -1 : 1;
      y_[axis] = std::clamp(y_[axis], lower_[axis], upper_[axis]);
      stopped_ = true;
    }
  }
  return true;
}

// Lets go of the faces that do not bind: a face binds while the way to the minimum leads out through it.
bool Search::release() {
  const Vec3 pull = along_sheets(x_ - y_, jets_, gradients_, sheets_.size());
  bool released = false;
  for (int axis = 0; axis < 3; ++axis)
    if (held_[axis] * pull[axis] < 0) held_[axis] = 0, released = true;
  return released;
}

Search::End Search::settle(double settled) {
  constexpr int most_iterations = 12;
  bool released = false;  // once
  for (int iteration = 0; iteration < most_iterations; ++iteration) {
    if (!advance(false, false)) return End::nowhere;
    // Near a centre of curvature steps shrink slowly: then a longer one has to do.
    const double enough = iteration < most_iterations / 2 ? settled : most_settled;
    if (stopped_ || step_.squaredNorm() > enough * enough) continue;
    if (released || !(released = release())) return End::settled;
  }
  return End::unsettled;
}

// Whether the cubic interpolants know the place of the surface, and its curvature, too badly for a quintic
// correction: at a radius of curvature of about a voxel, and at creases of sheets that all but touch.
bool Search::needs_finer() const {
  for (std::size_t n = 0; n < sheets_.size(); ++n)
    if (jets_[n].hessian.squaredNorm() > jets_[n].gradient.squaredNorm()) return true;
  return sheets_.size() == 2 && !cross(gradients_, 0.5);
}

std::optional<Vec3> Search::refine() {
  constexpr int most_iterations = 8;
  const Vec3 roughly = y_;
  for (int iteration = 0; iteration < most_iterations; ++iteration) {
    if (!advance(true, iteration >= most_iterations / 2) || !((y_ - roughly).norm() < 0.5)) return {};
    if (last_step() < finely_settled) return y_;
  }
  const Vec3 corrected = polish(sheets_, y_, gradients_);
  if (!(last_step() < most_settled && (corrected - y_).norm() < finely_settled)) return {};
  return in_box(corrected);
}

std::optional<Vec3> Search::polished() const {
  if (sheets_.size() == 1) return in_box(polish(sheets_, y_, gradients_));
  // The interpolants' creases lie farther apart: twice, and not where a correction may lead anywhere.
  Vec3 y = y_;
  for (const double most : {most_settled, finely_settled}) {
    const Vec3 corrected = polish(sheets_, y, gradients_);
    if (!((corrected - y).norm() < most)) return {};
    y = in_box(corrected);
  }
  return y;
}

}  // namespace

std::optional<Vec3> find_closest_point(std::span<const Sheet> sheets, const Vec3& x, const Vec3& start,
                                       Accuracy accuracy) {
  // The tangential error is about the square of the last step, and the error of the distance the square of
  // that. Along a crease the sheets' errors add up, the more the less they are inclined.
  const double crease_factor = sheets.size() == 1 ? 1.0 : 0.2;
  const double settled = crease_factor * (accuracy == Accuracy::fine ? 0.03 : most_settled);
  const bool may_refine =
      accuracy == Accuracy::fine && *std::ranges::min_element(sheets[0].field->points) > 1;
  Search search(sheets, x, start);
  switch (search.settle(settled)) {
    case Search::End::settled:
      if (may_refine && (search.last_step() > settled || search.needs_finer())) return search.refine();
      return search.polished();
    case Search::End::unsettled:
      if (may_refine && sheets.size() == 1) return search.refine();
      return std::nullopt;
    case Search::End::nowhere:
      return std::nullopt;
  }
  return std::nullopt;
}

}  // namespace anticrack
