#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace anticrack {

/// Content of provenance.json: what ran where. Program version and commit, compiler, flags, build type, CPU,
/// SIMD target, threads, and the time of the call (UTC) as the start. The name of the machine is left out.
/// @param simd_target  name of the vector instruction set in use, e.g. "AVX3"
std::string provenance_text(std::string_view simd_target, int threads);

/// Writes it to a file. @throws FileError
void write_provenance(const std::filesystem::path& file, std::string_view simd_target, int threads);

/// Version of the program, "major.minor.patch".
std::string_view program_version();

/// Commit that the build was configured at, or "unknown".
std::string_view program_commit();

}  // namespace anticrack
