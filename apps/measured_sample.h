#pragma once

#include <string>

#include "image_options.h"
#include "measure_groups.h"

namespace anticrack {

/// The sample that a scene (.toml), a level set (.vdb) or a scan (any other name, as `import` takes it)
/// holds.
/// @param overrides  "section.key=value" each, for scenes
/// @throws InputError, FileError
MeasuredSample load_measured_sample(const std::string& input, const ImageOptions& options,
                                    std::span<const std::string> overrides, ImageProgress& progress);

/// What theory can say of the structure: a cut of an isotropic, stationary random field with the gamma law;
/// else nothing.
std::optional<FieldTheory> theory_of(const Microstructure& structure);

}  // namespace anticrack
