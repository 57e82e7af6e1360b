#pragma once

#include <filesystem>

#include "progress.h"

namespace anticrack {

/// How fast may one load? Small porous samples are loaded to failure from the paper's strain rate of 5e-4 1/s
/// upward, each time twice as fast, until moduli and failure are wrong by tens of percent.
///
/// Writes loading.csv and loading.json (a row a case, and the errors by passages of the elastic wave before
/// failure), and diagrams where the build can draw, into `folder`, and prints the table. Cases done before
/// (`folder`/loading/CASE.json) are not run again. One thread, so that run times compare.
/// @throws InputError  another program writes there. @throws FileError
void study_loading(const std::filesystem::path& folder, const ProgressOptions& progress);

}  // namespace anticrack
