#include "output_folder.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <regex>
#include <string>
#include <utility>
#include <vector>

#include "errors.h"

namespace anticrack {

namespace fs = std::filesystem;

namespace {

// What a run writes: the only names that --force removes.
constexpr const char* run_files[] = {"scene.toml", "provenance.json", "history.csv", "result.json",
                                     "grid.vdb"};
constexpr const char* run_folders[] = {"frames", "checkpoint"};

bool belongs_to_run(const fs::path& file) {
  static const std::regex name(R"(frame_\d+\.(vdb|vtp)|frames\.pvd|checkpoint_\d+\.bin|\..*\.tmp)");
  return std::regex_match(file.filename().string(), name);
}

/// The folder itself or its nearest ancestor that exists.
fs::path nearest_existing(fs::path folder) {
  std::error_code error;
  while (!folder.empty() && !fs::exists(fs::symlink_status(folder, error)) &&
         folder != folder.parent_path()) {
    folder = folder.parent_path();
  }
  return folder;
}

/// Refuses a folder in which nothing can be created.
void check_writable(const fs::path& output, const fs::path& folder) {
  const fs::path existing = nearest_existing(fs::absolute(folder).lexically_normal());
  std::error_code error;
  if (!fs::is_directory(existing, error)) {
    throw InputError(
        fmt::format("{}: cannot write there: {} is not a folder.", output.string(), existing.string()));
  }
  if (faccessat(AT_FDCWD, existing.c_str(), W_OK | X_OK, AT_EACCESS) != 0) {
    throw InputError(
        fmt::format("{}: cannot write to {}: {}.", output.string(), existing.string(), std::strerror(errno)));
  }
}

void remove_file(const fs::path& path) {
  std::error_code error;
  fs::remove(path, error);
  if (error) throw FileError(fmt::format("{}: cannot remove it: {}.", path.string(), error.message()));
}

}  // namespace

void remove_run(const fs::path& folder) {
  for (const char* name : run_files) remove_file(folder / name);
  for (const char* name : run_folders) {
    std::error_code error;
    std::vector<fs::path> files;
    for (const auto& entry : fs::directory_iterator(folder / name, error)) {
      if (entry.is_regular_file() && belongs_to_run(entry.path())) files.push_back(entry.path());
    }
    for (const fs::path& file : files) remove_file(file);
  }
}

void check_output_folder(const fs::path& folder, ExistingFolder existing, const char* resumed_from) {
  if (folder.empty()) throw InputError("-o: the output folder has no name.");
  check_writable(folder, folder);
  std::error_code error;
  const bool holds_something = fs::exists(folder, error) && !fs::is_empty(folder, error);
  if (error) throw InputError(fmt::format("{}: cannot look into it: {}.", folder.string(), error.message()));
  if (existing == ExistingFolder::refuse && holds_something) {
    throw InputError(fmt::format(
        "{}: the output folder exists and is not empty. Use --resume to go on with the run in it, "
        "--force to replace that run, or another -o.",
        folder.string()));
  }
  if (existing == ExistingFolder::resume && !fs::exists(folder / resumed_from, error)) {
    throw InputError(
        fmt::format("{}: no run to resume: there is no {} in it.", folder.string(), resumed_from));
  }
}

FolderLock::FolderLock(const fs::path& folder)
    : descriptor_(open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC)) {
  if (descriptor_ < 0)
    throw FileError(fmt::format("{}: cannot open the folder: {}.", folder.string(), std::strerror(errno)));
  if (flock(descriptor_, LOCK_EX | LOCK_NB) == 0 || errno != EWOULDBLOCK)
    return;  // not every file system can
  close(descriptor_);
  throw InputError(
      fmt::format("{}: another run is writing there. Wait for its end, or use another -o.", folder.string()));
}

FolderLock::~FolderLock() {
  if (descriptor_ >= 0) close(descriptor_);
}

FolderLock::FolderLock(FolderLock&& other) noexcept : descriptor_(std::exchange(other.descriptor_, -1)) {}

FolderLock prepare_output_folder(const fs::path& folder, ExistingFolder existing, const char* resumed_from) {
  check_output_folder(folder, existing, resumed_from);
  std::error_code error;
  fs::create_directories(folder, error);
  if (error)
    throw FileError(
        fmt::format("{}: cannot create the output folder: {}.", folder.string(), error.message()));
  return FolderLock(folder);
}

void check_output_file(const fs::path& file, bool force) {
  if (file.filename().empty())
    throw InputError(fmt::format("{}: expected the name of a file.", file.string()));
  check_writable(file, fs::absolute(file).parent_path());
  std::error_code error;
  if (fs::is_directory(file, error))
    throw InputError(fmt::format("{}: is a folder; expected a file.", file.string()));
  if (!force && fs::exists(file, error)) {
    throw InputError(
        fmt::format("{}: the file exists. Use --force to replace it, or another -o.", file.string()));
  }
}

}  // namespace anticrack
