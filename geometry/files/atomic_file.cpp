#include "files/atomic_file.h"

#include <fcntl.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <fstream>
#include <string>
#include <system_error>

namespace anticrack {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view cannot_write = "cannot be written", cannot_flush = "cannot be flushed to disk";

// Unique among processes and threads; the leading dot keeps it out of patterns such as frame_*.vdb.
fs::path temporary_beside(const fs::path& file) {
  static std::atomic<unsigned> count = 0;
  std::string name = file.filename().string();
  name.insert(name.begin(), '.');
  name += '.' + std::to_string(::getpid()) + '-' + std::to_string(count++) + ".tmp";
  return file.parent_path() / name;
}

// The errno of what failed, 0 if all went well.
int flush(const fs::path& path) {
  const int descriptor = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor < 0) return errno;
  const int error_number = ::fsync(descriptor) == 0 ? 0 : errno;
  ::close(descriptor);
  return error_number;
}

}  // namespace

void flush_to_disk(const fs::path& path) {
  if (const int failed = flush(path)) throw system_file_error(path, cannot_flush, failed);
}

FileError system_file_error(const fs::path& file, std::string_view what, int error_number) {
  std::string message = file.string() + ": " + std::string(what);
  if (error_number != 0) message += ": " + std::generic_category().message(error_number);
  return FileError(message);
}

void write_atomically(const fs::path& file, const std::function<void(const fs::path& temporary)>& write) {
  const fs::path temporary = temporary_beside(file);
  std::error_code ignored;
  try {
    errno = 0;
    write(temporary);
    if (const int failed = flush(temporary)) throw system_file_error(file, cannot_write, failed);
    if (::rename(temporary.c_str(), file.c_str()) != 0) throw system_file_error(file, cannot_write, errno);
  } catch (const std::ios_base::failure&) {
    const int error_number = errno;
    fs::remove(temporary, ignored);
    throw system_file_error(file, cannot_write, error_number);
  } catch (...) {
    fs::remove(temporary, ignored);
    throw;
  }
  // The rename itself lasts only once the folder is on disk; some file systems cannot flush a folder and say
  // EINVAL.
  const fs::path folder = file.has_parent_path() ? file.parent_path() : fs::path(".");
  const int failed = flush(folder);
  if (failed != 0 && failed != EINVAL) throw system_file_error(folder, cannot_flush, failed);
}

void write_text_atomically(const fs::path& file, std::string_view text) {
  write_atomically(file, [text](const fs::path& temporary) {
    std::ofstream stream;
    stream.exceptions(std::ios::badbit | std::ios::failbit);
    stream.open(temporary, std::ios::binary);
    stream.write(text.data(), std::streamsize(text.size()));
    stream.close();
  });
}

}  // namespace anticrack
