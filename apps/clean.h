#pragma once

namespace CLI {
class App;
}

namespace anticrack {

/// `anticrack clean S.vdb -o T.vdb`: a microstructure without the solid that is not connected to a spanning
/// cluster.
CLI::App* add_clean_command(CLI::App& app);

}  // namespace anticrack
