#pragma once

#include <filesystem>
#include <functional>
#include <string_view>

namespace anticrack {

/// Lets `write` fill a temporary file beside `file`, flushes it to disk and renames it into place, so that a crash at any
/// instant leaves either the old file or the new one. Removes the temporary on failure.
/// @throws FileError  naming the file and the system's reason
void write_atomically(const std::filesystem::path& file, const std::function<void(const std::filesystem::path& temporary)>& write);

/// The same for a text. @throws FileError
void write_text_atomically(const std::filesystem::path& file, std::string_view text);

}  // namespace anticrack
