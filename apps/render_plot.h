#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace anticrack {

/// A plot of columns of history.csv of one or more runs, as the file `output`'s bytes (PNG, SVG or PDF by
/// extension).
/// @param x  a column, with a leading minus for its negative; empty: the negative of the largest strain
/// @param y  columns, comma separated; empty: p and q
/// @throws InputError  for a folder without history or an unknown column, naming the choices. @throws
/// FileError
std::string plot_histories(const std::vector<std::string>& runs, std::string x, std::string y,
                           const std::filesystem::path& output, int width, int height);

}  // namespace anticrack
