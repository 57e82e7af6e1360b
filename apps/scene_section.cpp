#include "scene_section.h"

#include <fmt/format.h>

#include <cmath>

namespace anticrack {

namespace {

std::string sentence(std::string text) {
  if (!text.ends_with('.') && !text.ends_with('?')) text += '.';
  return text;
}

std::string quoted_list(std::span<const std::string_view> choices) {
  std::string text;
  for (std::size_t i = 0; i < choices.size(); ++i) {
    text += fmt::format("{}\"{}\"", i == 0 ? "" : i + 1 == choices.size() ? " or " : ", ", choices[i]);
  }
  return text;
}

std::string integer_range(std::int64_t low, std::int64_t high) {
  return fmt::format("expected a whole number from {} to {}", low, high);
}

/// The integer that a value holds; 1e4 counts as one.
std::optional<std::int64_t> as_integer(const SceneValue& value) {
  if (const auto* integer = std::get_if<std::int64_t>(&value.data)) return *integer;
  if (const auto* real = std::get_if<double>(&value.data)) {
    if (std::abs(*real) < 9007199254740992.0 && std::nearbyint(*real) == *real) return std::int64_t(*real);
  }
  return {};
}

}  // namespace

bool Allowed::holds(double value) const {
  if (!std::isfinite(value)) return false;
  if (low && !(low_included ? value >= *low : value > *low)) return false;
  return !high || (high_included ? value <= *high : value < *high);
}

std::string Allowed::text() const {
  std::string range(symbol);
  if (low && high) {
    range = fmt::format("{} {} {} {} {}", *low, low_included ? "<=" : "<", symbol, high_included ? "<=" : "<",
                        *high);
  } else if (low) {
    range = fmt::format("{} {} {}", symbol, low_included ? ">=" : ">", *low);
  } else if (high) {
    range = fmt::format("{} {} {}", symbol, high_included ? "<=" : "<", *high);
  }
  std::string text = fmt::format("expected {}{}", low || high ? "" : "a finite ", range);
  if (!si_unit(dimension).empty()) text += fmt::format(" [{}]", si_unit(dimension));
  if (!advice.empty()) text += fmt::format(". {}", advice);
  return text;
}

double SceneSection::number(const std::string& key, const Allowed& allowed) const {
  return number_of(required(key, allowed.text()), key, allowed);
}

double SceneSection::number(const std::string& key, const Allowed& allowed, double fallback) const {
  return has(key) ? number(key, allowed) : fallback;
}

std::int64_t SceneSection::integer(const std::string& key, std::int64_t low, std::int64_t high) const {
  return integer_of(required(key, integer_range(low, high)), key, low, high);
}

std::int64_t SceneSection::integer(const std::string& key, std::int64_t low, std::int64_t high,
                                   std::int64_t fallback) const {
  return has(key) ? integer(key, low, high) : fallback;
}

std::array<double, 3> SceneSection::triple(const std::string& key, const Allowed& allowed) const {
  const std::string expected = fmt::format("expected [x, y, z], three numbers; each: {}", allowed.text());
  const SceneValue& value = required(key, expected);
  const auto* items = std::get_if<std::vector<SceneValue>>(&value.data);
  if (!items || items->size() != 3) refuse_value(value, key, expected);
  std::array<double, 3> numbers;
  for (int a = 0; a < 3; ++a) numbers[a] = number_of((*items)[a], fmt::format("{}[{}]", key, a), allowed);
  return numbers;
}

std::vector<std::int64_t> SceneSection::integers(const std::string& key, std::int64_t low,
                                                 std::int64_t high) const {
  const std::string expected = fmt::format("expected a list; each: {}", integer_range(low, high));
  const SceneValue& value = required(key, expected);
  const auto* items = std::get_if<std::vector<SceneValue>>(&value.data);
  if (!items || items->empty()) refuse_value(value, key, expected);
  std::vector<std::int64_t> numbers;
  for (const SceneValue& item : *items) {
    numbers.push_back(integer_of(item, fmt::format("{}[{}]", key, numbers.size()), low, high));
  }
  return numbers;
}

std::string SceneSection::text(const std::string& key, std::string_view expected) const {
  const SceneValue& value = required(key, expected);
  const auto* text = std::get_if<std::string>(&value.data);
  if (!text || text->empty()) refuse_value(value, key, std::string(expected));
  return *text;
}

bool SceneSection::flag(const std::string& key, bool fallback) const {
  if (!has(key)) return fallback;
  const SceneValue& value = values_.at(key);
  const auto* flag = std::get_if<bool>(&value.data);
  if (!flag) refuse_value(value, key, "expected true or false");
  return *flag;
}

std::size_t SceneSection::choice(const std::string& key, std::span<const std::string_view> choices) const {
  const std::string expected = fmt::format("expected {}", quoted_list(choices));
  const std::string chosen = text(key, expected);
  for (std::size_t i = 0; i < choices.size(); ++i) {
    if (choices[i] == chosen) return i;
  }
  refuse_value(values_.at(key), key, expected);
}

std::size_t SceneSection::choice(const std::string& key, std::span<const std::string_view> choices,
                                 std::size_t fallback) const {
  return has(key) ? choice(key, choices) : fallback;
}

void SceneSection::refuse(const std::string& key, const std::string& rest) const {
  refuse_value(values_.at(key), key, rest);
}

void SceneSection::refuse(const std::string& rest) const {
  throw SceneError(sentence(fmt::format("{}: [{}] {}", place_, name_, rest)));
}

const SceneValue& SceneSection::required(const std::string& key, std::string_view expected) const {
  const auto found = values_.find(key);
  if (found == values_.end()) refuse(fmt::format("has no key {}; {}", key, expected));
  return found->second;
}

double SceneSection::number_of(const SceneValue& value, const std::string& key,
                               const Allowed& allowed) const {
  double number = 0;
  if (const auto* real = std::get_if<double>(&value.data)) {
    number = *real;
  } else if (const auto* integer = std::get_if<std::int64_t>(&value.data)) {
    number = double(*integer);
  } else if (const auto* text = std::get_if<std::string>(&value.data)) {
    const ParsedQuantity parsed = parse_quantity(*text, allowed.dimension);
    if (!parsed.value) refuse_value(value, key, fmt::format("{}; {}", parsed.problem, allowed.text()));
    number = *parsed.value;
  } else {
    refuse_value(value, key, fmt::format("that is no number; {}", allowed.text()));
  }
  if (!allowed.holds(number)) refuse_value(value, key, allowed.text());
  return number;
}

std::int64_t SceneSection::integer_of(const SceneValue& value, const std::string& key, std::int64_t low,
                                      std::int64_t high) const {
  const std::optional<std::int64_t> integer = as_integer(value);
  if (!integer || *integer < low || *integer > high) refuse_value(value, key, integer_range(low, high));
  return *integer;
}

void SceneSection::refuse_value(const SceneValue& value, const std::string& key,
                                const std::string& rest) const {
  throw SceneError(sentence(fmt::format("{}: {}.{} = {}; {}", value.place, name_, key, value.written, rest)));
}

}  // namespace anticrack
