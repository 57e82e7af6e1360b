#pragma once

#include <string>

#include "characterization.h"

namespace anticrack {

/// One page: the main numbers, and the curves, as PNG.
std::string draw_characterization(const Characterization& characterization);

}  // namespace anticrack
