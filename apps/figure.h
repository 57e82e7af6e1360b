#pragma once

namespace CLI {
class App;
}

namespace anticrack {

/// `anticrack figure b14|b15|b16 -o DIR`: Figs. B.14 to B.16 of Blatny et al. (2021), data and plots.
CLI::App* add_figure_command(CLI::App& app);

}  // namespace anticrack
