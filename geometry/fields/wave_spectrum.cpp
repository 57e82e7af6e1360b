#include "fields/wave_spectrum.h"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <fstream>
#include <string>

#include "errors.h"
#include "files/atomic_file.h"

namespace anticrack {
namespace {

// Two numbers separated by a comma, blanks allowed around them.
bool parse_row(const std::string& line, WaveSpectrum::Row& row) {
  const std::size_t comma = line.find(',');
  if (comma == std::string::npos) return false;
  const auto parse = [](std::string text, double& value) {
    const std::size_t first = text.find_first_not_of(" \t"), last = text.find_last_not_of(" \t");
    if (first == std::string::npos) return false;
    text = text.substr(first, last - first + 1);
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    return error == std::errc() && end == text.data() + text.size();
  };
  return parse(line.substr(0, comma), row.wave_number) && parse(line.substr(comma + 1), row.weight);
}

}  // namespace

WaveSpectrum::WaveSpectrum(std::vector<Row> rows) : rows_(std::move(rows)) {
  if (rows_.size() < 2)
    throw InputError(fmt::format("spectrum: {} rows; expected at least two", rows_.size()));
  double total = 0;
  share_.push_back(0);
  for (std::size_t n = 0; n < rows_.size(); ++n) {
    const auto& [eta, weight] = rows_[n];
    if (!(eta > 0) || !std::isfinite(eta) || (n > 0 && !(eta > rows_[n - 1].wave_number)))
      throw InputError(fmt::format("spectrum: row {}: wave_number = {}; expected > {}", n + 1, eta,
                                   n == 0 ? 0.0 : rows_[n - 1].wave_number));
    if (!(weight >= 0) || !std::isfinite(weight))
      throw InputError(fmt::format("spectrum: row {}: weight = {}; expected >= 0", n + 1, weight));
    if (n == 0) continue;
    // Moments of a density that is linear from (a, p) to (b, q).
    const auto& [a, p] = rows_[n - 1];
    const double b = eta, q = weight, width = b - a;
    total += 0.5 * (p + q) * width;
    mean_ += width / 6 * (p * (2 * a + b) + q * (a + 2 * b));
    square_ += width / 12 * (p * (3 * a * a + 2 * a * b + b * b) + q * (a * a + 2 * a * b + 3 * b * b));
    share_.push_back(total);
  }
  if (!(total > 0)) throw InputError("spectrum: every weight is 0; expected at least one > 0");
  for (double& share : share_) share /= total;
  mean_ /= total, square_ /= total;
}

double WaveSpectrum::quantile(double probability) const {
  const auto above = std::upper_bound(share_.begin(), share_.end() - 1, probability);
  const auto n = std::size_t(above - share_.begin());
  const auto& [a, p] = rows_[n - 1];
  const auto& [b, q] = rows_[n];
  // p s + (q - p) s^2 / 2 = rest (p + q) / 2 for s in [0, 1], in the form that does not cancel.
  const double rest = (probability - share_[n - 1]) / (share_[n] - share_[n - 1]);
  const double area = 0.5 * (p + q) * rest, root = std::sqrt(p * p + 2 * (q - p) * area);
  return a + (b - a) * std::min(1.0, p + root > 0 ? 2 * area / (p + root) : 0.0);
}

WaveSpectrum read_wave_spectrum(const std::filesystem::path& file) {
  errno = 0;
  std::ifstream stream(file);
  if (!stream || std::filesystem::is_directory(file))
    throw system_file_error(file, "cannot be read", errno != 0 ? errno : EISDIR);
  std::vector<WaveSpectrum::Row> rows;
  bool header = false;
  std::string line;
  for (int number = 1; std::getline(stream, line); ++number) {
    if (line.ends_with('\r')) line.pop_back();
    if (line.empty() || line.starts_with('#')) continue;
    WaveSpectrum::Row row{};
    if (!header) {
      if (line != "wave_number,weight")
        throw InputError(fmt::format("{}:{}: {}; expected the header wave_number,weight (1/m, density)",
                                     file.string(), number, line));
      header = true;
    } else if (parse_row(line, row)) {
      rows.push_back(row);
    } else {
      throw InputError(
          fmt::format("{}:{}: {}; expected two numbers wave_number,weight", file.string(), number, line));
    }
  }
  try {
    return WaveSpectrum(std::move(rows));
  } catch (const InputError& error) {
    throw InputError(fmt::format("{}: {}", file.string(), error.what()));
  }
}

}  // namespace anticrack
