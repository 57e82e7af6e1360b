#pragma once

namespace CLI {
class App;
}

namespace anticrack {

/// `anticrack characterize INPUT -o report.json`: the numbers of a scene's, a level set's or a scan's
/// geometry.
CLI::App* add_characterize_command(CLI::App& app);

}  // namespace anticrack
