#pragma once

#include <string_view>

namespace anticrack {

std::string_view embedded_font();           ///< Inter Regular, OpenType
std::string_view embedded_strain_colors();  ///< assets/colormaps/strain.csv
std::string_view embedded_signed_colors();  ///< assets/colormaps/signed.csv

}  // namespace anticrack
