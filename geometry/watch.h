#pragma once

#include <functional>

namespace anticrack {

/// Called between pieces of work (slices, blocks of a lattice) with the share of the work done, in [0, 1];
/// may throw to stop it.
using Watch = std::function<void(double done)>;

}  // namespace anticrack
