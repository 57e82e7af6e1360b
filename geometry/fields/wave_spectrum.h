#pragma once

#include <filesystem>
#include <vector>

namespace anticrack {

/// A law of the wave number, given as a table: the density is linear between the rows, zero outside.
class WaveSpectrum {
 public:
  struct Row {
    double wave_number;  ///< |eta| = 2 pi / wavelength [1/m]
    double weight;       ///< density, in any unit, >= 0
  };

  /// @throws InputError  fewer than two rows, wave numbers not increasing or not > 0, a negative weight, or
  /// no weight at all
  explicit WaveSpectrum(std::vector<Row> rows);

  /// The wave number below which the share `probability`, in [0, 1), of the waves lies.
  double quantile(double probability) const;
  double mean() const { return mean_; }           ///< <eta> [1/m]
  double mean_square() const { return square_; }  ///< <eta^2> [1/m^2]
  const std::vector<Row>& rows() const { return rows_; }

 private:
  std::vector<Row> rows_;
  std::vector<double> share_;  // of the waves below each row; the last is 1
  double mean_ = 0, square_ = 0;
};

/// Reads a CSV file with the header `wave_number,weight`; lines that begin with # are comments.
/// @throws FileError   it cannot be read
/// @throws InputError  naming file and line
WaveSpectrum read_wave_spectrum(const std::filesystem::path& file);

}  // namespace anticrack
