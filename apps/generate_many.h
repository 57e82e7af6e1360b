#pragma once

#include <filesystem>

#include "microstructure_io.h"
#include "progress.h"
#include "scene.h"

namespace anticrack {

/// Many realizations of one scene.
struct RealizationSeries {
  SampleScene scene;  ///< its seed is the first
  int count;          ///< realizations, of the seeds seed, seed + 1, ...
  std::filesystem::path folder;
  DensityGrid density;
  bool resume;  ///< keep the files that are there, if they are of this scene
  int threads;
};

/// Writes FOLDER/seed_<seed>.vdb for each seed, and FOLDER/index.csv: file, seed, solid_fraction,
/// solid_points, one row a finished file. Samples are made side by side, one thread each (measured in
/// apps/README.md), as many as fit into memory.
/// @throws InputError  the scene is no random field, or the folder holds something (files of another scene,
/// with `resume`)
/// @throws FileError   a file cannot be written or read
/// @throws Stopped     by a signal; the finished files are whole and in the index
void generate_many(const RealizationSeries& series, const ProgressOptions& progress);

}  // namespace anticrack
