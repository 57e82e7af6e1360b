#pragma once

namespace CLI {
class App;
}

namespace anticrack {

/// `anticrack import FILE_OR_FOLDER -o S.vdb --voxel-size M`: the solid of a scan as a level set.
CLI::App* add_import_command(CLI::App& app);

}  // namespace anticrack
