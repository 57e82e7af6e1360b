#include "fields/morphology.h"

#include <cmath>

namespace anticrack {
namespace {

// The t in (low, high) at which the increasing `excess` changes its sign, to the last bit.
template <class Function>
double bisect(double low, double high, const Function& excess) {
  for (;;) {
    const double middle = 0.5 * (low + high);
    if (middle <= low || middle >= high) return middle;
    (excess(middle) < 0 ? low : high) = middle;
  }
}

}  // namespace

double fraction_of_one_cut(Morphology morphology, double solid_fraction) {
  if (morphology == Morphology::open_cell) return std::sqrt(solid_fraction);
  if (morphology == Morphology::closed_cell)
    return solid_fraction / (1 + std::sqrt(1 - solid_fraction));  // 1 - sqrt(1 - phi) without cancellation
  return solid_fraction;
}

double theoretical_threshold(Morphology morphology, double solid_fraction) {
  if (morphology == Morphology::single_cut)  // erfc keeps its digits for small phi
    return bisect(-7.0, 30.0, [&](double t) { return 2.0 * solid_fraction - std::erfc(t); });
  const double cut = fraction_of_one_cut(morphology, solid_fraction);
  return bisect(0.0, 7.0, [&](double t) { return std::erf(t) - cut; });
}

}  // namespace anticrack
