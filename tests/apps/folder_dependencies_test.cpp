#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <regex>
#include <set>
#include <string>

namespace anticrack {
namespace {

namespace fs = std::filesystem;

const fs::path source_root = fs::path(ANTICRACK_ASSETS).parent_path();
const std::map<std::string, std::set<std::string>> may_include = {
    {"geometry", {"geometry"}},
    {"engine", {"engine", "geometry"}},
    {"render", {"render", "geometry"}},
    {"apps", {"apps", "engine", "geometry", "render"}},
};

/// The folders of geometry/, of each other; what lies beside them may include all of them.
const std::map<std::string, std::set<std::string>> may_include_in_geometry = {
    {"files", {}},
    {"fields", {"files"}},
    {"level_sets", {"fields"}},
    {"measures", {"fields", "level_sets"}},
    {"images", {"fields", "files", "level_sets", "measures"}},
};

bool is_source(const fs::path& file) {
  return file.extension() == ".h" || file.extension() == ".cpp";
}

/// The folder that holds a header included as `name`, "" if none does.
std::string owner_of(const std::string& name) {
  for (const auto& [folder, allowed] : may_include) {
    if (fs::exists(source_root / folder / name)) return folder;
  }
  return {};
}

TEST(FolderDependencies, PointOneWay) {
  int includes = 0;
  for (const auto& [folder, allowed] : may_include) {
    for (const auto& entry : fs::recursive_directory_iterator(source_root / folder)) {
      if (!is_source(entry.path())) continue;
      std::ifstream stream(entry.path());
      for (std::string line; std::getline(stream, line);) {
        if (!line.starts_with("#include \"")) continue;
        const std::string name = line.substr(10, line.find('"', 10) - 10);
        if (folder == "apps" && name == "reference_step.h") continue;  // bench measures the tests' plain step
        const std::string owner = owner_of(name);
        EXPECT_TRUE(allowed.contains(owner))
            << entry.path() << " includes " << name << " of " << owner << "/";
        ++includes;
      }
    }
  }
  EXPECT_GT(includes, 100);
}

TEST(FolderDependencies, PointOneWayWithinGeometry) {
  int includes = 0;
  for (const auto& entry : fs::directory_iterator(source_root / "geometry")) {
    if (!entry.is_directory()) continue;
    const std::string folder = entry.path().filename();
    ASSERT_TRUE(may_include_in_geometry.contains(folder)) << folder;
    for (const auto& file : fs::directory_iterator(entry.path())) {
      if (!is_source(file.path())) continue;
      std::ifstream stream(file.path());
      for (std::string line; std::getline(stream, line);) {
        static const std::regex include(R"(#include "(\w+)/.*)");
        std::smatch match;
        if (!std::regex_match(line, match, include)) continue;
        const std::string of = match[1];
        EXPECT_TRUE(of == folder || may_include_in_geometry.at(folder).contains(of))
            << file.path() << " includes a header of " << of << "/";
        ++includes;
      }
    }
  }
  EXPECT_GT(includes, 50);
}

TEST(FolderDependencies, FileNamesAreUnique) {
  std::map<std::string, fs::path> seen;
  for (const auto& [folder, allowed] : may_include) {
    for (const auto& entry : fs::recursive_directory_iterator(source_root / folder)) {
      if (!is_source(entry.path())) continue;
      const auto [earlier, is_new] = seen.emplace(entry.path().filename(), entry.path());
      EXPECT_TRUE(is_new) << entry.path() << " and " << earlier->second;
    }
  }
}

// All are in one namespace: two definitions of a name would be mixed up by the linker without a word.
TEST(FolderDependencies, TypesAreDefinedInOneHeader) {
  std::map<std::string, fs::path> seen;
  for (const auto& [folder, allowed] : may_include) {
    for (const auto& entry : fs::recursive_directory_iterator(source_root / folder)) {
      if (entry.path().extension() != ".h") continue;
      std::ifstream stream(entry.path());
      for (std::string line; std::getline(stream, line);) {
        std::smatch match;
        static const std::regex definition(
            R"((?:enum )?(?:struct|class) (?:alignas\(\w+\) )?(\w+)[^:\w;](?:[^;]*\{|$).*)");
        if (!std::regex_match(line, match, definition)) continue;
        const std::string name = match[1];
        const auto [earlier, is_new] = seen.emplace(name, entry.path());
        EXPECT_TRUE(is_new) << name << " in " << entry.path() << " and " << earlier->second;
      }
    }
  }
  EXPECT_GT(seen.size(), 100u);
}

}  // namespace
}  // namespace anticrack
