#pragma once

namespace CLI {
class App;
}

namespace anticrack {

/// Adds `anticrack run SCENE -o DIR`.
CLI::App* add_run_command(CLI::App& app);

}  // namespace anticrack
