#pragma once

#include <array>
#include <string_view>

namespace anticrack {

/// What part of space is solid, given independent Gaussian random fields G, G_1, G_2 of one law and variance
/// 1/2.
enum class Morphology {
  single_cut,  ///< G > t
  two_cut,     ///< |G| < t: sheets (Berk 1987)
  open_cell,  ///< |G_1| < t and |G_2| < t: struts along the curves where two sheets cross (Roberts & Garboczi
              ///< 2002)
  closed_cell,  ///< |G_1| < t or |G_2| < t: walls that cross
};

inline constexpr std::array<std::string_view, 4> morphology_names = {"single_cut", "two_cut", "open_cell",
                                                                     "closed_cell"};

constexpr int field_count(Morphology morphology) {
  return morphology == Morphology::open_cell || morphology == Morphology::closed_cell ? 2 : 1;
}

/// Fraction of space in one field's cut where the whole has the solid fraction phi: phi for one field,
/// sqrt(phi) for the open cell, 1 - sqrt(1 - phi) for the closed cell.
double fraction_of_one_cut(Morphology morphology, double solid_fraction);

/// t at which a morphology has the solid fraction phi on average. Single cut: erf(t) = 1 - 2 phi (Eq. 4). The
/// others: erf(t) is the fraction of one cut.
double theoretical_threshold(Morphology morphology, double solid_fraction);

}  // namespace anticrack
