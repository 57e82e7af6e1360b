#pragma once

#include <filesystem>

namespace anticrack {

enum class ExistingFolder {
  refuse,   ///< a folder that holds anything is not written to
  replace,  ///< --force: an earlier run's files in it are removed, nothing else
  resume,   ///< --resume: the run in it goes on
};

/// Whether a run may write to the folder; changes nothing on disk.
/// @throws InputError  the folder holds something (unless `existing` allows it), holds no run to resume, is a
/// file, or could
///   not be created or written, with the system's reason
void check_output_folder(const std::filesystem::path& folder, ExistingFolder existing);

/// Checks as above, then creates the folder; with `replace` removes what a run writes (scene.toml,
/// history.csv, frames/,
/// ...) and leaves every other file.
/// @throws InputError  as above. @throws FileError  a file could not be removed or the folder not created
void prepare_output_folder(const std::filesystem::path& folder, ExistingFolder existing);

/// Whether a single output file may be written: its folder exists or can be made, and it is not there yet or
/// `force` is set.
/// @throws InputError
void check_output_file(const std::filesystem::path& file, bool force);

}  // namespace anticrack
