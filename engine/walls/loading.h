#pragma once

#include <variant>

namespace anticrack {

/// What the six walls of a triaxial run impose beside their own normal velocity.
enum class WallKind {
  sticky,  ///< tangential velocity zero at the wall
  slip,    ///< no friction
  affine,  ///< every boundary point follows the homogeneous velocity gradient (kinematic homogenization
           ///< condition)
  paper,   ///< what the authors ran: pushing walls slip; pulling walls stick and start one cell inside the
           ///< sample
};

/// How a wall acts on the nodes near it.
enum class WallRule {
  ghost,  ///< extrapolate through the wall: v_g = v_w + (v_j - v_w)(x_g - x_w)/(x_j - x_w), the ghosts'
          ///< momentum going to j
  paper,  ///< nodes at or behind the wall take the wall's velocity; stiffness then depends on the wall's
          ///< place in its cell
};

/// Six walls, opposite ones with opposite velocities, Eq. 13 of Blatny et al. (2021).
///
/// Each wall of axis a moves at rate_a * L_a, with rates (beta2 + beta1, beta2 - beta1, beta2) * strain_rate;
/// hence eps_V = 6 t beta2 strain_rate, as the paper counts. Positive rates pull.
struct TriaxialLoading {
  double beta1;
  double beta2;
  double strain_rate;  ///< [1/s]; Table 1: 5e-4
  WallKind walls;
  double ramp_time = 0;  ///< [s] over which the walls speed up linearly; 0 = at once
};

/// Uniaxial compression between platens, frictionless side walls at rest; section 3.3.
struct ConfinedCompression {
  int axis;              ///< 0, 1, 2
  bool both_platens;     ///< false: only the upper one moves
  double speed;          ///< [m/s] of each moving platen, > 0
  double ramp_time = 0;  ///< [s]
};

using Loading = std::variant<TriaxialLoading, ConfinedCompression>;

}  // namespace anticrack
