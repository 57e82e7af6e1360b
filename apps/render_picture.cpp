#include "render_picture.h"

#include <fmt/format.h>

#include <chrono>

#include "embree_image.h"
#include "errors.h"
#include "io/provenance.h"
#include "osmesa_preview.h"
#include "quick_light.h"
#include "surface.h"

namespace anticrack {

namespace {

/// Collects "surface 0.31 s, search tree 0.80 s, ...".
class Stopwatch {
 public:
  void lap(std::string_view stage) {
    const auto now = std::chrono::steady_clock::now();
    text_ += fmt::format("{}{} {:.2f} s", text_.empty() ? "" : ", ", stage,
                         std::chrono::duration<double>(now - last_).count());
    last_ = now;
  }
  const std::string& text() const { return text_; }

 private:
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
  std::string text_;
};

/// A sphere of the volume that a particle stood for.
SphereCloud sphere_cloud(const Frame& frame, std::vector<float> values) {
  return {frame.position, std::move(values), float(0.6203504909 * frame.header.particle_spacing)};
}

}  // namespace

Image draw_frame(const Frame& frame, const RenderField& field, const ColorScale& scale, const Camera& camera,
                 const RenderSettings& settings, const StageReport& report) {
  Stopwatch watch;
  std::optional<CutPlane> cut;
  if (settings.cut) cut = settings.cut->facing(camera);
  std::vector<float> values = field_values(frame, field);
  Image image;

  if (settings.mode == DrawMode::spheres) {
    const SphereCloud spheres = sphere_cloud(frame, std::move(values));
    if (settings.renderer == Renderer::embree) {
      EmbreeScene scene(spheres, cut);
      watch.lap("search tree");
      scene.bake_light(camera);
      watch.lap("light");
      image = scene.render(camera, scale, settings.samples).color;
      watch.lap("rays");
    } else {
      const SolidField solid(spheres.position, spheres.scalar, frame.header.particle_spacing);
      const PointLight light = QuickLight(solid, cut).at_particles(spheres.position);
      watch.lap("light");
      image = preview_spheres(spheres, light, camera, scale, cut);
      watch.lap("raster");
    }
  } else {
    const SolidField solid(frame.position, values, frame.header.particle_spacing);
    const Mesh mesh = extract_surface(solid);
    if (mesh.position.empty())
      throw InputError("no part of the sample is thick enough for a surface; use --mode spheres");
    std::optional<CutSection> section;
    if (cut) section.emplace(*cut, solid);
    watch.lap("surface");
    if (settings.renderer == Renderer::embree) {
      EmbreeScene scene(mesh, std::move(section));
      watch.lap("search tree");
      scene.bake_light(camera);
      watch.lap("light");
      image = scene.render(camera, scale, settings.samples).color;
      watch.lap("rays");
    } else {
      const PointLight light = QuickLight(solid, cut).at_vertices(mesh);
      watch.lap("light");
      image = preview_surface(mesh, light, camera, scale, section);
      watch.lap("raster");
    }
  }
  report(watch.text());
  return image;
}

TextChunks picture_text(const FrameHeader& header, const RenderField& field, const ColorScale& scale,
                        const RenderSettings& settings, const RenderArguments& arguments) {
  return {{"Software", fmt::format("anticrack {}", program_version())},
          {"Description",
           fmt::format("run \"{}\", frame {}, step {}, t = {} s, strain {} {} {}", header.run, header.index,
                       header.step, header.time, header.strain[0], header.strain[1], header.strain[2])},
          {"Parameters",
           fmt::format(
               "--field {} --range {},{}{} --renderer {} --mode {} --view {},{}{}{}", field.name, scale.low,
               scale.high, scale.logarithmic ? " --log" : "", arguments.renderer, arguments.mode,
               settings.view.azimuth, settings.view.elevation,
               settings.renderer == Renderer::embree ? fmt::format(" --samples {}", settings.samples) : "",
               arguments.cut.empty() ? "" : " --cut " + arguments.cut)}};
}

}  // namespace anticrack
