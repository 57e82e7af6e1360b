#pragma once

namespace CLI {
class App;
}

namespace anticrack {

/// `anticrack render DIR_or_FRAME -o IMAGE`: pictures, panels and movies of frames, plots of the history.
CLI::App* add_render_command(CLI::App& app);

}  // namespace anticrack
