#pragma once

#include <filesystem>
#include <span>

#include "precision_report.h"

namespace anticrack {

/// For each problem and measure PROBLEM_MEASURE_time.png (and _steps.png), error against seconds (and
/// particle-steps) with the Pareto front, the dominated points and the failures, and
/// PROBLEM_MEASURE_order.png, error against cells with the slope that was observed. @throws FileError
void draw_precision_diagrams(std::span<const PrecisionResult> results, const std::filesystem::path& folder);

}  // namespace anticrack
