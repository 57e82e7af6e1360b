#include "info.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdint>
#include <fstream>
#include <memory>
#include <nlohmann/json.hpp>

#include "scene.h"

namespace anticrack {

namespace fs = std::filesystem;

namespace {

std::string flat(const nlohmann::ordered_json& json, const std::string& prefix) {
  std::string text;
  for (const auto& [key, value] : json.items()) {
    text += value.is_object() ? flat(value, prefix + key + ".")
                              : fmt::format("  {}{} = {}\n", prefix, key, value.dump());
  }
  return text;
}

/// The first and last data row beside their column names: the history in two lines a column.
std::string describe_history(const fs::path& file) {
  std::ifstream stream(file);
  std::string header, row, last;
  std::int64_t rows = 0;
  std::getline(stream, header);
  while (std::getline(stream, row)) {
    last = row;
    ++rows;
  }
  std::string text = fmt::format("history.csv: {} rows; columns {}\n", rows, header);
  if (rows > 0) text += fmt::format("  last row: {}\n", last);
  return text;
}

std::int64_t count_files(const fs::path& folder, const std::string& extension) {
  std::error_code error;
  std::int64_t count = 0;
  for (const auto& entry : fs::directory_iterator(folder, error))
    count += entry.path().extension() == extension;
  return count;
}

std::string describe_json(const fs::path& file) {
  std::ifstream stream(file);
  try {
    return fmt::format("{}:\n{}", file.filename().string(), flat(nlohmann::ordered_json::parse(stream), ""));
  } catch (const nlohmann::json::exception& error) {
    throw FileError(fmt::format("{}: cannot read it as JSON: {}.", file.string(), error.what()));
  }
}

std::string describe_run(const fs::path& folder) {
  const bool finished = fs::exists(folder / "result.json");
  std::string text =
      fmt::format("{}: run folder, {}\n", folder.string(),
                  finished ? "finished" : "not finished (no result.json); go on with anticrack run --resume");
  text += fmt::format("frames: {} .vdb, {} .vtp\n", count_files(folder / "frames", ".vdb"),
                      count_files(folder / "frames", ".vtp"));
  text += fmt::format("checkpoints: {}\n", count_files(folder / "checkpoint", ".bin"));
  if (fs::exists(folder / "history.csv")) text += describe_history(folder / "history.csv");
  if (finished) text += describe_json(folder / "result.json");
  if (fs::exists(folder / "provenance.json")) text += describe_json(folder / "provenance.json");
  return text + "scene.toml:\n" + to_toml(read_scene(folder / "scene.toml"));
}

}  // namespace

std::string describe(const fs::path& path) {
  if (!fs::exists(path)) throw InputError(fmt::format("{}: there is no such file or folder.", path.string()));
  if (fs::is_directory(path)) {
    if (fs::exists(path / "scene.toml")) return describe_run(path);
    throw InputError(
        fmt::format("{}: the folder holds no run: there is no scene.toml in it.", path.string()));
  }
  if (path.extension() == ".vdb") return describe_vdb(path);
  if (path.extension() == ".toml") return to_toml(read_scene(path));
  if (path.extension() == ".json") return describe_json(path);
  throw InputError(fmt::format("{}: expected a .vdb file, a scene (.toml), a report (.json) or a run folder.",
                               path.string()));
}

CLI::App* add_info_command(CLI::App& app) {
  CLI::App* command = app.add_subcommand("info", "What is in a .vdb file, a scene or a run folder");
  auto path = std::make_shared<std::string>();
  command->add_option("path", *path, "File or folder")->required()->type_name("FILE_or_DIR");
  command->footer("Examples:\n  anticrack info sample.vdb\n  anticrack info out/quickstart/run");
  command->callback([path] { fmt::print("{}", describe(*path)); });
  return command;
}

}  // namespace anticrack
