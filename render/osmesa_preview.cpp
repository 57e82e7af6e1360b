#include "osmesa_preview.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "errors.h"
#include "gl_functions.h"
#include "lighting.h"
#include "preview_shaders.h"

namespace anticrack {

namespace {

/// A context with the state that all previews share.
class Preview {
 public:
  /// @param supersampling  samples along each side of a pixel
  Preview(const Camera& camera, const ColorScale& scale, int supersampling)
      : supersampling_(supersampling),
        camera_(camera),
        scale_(scale),
        context_(make_osmesa_context(supersampling * camera.width(), supersampling * camera.height())),
        gl(*context_) {
    gl.Viewport(0, 0, supersampling * camera.width(), supersampling * camera.height());
    gl.ClearColor(1, 1, 1, 1);
    gl.Clear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
    gl.Enable(GL_DEPTH_TEST);
    GLuint array = 0;
    gl.GenVertexArrays(1, &array);
    gl.BindVertexArray(array);
    const auto& table = scale.map->table();
    bind_texture(0, GL_RGB32F, int(table.size()), 1, GL_RGB, table.data());
  }

  /// Compiles, links and selects a program, with the uniforms that all have.
  void use_program(const char* vertex_source, const std::string& fragment_source) {
    program_ = gl.CreateProgram();
    gl.AttachShader(program_, compile(GL_VERTEX_SHADER, vertex_source));
    gl.AttachShader(program_, compile(GL_FRAGMENT_SHADER, shading_source + fragment_source));
    gl.LinkProgram(program_);
    GLint linked = GL_FALSE;
    gl.GetProgramiv(program_, GL_LINK_STATUS, &linked);
    if (linked == GL_FALSE) throw InputError("OpenGL: the preview's shaders do not link");
    gl.UseProgram(program_);
    gl.Uniform1i(location("color_map"), 0);
    gl.Uniform3f(location("range"), float(scale_.low), float(scale_.high), scale_.logarithmic ? 1 : 0);
    gl.Uniform3f(location("key"), key_direction[0], key_direction[1], key_direction[2]);
    gl.Uniform3f(location("strength"), sky_strength, key_strength, least_light);
    set_projection();
  }

  GLint location(const char* name) const { return gl.GetUniformLocation(program_, name); }
  void set(const char* name, const Vec3& v) const {
    gl.Uniform3f(location(name), float(v.x()), float(v.y()), float(v.z()));
  }

  void attribute(GLuint index, int components, const float* data, std::size_t count) {
    GLuint buffer = 0;
    gl.GenBuffers(1, &buffer);
    gl.BindBuffer(GL_ARRAY_BUFFER, buffer);
    gl.BufferData(GL_ARRAY_BUFFER, GLsizeiptr(count * std::size_t(components) * sizeof(float)), data,
                  GL_STATIC_DRAW);
    gl.VertexAttribPointer(index, components, GL_FLOAT, GL_FALSE, 0, nullptr);
    gl.EnableVertexAttribArray(index);
  }

  void bind_texture(int unit, GLint internal, int width, int height, GLenum format, const void* data) {
    GLuint texture = 0;
    gl.GenTextures(1, &texture);
    gl.ActiveTexture(GL_TEXTURE0 + GLenum(unit));
    gl.BindTexture(GL_TEXTURE_2D, texture);
    gl.PixelStorei(GL_UNPACK_ALIGNMENT, 1);
    gl.TexImage2D(GL_TEXTURE_2D, 0, internal, width, height, 0, format, GL_FLOAT, data);
    for (const GLenum filter : {GL_TEXTURE_MIN_FILTER, GL_TEXTURE_MAG_FILTER}) {
      gl.TexParameteri(GL_TEXTURE_2D, filter, GL_LINEAR);
    }
    for (const GLenum wrap : {GL_TEXTURE_WRAP_S, GL_TEXTURE_WRAP_T}) {
      gl.TexParameteri(GL_TEXTURE_2D, wrap, GL_CLAMP_TO_EDGE);
    }
  }

  /// The drawn picture, averaged over the samples of each pixel in linear light.
  Image image() {
    const auto& bytes = context_->finish();
    if (const GLenum error = gl.GetError(); error != GL_NO_ERROR) {
      throw InputError("OpenGL: error " + std::to_string(error) + " while drawing the preview");
    }
    std::array<float, 256> linear;
    for (std::size_t i = 0; i < linear.size(); ++i) linear[i] = decode_srgb(std::uint8_t(i));
    Image image(camera_.width(), camera_.height());
    for (int row = 0; row < image.height; ++row) {
      for (int column = 0; column < image.width; ++column) {
        std::array<float, 3> sum{};
        bool flat = true;
        const std::uint8_t* first = nullptr;
        for (int s = 0; s < supersampling_ * supersampling_; ++s) {
          const auto x = std::size_t(column * supersampling_ + s % supersampling_);
          const auto y = std::size_t(row * supersampling_ + s / supersampling_);
          const std::uint8_t* sample = &bytes[4 * (y * std::size_t(supersampling_ * image.width) + x)];
          if (s == 0) first = sample;
          flat = flat && std::equal(first, first + 3, sample);
          for (std::size_t c = 0; c < 3; ++c) sum[c] += linear[sample[c]] / (supersampling_ * supersampling_);
        }
        for (std::size_t c = 0; c < 3; ++c) image.at(column, row)[c] = flat ? first[c] : encode_srgb(sum[c]);
      }
    }
    return image;
  }

 private:
  const int supersampling_;
  const Camera& camera_;
  const ColorScale& scale_;
  std::unique_ptr<GlContext> context_;
  GLuint program_ = 0;

  GLuint compile(GLenum kind, const std::string& source) {
    const std::string versioned = "#version 330 core\n" + source;
    const char* text = versioned.c_str();
    const GLuint shader = gl.CreateShader(kind);
    gl.ShaderSource(shader, 1, &text, nullptr);
    gl.CompileShader(shader);
    GLint compiled = GL_FALSE;
    gl.GetShaderiv(shader, GL_COMPILE_STATUS, &compiled);
    if (compiled == GL_FALSE) {
      char log[1024] = "";
      gl.GetShaderInfoLog(shader, sizeof log, nullptr, log);
      throw InputError(std::string("OpenGL: a shader of the preview does not compile: ") + log);
    }
    return shader;
  }

  /// World to clip space; the camera's own projection decides, so that both renderers agree.
  void set_projection() const {
    const Vec3 zero = camera_.project(Vec3::Zero());
    float m[16] = {};  // column major
    for (int axis = 0; axis <= 3; ++axis) {
      const Vec3 p = axis < 3 ? Vec3(camera_.project(Vec3::Unit(axis)) - zero) : zero;
      const double shift = axis == 3 ? 1 : 0;
      m[4 * axis + 0] = float(2 * p.x() / camera_.width() - shift);
      m[4 * axis + 1] = float(shift - 2 * p.y() / camera_.height());
      m[4 * axis + 2] = float(2 * p.z() / camera_.depth_range() - shift);
      m[4 * axis + 3] = float(shift);
    }
    gl.UniformMatrix4fv(location("projection"), 1, GL_FALSE, m);
  }

 public:
  GlFunctions gl;
};

Vec3 to_vec3(const Point& p) {
  return {p[0], p[1], p[2]};
}

}  // namespace

Image preview_surface(const Mesh& mesh, const PointLight& light, const Camera& camera,
                      const ColorScale& scale, const std::optional<CutSection>& cut) {
  if (light.sky.size() != mesh.position.size()) throw InputError("preview: expected light for each vertex");
  Preview preview(camera, scale, 2);
  const GlFunctions& gl = preview.gl;

  preview.use_program(surface_vertex_source, surface_fragment_source);
  if (cut) {
    const CutPlane& plane = cut->plane();
    gl.Uniform4f(preview.location("cut"), plane.normal[0], plane.normal[1], plane.normal[2], plane.offset);
    gl.Enable(GL_CLIP_DISTANCE0);
  }
  preview.attribute(0, 3, mesh.position.data()->data(), mesh.position.size());
  preview.attribute(1, 3, mesh.normal.data()->data(), mesh.normal.size());
  preview.attribute(2, 1, mesh.scalar.data(), mesh.scalar.size());
  preview.attribute(3, 1, light.sky.data(), light.sky.size());
  preview.attribute(4, 1, light.key.data(), light.key.size());
  GLuint indices = 0;
  gl.GenBuffers(1, &indices);
  gl.BindBuffer(GL_ELEMENT_ARRAY_BUFFER, indices);
  gl.BufferData(GL_ELEMENT_ARRAY_BUFFER, GLsizeiptr(mesh.triangle.size() * sizeof(mesh.triangle[0])),
                mesh.triangle.data(), GL_STATIC_DRAW);
  gl.Enable(GL_CULL_FACE);
  gl.DrawElements(GL_TRIANGLES, GLsizei(3 * mesh.triangle.size()), GL_UNSIGNED_INT, nullptr);

  if (cut) {
    gl.Disable(GL_CLIP_DISTANCE0);
    gl.Disable(GL_CULL_FACE);
    preview.use_program(cap_vertex_source, cap_fragment_source);
    preview.bind_texture(1, GL_RG32F, cut->width(), cut->height(), GL_RG, cut->raster().data());
    gl.Uniform1i(preview.location("section"), 1);
    gl.Uniform1f(preview.location("surface_fraction"), cut->surface_fraction());
    const Vec3 origin = to_vec3(cut->corner(0, 0));
    preview.set("origin", origin);
    preview.set("right", to_vec3(cut->corner(1, 0)) - origin);
    preview.set("up", to_vec3(cut->corner(0, 1)) - origin);
    gl.DrawArrays(GL_TRIANGLE_STRIP, 0, 4);
  }
  return preview.image();
}

Image preview_spheres(const SphereCloud& spheres, const PointLight& light, const Camera& camera,
                      const ColorScale& scale, const std::optional<CutPlane>& cut) {
  if (light.sky.size() != spheres.position.size())
    throw InputError("preview: expected light for each sphere");
  std::vector<Point> position;
  std::vector<float> scalar;
  PointLight kept;
  for (std::size_t i = 0; i < spheres.position.size(); ++i) {
    if (cut && cut->distance(spheres.position[i]) > 0) continue;
    position.push_back(spheres.position[i]);
    scalar.push_back(spheres.scalar[i]);
    kept.sky.push_back(light.sky[i]);
    kept.key.push_back(light.key[i]);
  }
  if (position.empty()) throw InputError("the cut plane removes every particle");

  Preview preview(camera, scale, 1);
  const GlFunctions& gl = preview.gl;
  const double diameter = 2 * double(spheres.radius) / camera.pixel_size();
  float size_range[2] = {};
  gl.GetFloatv(GL_ALIASED_POINT_SIZE_RANGE, size_range);
  if (diameter > double(size_range[1])) {
    throw InputError("preview: a sphere covers " + std::to_string(diameter) +
                     " pixels; OpenGL draws points up to " + std::to_string(size_range[1]) +
                     ". Use a smaller picture or the Embree renderer.");
  }
  preview.use_program(sphere_vertex_source, sphere_fragment_source);
  gl.Enable(GL_PROGRAM_POINT_SIZE);
  gl.Uniform1f(preview.location("diameter"), float(diameter));
  gl.Uniform1f(preview.location("depth_of_radius"), float(double(spheres.radius) / camera.depth_range()));
  preview.set("camera_right", camera.right());
  preview.set("camera_up", camera.up());
  preview.set("camera_forward", camera.direction());
  preview.attribute(0, 3, position.data()->data(), position.size());
  preview.attribute(2, 1, scalar.data(), scalar.size());
  preview.attribute(3, 1, kept.sky.data(), kept.sky.size());
  preview.attribute(4, 1, kept.key.data(), kept.key.size());
  gl.DrawArrays(GL_POINTS, 0, GLsizei(position.size()));
  return preview.image();
}

}  // namespace anticrack
