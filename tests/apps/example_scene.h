#pragma once

#include <stdexcept>
#include <string>

namespace anticrack {

// The line numbers of this scene stand in the tests: add at the end only.
inline const std::string example_scene = R"([sample]
size = [1.0, 2.0, 1.0]
resolution = 10

[microstructure]
source = "gaussian_random_field"
solid_fraction = 0.34
waves = 100
wavelengths_per_side = 3
heterogeneity = 50
seed = 1

[material]
model = "drucker_prager_softening"
density = 1e4
young_modulus = 10e9
poisson_ratio = 0.3
friction = 1.2
cohesion = 2.5e6
softening = 1e6

[loading]
kind = "confined_compression"
axis = "y"
platen = "both"
speed = 2.0
until_strain = 0.4

[numerics]
time_step = "safe"
flip = 0.99
grid_offset = [0, 0, 0]

[output]
history_every = 20
)";

/// The example with one text replaced by another.
inline std::string example_with(const std::string& text, const std::string& replacement) {
  std::string scene = example_scene;
  const std::size_t at = scene.find(text);
  if (at == std::string::npos) throw std::logic_error("the example scene has no " + text);
  return scene.replace(at, text.size(), replacement);
}

}  // namespace anticrack
