#pragma once

namespace CLI {
class App;
}

namespace anticrack {

/// Adds `anticrack material SCENE --path P.csv -o OUT.csv`.
CLI::App* add_material_command(CLI::App& app);

}  // namespace anticrack
