#include "scene_units.h"

#include <fmt/format.h>

#include <array>
#include <charconv>
#include <span>

namespace anticrack {

namespace {

struct Unit {
  std::string_view name;
  int exponent;  ///< one unit = 10^exponent SI units
};

constexpr Unit length_units[] = {{"m", 0}, {"cm", -2}, {"mm", -3}, {"um", -6}, {"µm", -6}, {"nm", -9}};
constexpr Unit time_units[] = {{"s", 0}, {"ms", -3}, {"us", -6}, {"µs", -6}, {"ns", -9}};
constexpr Unit speed_units[] = {{"m/s", 0},   {"km/s", 3},  {"cm/s", -2},
                                {"mm/s", -3}, {"um/s", -6}, {"µm/s", -6}};
constexpr Unit rate_units[] = {{"1/s", 0}, {"/s", 0}, {"s^-1", 0}, {"1/ms", 3}, {"%/s", -2}};
constexpr Unit density_units[] = {{"kg/m^3", 0}, {"kg/m3", 0}, {"g/cm^3", 3}, {"g/cm3", 3}, {"t/m^3", 3}};
constexpr Unit stress_units[] = {{"Pa", 0}, {"kPa", 3}, {"MPa", 6}, {"GPa", 9}};
constexpr Unit plain_units[] = {{"%", -2}};

std::span<const Unit> units_of(Dimension dimension) {
  switch (dimension) {
    case Dimension::length:
      return length_units;
    case Dimension::time:
      return time_units;
    case Dimension::speed:
      return speed_units;
    case Dimension::rate:
      return rate_units;
    case Dimension::density:
      return density_units;
    case Dimension::stress:
      return stress_units;
    case Dimension::none:
      break;
  }
  return plain_units;
}

std::string_view name_of(Dimension dimension) {
  switch (dimension) {
    case Dimension::length:
      return "length";
    case Dimension::time:
      return "time";
    case Dimension::speed:
      return "speed";
    case Dimension::rate:
      return "rate";
    case Dimension::density:
      return "density";
    case Dimension::stress:
      return "stress";
    case Dimension::none:
      break;
  }
  return "a plain number";
}

std::string_view trimmed(std::string_view text) {
  while (!text.empty() && text.front() == ' ') text.remove_prefix(1);
  while (!text.empty() && text.back() == ' ') text.remove_suffix(1);
  return text;
}

/// Length of the decimal number that `text` begins with, 0 if there is none. "5e-3 m": 4; "5 elephants": 1.
std::size_t number_length(std::string_view text) {
  auto digits = [&](std::size_t i) {
    while (i < text.size() && text[i] >= '0' && text[i] <= '9') ++i;
    return i;
  };
  const std::size_t start = !text.empty() && (text[0] == '-' || text[0] == '+') ? 1 : 0;
  std::size_t end = digits(start);
  std::size_t digit_count = end - start;
  if (end < text.size() && text[end] == '.') {
    const std::size_t after = digits(end + 1);
    digit_count += after - (end + 1);
    end = after;
  }
  if (digit_count == 0) return 0;
  if (end < text.size() && (text[end] == 'e' || text[end] == 'E')) {
    std::size_t exponent = end + 1;
    if (exponent < text.size() && (text[exponent] == '-' || text[exponent] == '+')) ++exponent;
    if (digits(exponent) > exponent) end = digits(exponent);
  }
  return end;
}

}  // namespace

std::string_view si_unit(Dimension dimension) {
  return dimension == Dimension::none ? std::string_view() : units_of(dimension).front().name;
}

std::string allowed_units(Dimension dimension) {
  std::string text;
  for (const Unit& unit : units_of(dimension))
    text += fmt::format("{}{}", text.empty() ? "" : ", ", unit.name);
  return text;
}

ParsedQuantity parse_quantity(std::string_view text, Dimension dimension) {
  text = trimmed(text);
  const std::size_t length = number_length(text);
  if (length == 0) {
    return {{},
            fmt::format("that does not begin with a finite decimal number (units of {}: {})",
                        name_of(dimension), allowed_units(dimension))};
  }
  std::string_view number = text.substr(0, length);
  const std::string_view unit_name = trimmed(text.substr(length));

  int unit_exponent = 0;
  if (!unit_name.empty()) {
    const Unit* found = nullptr;
    for (const Unit& unit : units_of(dimension)) {
      if (unit.name == unit_name) found = &unit;
    }
    if (!found) {
      return {{},
              fmt::format("\"{}\" is no unit of {}; allowed units: {}", unit_name, name_of(dimension),
                          allowed_units(dimension))};
    }
    unit_exponent = found->exponent;
  }

  // The unit goes into the decimal exponent, so that the number is rounded once.
  if (number.front() == '+') number.remove_prefix(1);
  const std::size_t e = number.find_first_of("eE");
  long long exponent = unit_exponent;
  if (e != std::string_view::npos) {
    std::string_view written = number.substr(e + 1);
    if (written.front() == '+') written.remove_prefix(1);
    long long value = 0;
    const auto read = std::from_chars(written.data(), written.data() + written.size(), value);
    exponent += read.ec == std::errc() && value < 100000 && value > -100000 ? value
                : written.front() == '-'                                    ? -100000
                                                                            : 100000;
  }
  const std::string decimal = fmt::format("{}e{}", number.substr(0, e), exponent);
  double value = 0;
  const auto read = std::from_chars(decimal.data(), decimal.data() + decimal.size(), value);
  if (read.ec != std::errc()) {
    return {{}, "that is outside the range of a double precision number, 2.3e-308 to 1.7e308"};
  }
  return {value, {}};
}

}  // namespace anticrack
