#pragma once

#include <random>

#include "io/frame.h"

namespace anticrack {

/// Particles on the lattice points of a cube, `edge` along each side and shifted by a random half spacing,
/// with random values. The generator's numbers are the same on every machine, and the lower corner lies at
/// negative coordinates.
inline Frame sample_frame(int edge, double spacing = 0.01) {
  std::mt19937 random(7);
  const auto number = [&] { return float(random() / 4294967296.0 - 0.5); };
  Frame frame;
  frame.header.index = 12;
  frame.header.step = 8123456789;
  frame.header.time = 0.1;
  frame.header.strain = {-0.3, 1e-9, 0};
  frame.header.seconds_since_last_frame = 0.0125;
  frame.header.box_lower = Vec3(-0.05, -0.05, -0.05);
  frame.header.box_upper = Vec3::Constant(edge * spacing - 0.05);
  frame.header.particle_spacing = spacing;
  frame.header.cell_size = 2 * spacing;
  frame.header.run = "phi = 0.34";
  for (int i = 0; i < edge; ++i) {
    for (int j = 0; j < edge; ++j) {
      for (int k = 0; k < edge; ++k) {
        frame.id.push_back(std::uint32_t(frame.id.size()));
        const auto coordinate = [&](int n) { return float((n + 0.5 + number()) * spacing - 0.05); };
        frame.position.push_back({coordinate(i), coordinate(j), coordinate(k)});
        frame.velocity.push_back({number(), number(), number()});
        frame.kappa.push_back(number() > 0 ? 0 : number() + 1);
        frame.dkappa.push_back(0);
        frame.pressure.push_back(1e7f * number());
        frame.von_mises.push_back(1e7f * (number() + 0.5f));
      }
    }
  }
  return frame;
}

}  // namespace anticrack
