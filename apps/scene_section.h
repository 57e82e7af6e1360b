#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "errors.h"
#include "scene_units.h"

namespace anticrack {

/// A scene is refused. The message names file and line (or the --set), key, value and what is allowed.
struct SceneError : InputError {
  using InputError::InputError;
};

/// One value of a scene with the place it came from.
struct SceneValue {
  std::variant<bool, std::int64_t, double, std::string, std::vector<SceneValue>> data;
  std::string place;    ///< "compaction.toml:12" or "--set material.density=0"
  std::string written;  ///< as it was written, for messages
};

/// What a number must be: low < symbol <= high, each end in or out.
struct Allowed {
  std::string_view symbol;
  Dimension dimension = Dimension::none;
  std::optional<double> low = {}, high = {};
  bool low_included = false, high_included = false;
  std::string_view advice = {};  ///< a sentence for those who are outside, may be empty

  bool holds(double value) const;
  /// "expected -1 < nu < 0.5. Use 0.49 for ..."
  std::string text() const;
};

/// One table of a scene, read key by key. Every function throws SceneError on a missing key (where there is
/// no fallback), a wrong type, a unit of another dimension, or a value outside what is allowed.
class SceneSection {
 public:
  SceneSection(std::string name, std::string place) : name_(std::move(name)), place_(std::move(place)) {}

  bool has(const std::string& key) const { return values_.contains(key); }
  double number(const std::string& key, const Allowed& allowed) const;
  double number(const std::string& key, const Allowed& allowed, double fallback) const;
  std::int64_t integer(const std::string& key, std::int64_t low, std::int64_t high) const;
  std::int64_t integer(const std::string& key, std::int64_t low, std::int64_t high,
                       std::int64_t fallback) const;
  std::array<double, 3> triple(const std::string& key, const Allowed& allowed) const;
  std::vector<std::int64_t> integers(const std::string& key, std::int64_t low, std::int64_t high) const;
  std::string text(const std::string& key, std::string_view expected) const;
  bool flag(const std::string& key, bool fallback) const;

  /// The position in `choices` of the key's text.
  std::size_t choice(const std::string& key, std::span<const std::string_view> choices) const;
  std::size_t choice(const std::string& key, std::span<const std::string_view> choices,
                     std::size_t fallback) const;

  /// "place: section.key = value; " + rest, where the place is the key's own.
  [[noreturn]] void refuse(const std::string& key, const std::string& rest) const;
  /// "place: [section] " + rest, where the place is the section's.
  [[noreturn]] void refuse(const std::string& rest) const;

  const std::string& name() const { return name_; }
  std::map<std::string, SceneValue>& values() { return values_; }
  const std::map<std::string, SceneValue>& values() const { return values_; }

 private:
  const SceneValue& required(const std::string& key, std::string_view expected) const;
  double number_of(const SceneValue& value, const std::string& key, const Allowed& allowed) const;
  std::int64_t integer_of(const SceneValue& value, const std::string& key, std::int64_t low,
                          std::int64_t high) const;
  [[noreturn]] void refuse_value(const SceneValue& value, const std::string& key,
                                 const std::string& rest) const;

  std::string name_, place_;
  std::map<std::string, SceneValue> values_;
};

}  // namespace anticrack
