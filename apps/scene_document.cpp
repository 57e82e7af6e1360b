#include "scene_document.h"

#include <fmt/format.h>
#include <toml++/toml.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iterator>
#include <regex>

#include "nearest_name.h"

namespace anticrack {

namespace {

std::string read_text(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  if (!stream && errno == ENOENT) {
    throw SceneError(fmt::format("{}: there is no such scene file.", file.string()));
  }
  if (!stream)
    throw FileError(fmt::format("{}: cannot read the scene: {}.", file.string(), std::strerror(errno)));
  std::error_code error;
  if (std::filesystem::is_directory(file, error))  // it can be opened, but a stream throws when it reads
    throw FileError(
        fmt::format("{}: cannot read the scene: it is a folder; expected a TOML file.", file.string()));
  std::string text{std::istreambuf_iterator<char>(stream), {}};
  if (stream.bad()) throw FileError(fmt::format("{}: cannot read the scene.", file.string()));
  return text;
}

/// The letters of a decimal number at the start of `text`; none if there is none. `whole`: without point and
/// exponent.
std::string_view leading_number(std::string_view text, bool& whole) {
  std::size_t at = 0;
  const auto is_digit = [&] { return at < text.size() && text[at] >= '0' && text[at] <= '9'; };
  const auto skip_digits = [&] {
    if (!is_digit()) return false;
    while (is_digit() || (at < text.size() && text[at] == '_')) ++at;
    return true;
  };
  const auto skip_one_of = [&](std::string_view letters) {
    const bool found = at < text.size() && letters.find(text[at]) != std::string_view::npos;
    at += found;
    return found;
  };
  skip_one_of("-+");
  if (!skip_digits()) return {};
  whole = true;
  if (skip_one_of(".")) {
    if (!skip_digits()) return {};
    whole = false;
  }
  if (skip_one_of("eE")) {
    skip_one_of("-+");
    if (!skip_digits()) return {};
    whole = false;
  }
  return text.substr(0, at);
}

/// A number that a double cannot hold is a syntax error to toml++. It becomes inf here, so that the key's own
/// check refuses it and names key and range. Returns what was written, "" if the line holds no such number.
std::string replace_overflow(std::string& text, std::size_t line_number) {
  std::size_t begin = 0;
  for (std::size_t line = 1; line < line_number && begin != std::string::npos; ++line) {
    begin = text.find('\n', begin);
    if (begin != std::string::npos) ++begin;
  }
  if (begin == std::string::npos) return {};
  const std::string line = text.substr(begin, std::min(text.find('\n', begin), text.size()) - begin);
  constexpr std::string_view blanks = " \t";
  for (std::size_t at = 0; (at = line.find_first_of("=[,", at)) != std::string::npos;) {
    at = std::min(line.find_first_not_of(blanks, at + 1), line.size());
    bool whole = false;
    const std::string number(leading_number(std::string_view(line).substr(at), whole));
    const std::size_t next = std::min(line.find_first_not_of(blanks, at + number.size()), line.size());
    const bool ends =
        next == line.size() || std::string_view("],#\r").find(line[next]) != std::string_view::npos;
    if (number.empty() || !ends) continue;
    std::string digits = number;
    std::erase(digits, '_');
    const bool too_long = whole && digits.size() > 19;
    if (!too_long && std::isfinite(std::strtod(digits.c_str(), nullptr))) continue;
    text.replace(begin + at, number.size(), digits.front() == '-' ? "-inf" : "inf");
    return number;
  }
  return {};
}

using OverflowsByLine = std::map<std::size_t, std::string>;

std::string written_form(const SceneValue& value) {
  if (const auto* flag = std::get_if<bool>(&value.data)) return *flag ? "true" : "false";
  if (const auto* integer = std::get_if<std::int64_t>(&value.data)) return fmt::format("{}", *integer);
  if (const auto* real = std::get_if<double>(&value.data)) return fmt::format("{}", *real);
  if (const auto* text = std::get_if<std::string>(&value.data)) return fmt::format("\"{}\"", *text);
  std::string list;
  for (const SceneValue& item : std::get<std::vector<SceneValue>>(value.data)) {
    list += fmt::format("{}{}", list.empty() ? "" : ", ", item.written);
  }
  return fmt::format("[{}]", list);
}

/// @param name  "section.key", for messages
SceneValue convert(const toml::node& node, const std::string& place, const std::string& name,
                   const OverflowsByLine& overflows) {
  SceneValue value;
  value.place = place;
  if (const auto* flag = node.as_boolean()) {
    value.data = flag->get();
  } else if (const auto* integer = node.as_integer()) {
    value.data = integer->get();
  } else if (const auto* real = node.as_floating_point()) {
    value.data = real->get();
  } else if (const auto* text = node.as_string()) {
    value.data = text->get();
  } else if (const auto* array = node.as_array()) {
    std::vector<SceneValue> items;
    for (const toml::node& item : *array) items.push_back(convert(item, place, name, overflows));
    value.data = std::move(items);
  } else {
    throw SceneError(
        fmt::format("{}: {}: expected a number, a text, true or false, or a list of these.", place, name));
  }
  value.written = written_form(value);
  const auto overflow = overflows.find(node.source().begin.line);
  if (overflow != overflows.end() && node.is_floating_point() &&
      std::isinf(node.as_floating_point()->get())) {
    value.written = overflow->second;
  }
  return value;
}

toml::table parse(std::string text, const std::string& file_name, OverflowsByLine& overflows) {
  for (;;) {
    try {
      return toml::parse(text);
    } catch (const toml::parse_error& error) {
      const std::size_t line = error.source().begin.line;
      const std::string written = replace_overflow(text, line);
      if (written.empty()) throw SceneError(fmt::format("{}:{}: {}.", file_name, line, error.description()));
      overflows[line] = written;
    }
  }
}

/// The value of an override: TOML where it is, else the bare text.
SceneValue parse_override(const std::string& text, const std::string& place, const std::string& name) {
  try {
    const toml::table table = toml::parse("value = " + text);
    if (table.size() == 1 && !table.begin()->second.is_table())
      return convert(table.begin()->second, place, name, {});
  } catch (const toml::parse_error&) {
  }
  return {text, place, text};
}

bool is_override(const SceneValue& value) {
  return value.place.starts_with("--set");
}

bool contains_word(std::string_view words, std::string_view word) {
  while (!words.empty()) {
    const std::size_t space = std::min(words.find(' '), words.size());
    if (words.substr(0, space) == word) return true;
    words.remove_prefix(std::min(space + 1, words.size()));
  }
  return false;
}

}  // namespace

SceneDocument::SceneDocument(const std::filesystem::path& file, std::span<const std::string> overrides,
                             const SceneSchema& schema)
    : file_name_(file.string()), schema_(schema) {
  OverflowsByLine overflows;
  const toml::table table = parse(read_text(file), file_name_, overflows);
  for (const auto& [name, node] : table) {
    const std::string place = fmt::format("{}:{}", file_name_, name.source().begin.line);
    const toml::table* keys = node.as_table();
    if (!keys)
      throw SceneError(fmt::format("{}: key {} stands outside a section; expected [section] above it.", place,
                                   name.str()));
    SceneSection section{std::string(name.str()), place};
    for (const auto& [key, value] : *keys) {
      const std::string key_place = fmt::format("{}:{}", file_name_, key.source().begin.line);
      section.values().emplace(
          key.str(), convert(value, key_place, fmt::format("{}.{}", name.str(), key.str()), overflows));
    }
    sections_.emplace(name.str(), std::move(section));
  }

  for (const std::string& text : overrides) apply_override(text);
  refuse_unknown_names();
  refuse_exclusive_keys();

  for (const SceneKey& key : schema_.keys) {
    const std::string name(key.section);
    if (!has(name)) absent_.emplace(name, SceneSection(name, file_name_));
  }
}

void SceneDocument::apply_override(const std::string& text) {
  const std::string place = "--set " + text;
  const std::size_t equals = text.find('=');
  const std::size_t dot = text.find('.');
  if (equals == std::string::npos || dot == std::string::npos || dot > equals || dot == 0 ||
      dot + 1 == equals) {
    throw SceneError(
        fmt::format("{}: expected --set section.key=value, such as --set loading.speed=2.", place));
  }
  const std::string section_name = text.substr(0, dot);
  const std::string key = text.substr(dot + 1, equals - dot - 1);
  auto& values = sections_.try_emplace(section_name, section_name, place).first->second.values();

  const auto erase_from_file = [&](std::string_view excluded) {
    const auto found = values.find(std::string(excluded));
    if (found != values.end() && !is_override(found->second)) values.erase(found);
  };
  for (const auto& [section, one, other] : schema_.exclusive) {
    if (section != section_name) continue;
    if (key == one) erase_from_file(other);
    if (key == other) erase_from_file(one);
  }
  const SceneValue value = parse_override(text.substr(equals + 1), place, text.substr(0, equals));
  if (key == selector_of(section_name)) {
    const auto* choice = std::get_if<std::string>(&value.data);
    std::erase_if(values, [&](const auto& item) {
      const SceneKey* known = find_key(section_name, item.first);
      return choice && known && !known->owners.empty() && !contains_word(known->owners, *choice) &&
             !is_override(item.second);
    });
  }
  values.insert_or_assign(key, value);
}

void SceneDocument::refuse_unknown_names() const {
  std::vector<std::string> section_names;
  for (const SceneKey& key : schema_.keys) {
    if (std::find(section_names.begin(), section_names.end(), key.section) == section_names.end()) {
      section_names.emplace_back(key.section);
    }
  }
  for (const auto& [name, section] : sections_) {
    if (std::find(section_names.begin(), section_names.end(), name) == section_names.end()) {
      const std::string near = nearest_name(name, section_names);
      section.refuse(near.empty()
                         ? fmt::format("is no section; expected one of: {}", fmt::join(section_names, ", "))
                         : fmt::format("is no section; did you mean [{}]?", near));
    }
    std::vector<std::string> key_names;
    for (const SceneKey& key : schema_.keys) {
      if (key.section == name) key_names.emplace_back(key.name);
    }
    for (const auto& [key, value] : section.values()) {
      if (find_key(name, key)) continue;
      const std::string near = nearest_name(key, key_names);
      section.refuse(key, near.empty()
                              ? fmt::format("unknown key; keys of [{}]: {}", name, fmt::join(key_names, ", "))
                              : fmt::format("unknown key; did you mean {}?", near));
    }
  }
}

void SceneDocument::refuse_exclusive_keys() const {
  for (const auto& [section_name, one, other] : schema_.exclusive) {
    const auto found = sections_.find(std::string(section_name));
    if (found == sections_.end()) continue;
    const SceneSection& section = found->second;
    if (section.has(std::string(one)) && section.has(std::string(other))) {
      section.refuse(std::string(other),
                     fmt::format("{}.{} is given as well; expected one of the two", section_name, one));
    }
  }
}

const SceneSection& SceneDocument::section(const std::string& name, bool required) const {
  const auto found = sections_.find(name);
  if (found != sections_.end()) return found->second;
  if (required) throw SceneError(fmt::format("{}: section [{}] is missing.", file_name_, name));
  return absent_.at(name);
}

void SceneDocument::refuse_foreign_keys(const std::string& name, std::string_view choice) const {
  const auto found = sections_.find(name);
  if (found == sections_.end()) return;
  for (const auto& [key, value] : found->second.values()) {
    const SceneKey& known = *find_key(name, key);
    if (known.owners.empty() || contains_word(known.owners, choice)) continue;
    const std::string owners = std::regex_replace(std::string(known.owners), std::regex(" "), "\" or \"");
    const std::string_view selector = selector_of(name);
    found->second.refuse(key, fmt::format("that key belongs to {} = \"{}\", but {} = \"{}\" here", selector,
                                          owners, selector, choice));
  }
}

const SceneKey* SceneDocument::find_key(std::string_view section, std::string_view key) const {
  for (const SceneKey& known : schema_.keys) {
    if (known.section == section && known.name == key) return &known;
  }
  return nullptr;
}

std::string_view SceneDocument::selector_of(std::string_view section) const {
  for (const auto& [name, key] : schema_.selectors) {
    if (name == section) return key;
  }
  return {};
}

}  // namespace anticrack
