#pragma once

namespace anticrack {

struct SimulationSetup;

/// The setup itself, unless it holds a number that no simulation can begin with.
/// @throws InputError  naming quantity, value and what is allowed
const SimulationSetup& checked(const SimulationSetup& setup);

}  // namespace anticrack
