#include "embree_image.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>
#include <numbers>

#include "errors.h"
#include "expect_error.h"
#include "particle_shapes.h"
#include "surface.h"

namespace anticrack {
namespace {

using namespace testing_shapes;

const View front{0, 0};

ColorScale unit_scale() {
  ColorScale scale;
  scale.map = &ColorMap::strain();
  return scale;
}

double brightness(const Rgb8& c) {
  return 0.2126 * c[0] + 0.7152 * c[1] + 0.0722 * c[2];
}

bool is_background(const Rgb8& c) {
  return c == Rgb8{255, 255, 255};
}

int covered_pixels(const RenderLayers& layers) {
  int count = 0;
  for (const float d : layers.depth) count += std::isfinite(d);
  return count;
}

struct Rendered {
  Camera camera;
  RenderLayers layers;
};

Rendered render_surface(const Particles& p, const View& view, int width, int height,
                        const std::optional<CutPlane>& cut = {}, int samples = 8) {
  const SolidField field(p.position, p.scalar, p.spacing);
  const Mesh mesh = extract_surface(field);
  std::optional<CutSection> section;
  if (cut) section.emplace(*cut, field);
  EmbreeScene scene(mesh, section);
  const Camera camera = Camera::fit(p.box, view, width, height);
  scene.bake_light(camera);
  return {camera, scene.render(camera, unit_scale(), samples)};
}

Rendered render_spheres(const Particles& p, const View& view, int width, int height,
                        const std::optional<CutPlane>& cut = {}) {
  EmbreeScene scene(SphereCloud{p.position, p.scalar, float(0.62 * p.spacing)}, cut);
  const Camera camera = Camera::fit(p.box, view, width, height);
  scene.bake_light(camera);
  return {camera, scene.render(camera, unit_scale(), 8)};
}

TEST(EmbreeImage, BallCoversItsAreaAndIsBrighterAtItsCentreThanAtItsLimb) {
  for (const bool spheres : {false, true}) {
    const Rendered r =
        spheres ? render_spheres(ball(), front, 200, 200) : render_surface(ball(), front, 200, 200);
    const double radius = 1 / r.camera.pixel_size();
    // Half a particle spacing of radius 1 at 16 spacings: 3 %, twice that in area; spheres stand out a little
    // more.
    EXPECT_NEAR(covered_pixels(r.layers) / (std::numbers::pi * radius * radius), 1, spheres ? 0.10 : 0.05);
    const auto at = [&](double x, double y) {
      return brightness(r.layers.color.at(int(100 + x * radius), int(100 - y * radius)));
    };
    double centre = 0;
    double limb = 0;
    for (int i = 0; i < 36; ++i) {
      const double a = i * std::numbers::pi / 18;
      centre += at(0.2 * std::cos(a), 0.2 * std::sin(a)) / 36;
      limb += at(0.9 * std::cos(a), 0.9 * std::sin(a)) / 36;
    }
    EXPECT_GT(centre, limb + 15);
    EXPECT_GT(at(0, 0.7), at(0, -0.7) + 15) << "the key light comes from above";
    EXPECT_TRUE(is_background(r.layers.color.at(2, 2)));
  }
}

TEST(EmbreeImage, DepthIsTheDistanceBehindTheNearPlane) {
  const Rendered r = render_surface(ball(), front, 101, 101);
  const Vec3 nearest(1.25, 1.25, 2.25);
  EXPECT_NEAR(r.layers.depth[50 * 101 + 50], r.camera.project(nearest).z(), 0.5 * 2.5 / 40);
}

TEST(EmbreeImage, ShowsTheFrontOfSpheresThatStandOutOfTheBox) {
  const Rendered r = render_spheres(block([](const Vec3&) { return 0.0; }, 8), View{0, 0}, 200, 400);
  const Vec3 pole = r.camera.project(Vec3(4.5 / 8, 8.5 / 8, 1));
  // The front of the sphere, 0.12 spacings before the face; a ray that began inside would meet its back.
  EXPECT_NEAR(r.layers.depth[std::size_t(pole.y()) * 200 + std::size_t(pole.x())], pole.z() - 0.12 / 8,
              0.1 / 8);
}

TEST(EmbreeImage, ShowsTheBandWhereItLies) {
  const Rendered r = render_surface(porous_block(), View{30, 20}, 160, 280);
  // Centre of mass of dark pixels' scalar along the picture against the projected middle of the band.
  double weight = 0;
  double row_sum = 0;
  for (int row = 0; row < 280; ++row) {
    for (int column = 0; column < 160; ++column) {
      const float s = r.layers.scalar[std::size_t(row * 160 + column)];
      if (!std::isfinite(s)) continue;
      weight += double(s);
      row_sum += double(s) * row;
    }
  }
  // The front faces lie nearer than the centre: they appear lower by up to half the depth times
  // sin(elevation).
  const Vec3 middle = r.camera.project(Vec3(0.5, 1, 0.5));
  const double shift = 0.7 * std::sin(20 * std::numbers::pi / 180) / r.camera.pixel_size();
  EXPECT_GT(row_sum / weight, middle.y());
  EXPECT_LT(row_sum / weight, middle.y() + shift);
}

TEST(EmbreeImage, HueReadsBackUnderAnyShading) {
  // Shading multiplies the map's colour by a grey factor: the ratios of linear channels stay.
  const Particles p = ball(0.5);
  const Rendered r = render_surface(p, front, 120, 120);
  const auto expected = ColorMap::strain().linear_rgb(0.5);
  int checked = 0;
  for (std::size_t i = 0; i < r.layers.depth.size(); ++i) {
    const Rgb8& c = r.layers.color.pixels[i];
    const float red = decode_srgb(c[0]);
    const int column = int(i) % 120;
    const int row = int(i) / 120;
    if (std::hypot(column - 60, row - 60) > 40) continue;
    // One step of a byte of a channel around 100 is 2 % of its linear light.
    EXPECT_NEAR(decode_srgb(c[2]) / red, expected[2] / expected[0], 0.03 * expected[2] / expected[0] + 0.02);
    ++checked;
  }
  EXPECT_GT(checked, 4000);
}

TEST(EmbreeImage, CutPlaneShowsTheInteriorInTheColoursOfTheBar) {
  // The value depends on depth alone: 0.3 at the plane, 1 at the front that the cut removes.
  const Particles p = block([](const Vec3& x) { return x.z() < 0.6 ? 0.3 : 1; });
  const CutPlane plane{{0, 0, 1}, 0.4f};
  const Rendered r = render_surface(p, front, 100, 200, plane);
  const std::size_t centre = 100 * 100 + 50;
  EXPECT_NEAR(r.layers.scalar[centre], 0.3, 1e-4);
  EXPECT_EQ(r.layers.color.pixels[centre], ColorMap::strain().rgb(0.3));
  EXPECT_NEAR(r.layers.depth[centre], r.camera.project(Vec3(0.5, 1, 0.4)).z(), 1e-4);
  const Rendered whole = render_surface(p, front, 100, 200);
  EXPECT_NEAR(whole.layers.scalar[centre], 1, 1e-4);
}

TEST(EmbreeImage, CutSpheresAreGone) {
  const Particles p = block([](const Vec3&) { return 0; }, 16);
  const Rendered r = render_spheres(p, front, 60, 120, CutPlane{{0, 1, 0}, 1});
  const Rendered whole = render_spheres(p, front, 60, 120);
  EXPECT_NEAR(covered_pixels(r.layers) / double(covered_pixels(whole.layers)), 0.5, 0.03);
  EXPECT_ERROR(render_spheres(p, front, 60, 120, CutPlane{{0, 1, 0}, -5}), InputError,
               "the cut plane removes every particle");
}

TEST(EmbreeImage, IsTheSameBytesForAnyNumberOfThreadsAndTwice) {
  const Particles p = porous_block(24);
  const CutPlane plane{{1, 0, 0}, 0.6f};
  const Image surface = render_surface(p, {}, 90, 150, plane, 16).layers.color;
  const Image spheres = render_spheres(p, {}, 90, 150).layers.color;
  for (const std::size_t threads : {1, 2, 5}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    EXPECT_EQ(render_surface(p, {}, 90, 150, plane, 16).layers.color.pixels, surface.pixels) << threads;
    EXPECT_EQ(render_spheres(p, {}, 90, 150).layers.color.pixels, spheres.pixels) << threads;
  }
}

TEST(EmbreeImage, PoresAreDarkerThanFaces) {
  // A hole of radius 0.25 through a block from front to back, seen askew: its wall lies in the shade.
  const Particles p = make_particles(
      {32, 32, 32}, 1.0 / 32, [](const Vec3& x) { return std::hypot(x.x() - 0.5, x.y() - 0.5) > 0.25; },
      [](const Vec3&) { return 0; });
  const Rendered r = render_surface(p, View{20, 0}, 150, 150);
  const auto at = [&](const Vec3& x) {
    const Vec3 pixel = r.camera.project(x);
    return brightness(r.layers.color.at(int(pixel.x()), int(pixel.y())));
  };
  EXPECT_LT(at(Vec3(0.26, 0.5, 0.7)), 0.8 * at(Vec3(0.12, 0.5, 1)));
}

TEST(EmbreeImage, RefusesToRenderWithoutLight) {
  const Particles p = ball();
  const SolidField field(p.position, p.scalar, p.spacing);
  const Mesh mesh = extract_surface(field);
  EmbreeScene scene(mesh);
  const Camera camera = Camera::fit(p.box, front, 20, 20);
  EXPECT_ERROR(scene.render(camera, unit_scale()), InputError, "the light of the scene is not baked");
  scene.bake_light(camera);
  EXPECT_ERROR(scene.render(camera, unit_scale(), 0), InputError, "samples = 0 a pixel; expected > 0");
}

TEST(CutSection, RefusesAPlaneThatMissesTheSample) {
  const Particles p = ball();
  const SolidField field(p.position, p.scalar, p.spacing);
  for (const float beside : {0.1f, 2.4f, 50.0f})  // the ball spans 0.25 to 2.25
    EXPECT_ERROR(CutSection({{0, 0, 1}, beside}, field), InputError, "m misses the sample, which spans 0.2");
  EXPECT_ERROR(CutSection({{0, 0, 0}, 1}, field), InputError, "cut plane: expected a normal with a length");
}

}  // namespace
}  // namespace anticrack
