#pragma once

namespace CLI {
class App;
}

namespace anticrack {

/// anticrack bench: particle-steps per second, by phase, beside the machine's limits and the plain step.
CLI::App* add_bench_command(CLI::App& app);

}  // namespace anticrack
