#pragma once

#include <array>
#include <string_view>

#include "fields/morphology.h"

namespace anticrack::scene_names {

// The texts of a scene's choices, in the order of their enumerations, for reading and writing.
inline constexpr std::array<std::string_view, 4> source = {"gaussian_random_field", "vdb", "scan", "full"};
inline constexpr auto& morphology = morphology_names;
inline constexpr std::array<std::string_view, 2> threshold_rule = {"theory", "exact"};
inline constexpr std::array<std::string_view, 2> model = {"drucker_prager_softening", "hencky"};
inline constexpr std::array<std::string_view, 2> loading = {"triaxial", "confined_compression"};
inline constexpr std::array<std::string_view, 3> axis = {"x", "y", "z"};
inline constexpr std::array<std::string_view, 2> platen = {"top", "both"};
inline constexpr std::array<std::string_view, 4> walls = {"sticky", "slip", "affine", "paper"};
inline constexpr std::array<std::string_view, 2> time_step = {"safe", "paper"};
inline constexpr std::array<std::string_view, 2> transfer = {"pic_flip", "apic"};
inline constexpr std::array<std::string_view, 2> wall_rule = {"ghost", "paper"};
inline constexpr std::array<std::string_view, 2> return_mapping = {"implicit", "paper"};

}  // namespace anticrack::scene_names
