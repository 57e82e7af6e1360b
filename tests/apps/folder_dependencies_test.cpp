#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <map>
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

}  // namespace
}  // namespace anticrack
