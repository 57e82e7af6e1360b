#pragma once

#include <filesystem>

namespace anticrack {

enum class ExistingFolder {
  refuse,   ///< a folder that holds anything is not written to
  replace,  ///< --force: whatever is in it
  resume,   ///< --resume: the run in it goes on
};

/// Whether a run may write to the folder; changes nothing on disk. `resumed_from`: the file that it goes on
/// from.
/// @throws InputError  the folder holds something (unless `existing` allows it), holds no run to resume, is a
/// file, or could
///   not be created or written, with the system's reason
void check_output_folder(const std::filesystem::path& folder, ExistingFolder existing,
                         const char* resumed_from = "scene.toml");

/// Keeps other programs that ask for it out of a folder as long as it lives; a killed program leaves none.
class FolderLock {
 public:
  /// @throws InputError  another program has it. @throws FileError
  explicit FolderLock(const std::filesystem::path& folder);
  ~FolderLock();
  FolderLock(FolderLock&& other) noexcept;
  FolderLock& operator=(FolderLock&&) = delete;

 private:
  int descriptor_;
};

/// Checks as above, then creates and locks the folder. What is in it stays.
/// @throws InputError  as above, or another run is writing there. @throws FileError  it could not be created
[[nodiscard]] FolderLock prepare_output_folder(const std::filesystem::path& folder, ExistingFolder existing,
                                               const char* resumed_from = "scene.toml");

/// Removes what a run writes (scene.toml, history.csv, frames/, ...) and leaves every other file.
/// @throws FileError
void remove_run(const std::filesystem::path& folder);

/// Whether a single output file may be written: its folder exists or can be made, and it is not there yet or
/// `force` is set.
/// @throws InputError
void check_output_file(const std::filesystem::path& file, bool force);

}  // namespace anticrack
