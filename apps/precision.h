#pragma once

namespace CLI {
class App;
}

namespace anticrack {

/// anticrack precision: error against run time.
CLI::App* add_precision_command(CLI::App& app);

}  // namespace anticrack
