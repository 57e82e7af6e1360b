#pragma once

#include <Eigen/Core>
#include <array>

namespace anticrack {

using Vec3 = Eigen::Vector3d;  ///< world-space vector; [m] where it is a position
using Mat3 = Eigen::Matrix3d;  ///< second-order tensor
using Index3 = std::array<int, 3>;

}  // namespace anticrack
