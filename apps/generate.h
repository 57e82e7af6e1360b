#pragma once

namespace CLI {
class App;
}

namespace anticrack {

/// `anticrack generate SCENE -o S.vdb`: the microstructure of a scene as a file.
CLI::App* add_generate_command(CLI::App& app);

}  // namespace anticrack
