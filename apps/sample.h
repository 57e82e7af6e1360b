#pragma once

#include <optional>
#include <vector>

#include "microstructure.h"
#include "sample_lattice.h"
#include "scene.h"
#include "simulation.h"
#include "vec3.h"

namespace anticrack {

/// The material points that a scene begins with.
struct Sample {
  SampleLattice lattice;
  std::vector<Vec3> positions;                 ///< [m], in [0, lattice.size()], one per particle
  double particle_volume;                      ///< [m^3], the same for all: spacing cubed
  std::optional<double> solid_fraction_asked;  ///< empty where nobody asked: scans, foreign level sets
  double solid_fraction;                       ///< achieved: particles over lattice points
};

/// Bytes that making the structure of a scene needs, to a quarter of them.
double memory_to_generate(const SampleScene& scene);

/// Physical memory of this machine in bytes.
double machine_memory();

/// The structure that a scene names, generated or read from its file.
/// @throws InputError  the scene's source is a scan (it has points, but no level set); more lattice points
/// than memory;
///   or an empty structure
/// @throws FileError   a file that the scene names cannot be read
Microstructure load_microstructure(const SampleScene& scene);

/// The particles of a scene: the structure as above, or the scan, and one particle at each solid lattice
/// point.
/// @throws InputError, FileError  as above; or no lattice point is solid
Sample load_sample(const SampleScene& scene);

/// The same; where the sample's size was known by its file only, it checks the wall speed too. @throws
/// SceneError
Sample load_sample(const Scene& scene);

/// What the engine is told of a scene and the lattice of its sample.
SimulationSetup setup_of(const Scene& scene, const SampleLattice& lattice);

}  // namespace anticrack
