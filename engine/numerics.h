#pragma once

#include <array>
#include <optional>

#include "material/material_parameters.h"
#include "walls/loading.h"

namespace anticrack {

enum class TimeStepRule {
  safe,   ///< stable for any particle layout and following compression, see time_step.h
  paper,  ///< Algorithm 1, line 1, C_el = 0.5
};

enum class TransferScheme {
  pic_flip,  ///< Algorithm 1, line 12: the share `flip` of FLIP, the rest of PIC
  apic,      ///< Jiang et al. (2015): particles carry an affine velocity field
};

/// Choices of the scheme; the defaults are the recommended ones.
struct Numerics {
  TimeStepRule time_step = TimeStepRule::safe;
  double time_step_factor = 1.0;  ///< multiplies the rule's limit, in (0, 1]
  TransferScheme transfer = TransferScheme::pic_flip;
  double flip = 0.99;               ///< alpha_f a step, in [0, 1]; Algorithm 1
  std::optional<double> flip_time;  ///< [s], > 0; then alpha_f = exp(-dt / flip_time): what PIC takes away a
                                    ///< second does not depend on the step
  WallRule wall_rule = WallRule::ghost;
  ReturnMapping return_mapping = ReturnMapping::implicit;
  std::array<double, 3> grid_offset = {0, 0, 0};  ///< [cells]; shifts the node lattice against the sample
};

}  // namespace anticrack
