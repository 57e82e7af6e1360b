#pragma once

#include <filesystem>
#include <functional>
#include <string_view>

#include "errors.h"

namespace anticrack {

/// Lets `write` fill a temporary file beside `file`, flushes it to disk and renames it into place, so that a
/// crash at any instant leaves either the old file or the new one. Removes the temporary on failure.
///
/// `write` may let std::ios_base::failure escape (a stream with exceptions on, closed before it returns).
/// @throws FileError  naming the file and the system's reason
void write_atomically(const std::filesystem::path& file,
                      const std::function<void(const std::filesystem::path& temporary)>& write);

/// The same for a text. @throws FileError
void write_text_atomically(const std::filesystem::path& file, std::string_view text);

/// Returns once what was written to a file or folder is on disk. @throws FileError
void flush_to_disk(const std::filesystem::path& path);

/// "FILE: WHAT: REASON", the reason in the system's words for `error_number` (an errno; 0: none known).
FileError system_file_error(const std::filesystem::path& file, std::string_view what, int error_number);

}  // namespace anticrack
