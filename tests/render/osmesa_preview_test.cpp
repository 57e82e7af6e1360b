#include "osmesa_preview.h"

#include <gtest/gtest.h>

#include <cmath>

#include "embree_image.h"
#include "errors.h"
#include "expect_error.h"
#include "particle_shapes.h"
#include "surface.h"

namespace anticrack {
namespace {

using namespace testing_shapes;

ColorScale unit_scale() {
  ColorScale scale;
  scale.map = &ColorMap::strain();
  return scale;
}

bool is_background(const Rgb8& c) {
  return c == Rgb8{255, 255, 255};
}

/// Part of the pixels of which exactly one picture has something.
double silhouette_difference(const Image& a, const Image& b) {
  int differ = 0;
  int covered = 0;
  for (std::size_t i = 0; i < a.pixels.size(); ++i) {
    differ += is_background(a.pixels[i]) != is_background(b.pixels[i]);
    covered += !is_background(a.pixels[i]);
  }
  return double(differ) / covered;
}

struct Scene {
  Particles particles = porous_block();
  SolidField field{particles.position, particles.scalar, particles.spacing};
  Mesh mesh = extract_surface(field);
  SphereCloud spheres{particles.position, particles.scalar, float(0.62 * particles.spacing)};
  Camera camera = Camera::fit(particles.box, {}, 150, 250);
};

TEST(OsmesaPreview, SurfaceHasEmbreesSilhouetteAndColours) {
  const Scene s;
  const Image preview =
      preview_surface(s.mesh, QuickLight(s.field).at_vertices(s.mesh), s.camera, unit_scale());
  EmbreeScene scene(s.mesh);
  scene.bake_light(s.camera);
  const Image final = scene.render(s.camera, unit_scale(), 16).color;
  // Only edge pixels, where 4 samples meet 16, may differ.
  EXPECT_LT(silhouette_difference(final, preview), 0.03);
  double difference = 0;
  for (std::size_t i = 0; i < final.pixels.size(); ++i) {
    for (std::size_t c = 0; c < 3; ++c) difference += std::abs(final.pixels[i][c] - preview.pixels[i][c]);
  }
  // Swept light stands in for traced light: within a tenth of full scale on the average.
  EXPECT_LT(difference / (3 * double(final.pixels.size())), 25);
}

// So long that across it one coarse cell would do: the light is interpolated between two at least.
TEST(QuickLight, OfALongThinSampleIsReadWithinIt) {
  const Particles rod = make_particles(
      {6200, 4, 4}, 0.01, [](const Vec3&) { return true; }, [](const Vec3&) { return 0.0; });
  const SolidField field(rod.position, rod.scalar, rod.spacing);
  const PointLight light = QuickLight(field).at_particles(rod.position);
  for (const float sky : light.sky) ASSERT_TRUE(sky >= 0 && sky <= 1 + 1e-6f) << sky;  // a mean, in floats
}

TEST(OsmesaPreview, SpheresHaveEmbreesSilhouette) {
  const Scene s;
  const PointLight light = QuickLight(s.field).at_particles(s.spheres.position);
  const Image preview = preview_spheres(s.spheres, light, s.camera, unit_scale());
  EmbreeScene scene(s.spheres);
  scene.bake_light(s.camera);
  const Image final = scene.render(s.camera, unit_scale(), 16).color;
  // One sample a pixel: half of the edge pixels that 16 samples touch are missing.
  EXPECT_LT(silhouette_difference(final, preview), 0.10);
}

TEST(OsmesaPreview, CutShowsTheInteriorInTheColoursOfTheBar) {
  const Particles p = block([](const Vec3& x) { return x.z() < 0.6 ? 0.3 : 1; });
  const SolidField field(p.position, p.scalar, p.spacing);
  const Mesh mesh = extract_surface(field);
  const CutSection section({{0, 0, 1}, 0.4f}, field);
  const Camera camera = Camera::fit(p.box, {0, 0}, 60, 120);
  const PointLight light = QuickLight(field, section.plane()).at_vertices(mesh);
  const Rgb8 shown = preview_surface(mesh, light, camera, unit_scale(), section).at(30, 60);
  const Rgb8 expected = ColorMap::strain().rgb(0.3);
  for (std::size_t c = 0; c < 3; ++c)
    EXPECT_NEAR(shown[c], expected[c], 1);  // 8-bit rounding of another machine
}

TEST(OsmesaPreview, IsTheSameBytesTwice) {
  const Scene s;
  const PointLight light = QuickLight(s.field).at_vertices(s.mesh);
  EXPECT_EQ(preview_surface(s.mesh, light, s.camera, unit_scale()).pixels,
            preview_surface(s.mesh, light, s.camera, unit_scale()).pixels);
}

TEST(OsmesaPreview, RefusesPicturesAndPointsThatOpenGlCannotDraw) {
  const Scene s;
  const PointLight light = QuickLight(s.field).at_vertices(s.mesh);
  const Camera huge = Camera::fit(s.particles.box, {}, 40000, 10);
  EXPECT_ERROR(preview_surface(s.mesh, light, huge, unit_scale()), InputError, "OSMesa draws at most ");
  const Particles one = make_particles(
      {1, 1, 1}, 1, [](const Vec3&) { return true; }, [](const Vec3&) { return 0; });
  const SphereCloud sphere{one.position, one.scalar, 0.62f};
  EXPECT_ERROR(preview_spheres(sphere, {{1}, {1}}, Camera::fit(one.box, {}, 900, 900), unit_scale()),
               InputError, "preview: a sphere covers ");
  EXPECT_ERROR(preview_surface(s.mesh, {}, s.camera, unit_scale()), InputError,
               "preview: expected light for each vertex");
  EXPECT_ERROR(preview_spheres(s.spheres, {}, s.camera, unit_scale()), InputError,
               "preview: expected light for each sphere");
}

TEST(QuickLight, IsFullInTheOpenAndDimInACave) {
  // A box with a cave that opens to the side away from the key light.
  const Particles p = make_particles(
      {32, 32, 32}, 1.0 / 32,
      [](const Vec3& x) { return !(std::hypot(x.x() - 0.5, x.y() - 0.5) < 0.2 && x.z() < 0.6); },
      [](const Vec3&) { return 0; });
  const SolidField field(p.position, p.scalar, p.spacing);
  Mesh points;
  points.position = {{0.5f, 1.0f, 0.5f}, {0.5f, 0.5f, 0.6f}};
  points.normal = {{0, 1, 0}, {0, 0, -1}};
  const PointLight light = QuickLight(field).at_vertices(points);
  EXPECT_NEAR(light.sky[0], 1, 0.02);
  EXPECT_NEAR(light.key[0], 1, 0.02);
  EXPECT_LT(light.sky[1], 0.5);
  EXPECT_LT(light.key[1], 0.02);
}

}  // namespace
}  // namespace anticrack
