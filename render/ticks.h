#pragma once

#include <string>
#include <vector>

namespace anticrack {

/// Marks of an axis. The labels show value / 10^exponent, with a true minus sign.
struct Ticks {
  std::vector<double> values;
  std::vector<std::string> labels;
  int exponent = 0;  ///< a multiple of 3; 0 where plain numbers read well
};

/// About `count` marks at multiples of 1, 2 or 5 times a power of ten within [low, high].
Ticks linear_ticks(double low, double high, int count);

/// Powers of ten within [low, high], low > 0; 2 and 5 times them too where there are fewer than three.
Ticks logarithmic_ticks(double low, double high);

/// Shortest decimal that shows three digits, with a true minus sign; powers of ten as superscripts where
/// needed.
std::string number_label(double value);

/// "10^{-3}" with a true minus sign, for text with markup.
std::string power_of_ten(int exponent);

}  // namespace anticrack
