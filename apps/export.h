#pragma once

namespace CLI {
class App;
}

namespace anticrack {

/// `anticrack export S.vdb -o FILE`: a microstructure or a scan as an image or a surface mesh.
CLI::App* add_export_command(CLI::App& app);

}  // namespace anticrack
