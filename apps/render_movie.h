#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace anticrack {

/// The ffmpeg command that turns `folder`/frame_0000.png, ... into an H.264 movie that every player shows.
std::vector<std::string> ffmpeg_command(const std::filesystem::path& folder,
                                        const std::filesystem::path& movie, double frames_per_second);

/// The command as one would type it.
std::string shell_line(const std::vector<std::string>& command);

/// Runs ffmpeg into a temporary file and renames it. @return false if ffmpeg is not installed
/// @throws FileError  if it fails
bool encode_movie(const std::filesystem::path& folder, const std::filesystem::path& movie,
                  double frames_per_second);

}  // namespace anticrack
