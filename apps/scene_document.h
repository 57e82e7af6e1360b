#pragma once

#include <array>
#include <filesystem>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <utility>

#include "scene_section.h"

namespace anticrack {

/// A key that scenes know. `owners` are the choices (separated by spaces) of the section's selector that use
/// the key; empty if all do.
struct SceneKey {
  std::string_view section, name, owners;
};

/// What the reader must know of scenes beyond values.
struct SceneSchema {
  std::span<const SceneKey> keys;
  /// Section and key whose choice decides which other keys of the section belong, such as {"loading",
  /// "kind"}.
  std::span<const std::pair<std::string_view, std::string_view>> selectors;
  /// Keys of one section that exclude each other.
  std::span<const std::array<std::string_view, 3>> exclusive;
};

/// A scene file with its overrides, checked for syntax and unknown names only.
class SceneDocument {
 public:
  /// @param overrides  "section.key=value" each; the value is TOML, or a text without quotes. An override
  /// replaces the
  ///   key and whatever in the file excludes it: --set loading.until=failure lifts until_strain, and
  ///   --set material.model=hencky lifts the keys of the other models.
  /// @throws FileError   the file is there, but cannot be read
  /// @throws SceneError  syntax, duplicate or unknown keys, keys that exclude each other
  SceneDocument(const std::filesystem::path& file, std::span<const std::string> overrides,
                const SceneSchema& schema);

  bool has(const std::string& section) const { return sections_.contains(section); }
  /// The section; one without keys if the scene has none and `required` is false. @throws SceneError
  const SceneSection& section(const std::string& name, bool required) const;
  /// Refuses the keys of a section that its selector's choice does not use. @throws SceneError
  void refuse_foreign_keys(const std::string& section, std::string_view choice) const;

 private:
  void apply_override(const std::string& text);
  void refuse_unknown_names() const;
  void refuse_exclusive_keys() const;
  const SceneKey* find_key(std::string_view section, std::string_view key) const;
  std::string_view selector_of(std::string_view section) const;

  std::string file_name_;
  SceneSchema schema_;
  std::map<std::string, SceneSection> sections_;
  std::map<std::string, SceneSection> absent_;
};

}  // namespace anticrack
