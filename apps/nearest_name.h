#pragma once

#include <span>
#include <string>
#include <string_view>

namespace anticrack {

/// The candidate with the smallest edit distance to `name` (a swap of neighbours counts one), or an empty
/// string when none is near enough to be a slip of the keyboard: more than a third of its letters differ.
std::string nearest_name(std::string_view name, std::span<const std::string> candidates);

}  // namespace anticrack
