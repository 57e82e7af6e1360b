#pragma once

#include <algorithm>
#include <cmath>
#include <span>
#include <vector>

#include "fields/morphology.h"
#include "fields/padded_field.h"

namespace anticrack {

/// A smooth surface {field = level}.
struct Sheet {
  const PaddedField* field;
  double level;
};

/// A solid that is bounded by smooth sheets, on a padded lattice; a view of its fields.
struct CutSolid {
  Morphology morphology;
  std::span<const PaddedField> fields;  ///< single cut: G - t; else the fields themselves
  double threshold;                     ///< t; 0 for the single cut, whose field holds it

  const Index3& points() const { return fields[0].points; }

  /// Positive in the solid: the field of a single cut; of the others t - |G|, the lesser or larger of two.
  template <class Value>
  double excess(const Value& value_of) const {
    if (morphology == Morphology::single_cut) return value_of(fields[0]);
    const double first = std::abs(value_of(fields[0]));
    if (morphology == Morphology::two_cut) return threshold - first;
    const double second = std::abs(value_of(fields[1]));
    return threshold -
           (morphology == Morphology::open_cell ? std::max(first, second) : std::min(first, second));
  }
  double excess_at(std::size_t offset) const {
    return excess([&](const PaddedField& field) { return double(field.values[offset]); });
  }

  /// By how much a point of the sheet on the one field lies on the boundary, given the other field's value:
  /// there the other field must be in its cut (open cell) or out of it (closed cell).
  double on_boundary(double other_value) const {
    const double inside = threshold - std::abs(other_value);
    return morphology == Morphology::closed_cell ? -inside : inside;
  }

  std::vector<Sheet> sheets() const {
    if (morphology == Morphology::single_cut) return {{&fields[0], 0.0}};
    std::vector<Sheet> all;
    for (const PaddedField& field : fields)
      all.insert(all.end(), {{&field, threshold}, {&field, -threshold}});
    return all;
  }
};

}  // namespace anticrack
