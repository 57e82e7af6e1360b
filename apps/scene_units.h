#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace anticrack {

/// What kind of quantity a scene key holds.
enum class Dimension { none, length, time, speed, rate, density, stress };

/// The SI unit as text, "" for Dimension::none.
std::string_view si_unit(Dimension dimension);

/// "Pa, kPa, MPa, GPa": every unit that a quantity of this dimension may carry.
std::string allowed_units(Dimension dimension);

/// Outcome of reading "10 GPa": the value in SI units, or why there is none.
struct ParsedQuantity {
  std::optional<double> value;
  std::string
      problem;  ///< empty if there is a value; else a phrase such as `"km" is not a unit of stress; ...`
};

/// Reads a decimal number, optionally followed by a unit of the dimension; a number alone is in SI units. The
/// result is the double nearest to the decimal number in SI units: "5.345 um" is 5.345e-6 to the last bit.
ParsedQuantity parse_quantity(std::string_view text, Dimension dimension);

}  // namespace anticrack
