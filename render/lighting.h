#pragma once

#include <array>
#include <span>

#include "mesh.h"

namespace anticrack {

/// The light of all pictures, fixed to the world: a wide key light from the upper front left and an overcast
/// sky.
///
/// A picture's colour is the colour bar's colour times a grey factor in [0, 1] in linear light, so that hue
/// always reads back and a fully lit point has exactly the colour of the bar.
inline constexpr Point key_direction{0.0512989176f, 0.718184846f,
                                     0.693958943f};  // towards the light, unit length
inline constexpr float key_strength = 0.60f;
inline constexpr float sky_strength = 0.48f;
inline constexpr float least_light = 0.05f;  ///< so that the deepest pore still shows its colour

inline float dot(const Point& a, const Point& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/// Grey factor of a point.
/// @param sky  part of the sky's light that reaches it, in [0, 1]
/// @param key  visible part of the key light, times max(0, cosine to it)
inline float light_factor(float sky, float key) {
  const float light = least_light + sky_strength * sky + key_strength * key;
  return light < 1 ? light : 1.0f;
}

/// Brightness of the sky from a direction: twice as bright above as below.
inline float sky_radiance(const Point& towards) {
  return 1 + towards[1] / 3;
}

/// Evenly spread fixed directions, the same for every vertex: neighbours see the same error, so there is no
/// noise.
std::span<const Point> sky_directions();  ///< 64 over the sphere
std::span<const Point> key_directions();  ///< 16 over a cone of 10 degrees around the key light

}  // namespace anticrack
