#pragma once

namespace anticrack {

// OpenGL 3.3 sources of the preview. The constants of lighting.h come as uniforms: one place fixes the light.

/// Colour from scalar and light, common to all fragment shaders.
inline constexpr char shading_source[] = R"(
uniform sampler2D color_map;
uniform vec3 range;      // low, high, 1 if logarithmic
uniform vec3 key;        // towards the key light
uniform vec3 strength;   // sky, key, least
out vec4 color;

void shade(float scalar, float light) {
  float t = range.z > 0.5 ? log(max(scalar, range.x) / range.x) / log(range.y / range.x)
                          : (scalar - range.x) / (range.y - range.x);
  float texels = float(textureSize(color_map, 0).x);
  vec3 linear = light * texture(color_map, vec2((0.5 + clamp(t, 0, 1) * (texels - 1)) / texels, 0.5)).rgb;
  color = vec4(mix(12.92 * linear, 1.055 * pow(linear, vec3(1 / 2.4)) - 0.055, step(0.0031308, linear)), 1);
}

float light_of(vec3 normal, vec2 light) {
  return min(1, strength.z + strength.x * light.x + strength.y * light.y * max(0, dot(normal, key)));
}
)";

inline constexpr char surface_vertex_source[] = R"(
layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
layout(location = 2) in float scalar;
layout(location = 3) in float sky;
layout(location = 4) in float visible_key;
uniform mat4 projection;
uniform vec4 cut;  // normal, offset
out vec3 n;
out float s;
out vec2 light;
void main() {
  gl_Position = projection * vec4(position, 1);
  gl_ClipDistance[0] = cut.w - dot(cut.xyz, position);
  n = normal;
  s = scalar;
  light = vec2(sky, visible_key);
}
)";

inline constexpr char surface_fragment_source[] = R"(
in vec3 n;
in float s;
in vec2 light;
void main() { shade(s, light_of(normalize(n), light)); }
)";

/// A quad over the cut; corners from the vertex number.
inline constexpr char cap_vertex_source[] = R"(
uniform mat4 projection;
uniform vec3 origin, right, up;
out vec2 place;
void main() {
  place = vec2(gl_VertexID & 1, gl_VertexID >> 1);
  gl_Position = projection * vec4(origin + place.x * right + place.y * up, 1);
}
)";

inline constexpr char cap_fragment_source[] = R"(
uniform sampler2D section;  // solid fraction, solid fraction x scalar
uniform float surface_fraction;
in vec2 place;
void main() {
  vec2 size = vec2(textureSize(section, 0));
  vec2 v = texture(section, (0.5 + place * (size - 1)) / size).rg;
  float edge = fwidth(v.r);
  if (v.r < surface_fraction) discard;
  shade(v.g / v.r, v.r - surface_fraction < 1.5 * edge ? 0.3 : 1.0);
}
)";

inline constexpr char sphere_vertex_source[] = R"(
layout(location = 0) in vec3 position;
layout(location = 2) in float scalar;
layout(location = 3) in float sky;
layout(location = 4) in float visible_key;
uniform mat4 projection;
uniform float diameter;  // pixels
flat out float s;
flat out vec2 light;
void main() {
  gl_Position = projection * vec4(position, 1);
  gl_PointSize = diameter;
  s = scalar;
  light = vec2(sky, visible_key);
}
)";

inline constexpr char sphere_fragment_source[] = R"(
uniform vec3 camera_right, camera_up, camera_forward;
uniform float depth_of_radius;  // in units of the depth buffer
flat in float s;
flat in vec2 light;
void main() {
  vec2 p = 2 * gl_PointCoord - 1;
  float rest = 1 - dot(p, p);
  if (rest < 0) discard;
  float z = sqrt(rest);
  gl_FragDepth = gl_FragCoord.z - z * depth_of_radius;
  shade(s, light_of(p.x * camera_right - p.y * camera_up - z * camera_forward, light));
}
)";

}  // namespace anticrack
