#pragma once

#include <array>
#include <optional>
#include <string_view>

namespace anticrack {

/// Unit of the world space of an OpenVDB file; `name` is what the file's metadata `length_unit` says.
struct LengthUnit {
  std::string_view name;
  double metres;
};

inline constexpr std::array<LengthUnit, 5> length_units = {
    {{"m", 1.0}, {"mm", 1e-3}, {"um", 1e-6}, {"nm", 1e-9}, {"pm", 1e-12}}};

/// The largest unit in which a voxel edge [m] is at least 1e-4: OpenVDB takes the volume of a voxel below
/// 1.4e-5 units for zero and refuses it.
constexpr LengthUnit length_unit_for(double spacing) {
  for (const LengthUnit& unit : length_units)
    if (spacing >= 1e-4 * unit.metres) return unit;
  return length_units.back();
}

constexpr std::optional<LengthUnit> find_length_unit(std::string_view name) {
  for (const LengthUnit& unit : length_units)
    if (unit.name == name) return unit;
  return std::nullopt;
}

}  // namespace anticrack
