#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace anticrack {

/// One number about a sample.
struct MeasuredValue {
  std::string name;  ///< key in the report
  std::optional<double>
      value;         ///< nothing where it does not exist: a path through a sample that does not percolate
  std::string unit;  ///< "-" for pure numbers
  std::string definition;             ///< with its source and, where there is one, its bias
  std::optional<double> theory = {};  ///< of an endless sample of the same random field
};

/// A function of one variable.
struct MeasuredCurve {
  std::string name;  ///< key in the report
  std::string x_name, x_unit, y_name, y_unit;
  std::string definition;
  std::vector<double> x, y;
  std::vector<double> theory = {};  ///< at the same x; may be empty
};

/// What is known of a sample's geometry.
struct Characterization {
  std::string input;
  std::vector<std::pair<std::string, std::uint64_t>> counts;  ///< exact
  std::vector<MeasuredValue> measures;
  std::vector<MeasuredCurve> curves;
  std::vector<std::pair<std::string, double>> seconds;  ///< of wall time, by group of measures

  const MeasuredValue* find(std::string_view name) const;
  const MeasuredCurve* find_curve(std::string_view name) const;
};

/// `counts`, `measures` (value, unit, definition, theory), `curves` (names, units, definition; the numbers
/// are in the CSV), `seconds`, and the version of the program.
std::string to_json(const Characterization& characterization);

/// All curves in one table: curve, x, x_unit, y, y_unit, theory; 17 digits.
std::string to_csv(const Characterization& characterization);

}  // namespace anticrack
