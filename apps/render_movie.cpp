#include "render_movie.h"

#include <fmt/format.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <string_view>

#include "errors.h"
#include "files/atomic_file.h"

extern char** environ;

namespace anticrack {

namespace {
namespace fs = std::filesystem;

bool is_on_path(std::string_view program, std::string_view path) {
  while (true) {
    const std::size_t end = std::min(path.find(':'), path.size());
    const fs::path file = fs::path(path.substr(0, end)) / program;
    if (access(file.c_str(), X_OK) == 0) return true;
    if (end == path.size()) return false;
    path.remove_prefix(end + 1);
  }
}

}  // namespace

std::vector<std::string> ffmpeg_command(const fs::path& folder, const fs::path& movie,
                                        double frames_per_second) {
  // The colour flags name what the pictures are converted to; without them players guess, and guess
  // differently.
  return {"ffmpeg",
          "-hide_banner",
          "-loglevel",
          "error",
          "-y",
          "-framerate",
          fmt::format("{}", frames_per_second),
          "-i",
          (folder / "frame_%04d.png").string(),
          "-vf",
          "scale=out_color_matrix=bt709:out_range=tv",
          "-c:v",
          "libx264",
          "-crf",
          "16",
          "-pix_fmt",
          "yuv420p",
          "-colorspace",
          "bt709",
          "-color_primaries",
          "bt709",
          "-color_trc",
          "bt709",
          "-color_range",
          "tv",
          "-movflags",
          "+faststart",
          "-f",
          "mp4",
          movie.string()};
}

std::string shell_line(const std::vector<std::string>& command) {
  std::string line;
  for (const std::string& word : command) {
    const bool plain = word.find_first_of(" '\"\\$&|;<>()*?[]#~%") == std::string::npos;
    if (!line.empty()) line += ' ';
    line += plain ? word : "'" + word + "'";
  }
  return line;
}

bool encode_movie(const fs::path& folder, const fs::path& movie, double frames_per_second) {
  const char* path = std::getenv("PATH");
  if (!is_on_path("ffmpeg", path == nullptr ? "" : path)) return false;
  write_atomically(movie, [&](const fs::path& temporary) {
    std::vector<std::string> command = ffmpeg_command(folder, temporary, frames_per_second);
    std::vector<char*> words;
    for (std::string& word : command) words.push_back(word.data());
    words.push_back(nullptr);
    pid_t child = 0;
    const int error = posix_spawnp(&child, "ffmpeg", nullptr, nullptr, words.data(), environ);
    int status = 0;
    if (error != 0 || waitpid(child, &status, 0) < 0 || !WIFEXITED(status) || WEXITSTATUS(status) != 0) {
      throw FileError(fmt::format("{}: ffmpeg failed{}. Its command: {}", movie.string(),
                                  error != 0 ? std::string(": ") + std::strerror(error) : "",
                                  shell_line(ffmpeg_command(folder, movie, frames_per_second))));
    }
  });
  return true;
}

}  // namespace anticrack
