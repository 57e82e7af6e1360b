#include "ticks.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace anticrack {

namespace {

std::string with_minus(std::string text) {
  if (!text.empty() && text[0] == '-') text.replace(0, 1, "\u2212");
  return text;
}

std::string fixed(double value, int decimals) {
  char text[64];
  std::snprintf(text, sizeof text, "%.*f", decimals, value == 0 ? 0.0 : value);
  return with_minus(text);
}

/// Largest of 1, 2, 5 times a power of ten that is not above `raw`, or the next one if that is closer.
double nice_step(double raw) {
  const double power = std::pow(10, std::floor(std::log10(raw)));
  const double digit = raw / power;
  return power * (digit < 1.5 ? 1 : digit < 3.5 ? 2 : digit < 7.5 ? 5 : 10);
}

}  // namespace

std::string power_of_ten(int exponent) {
  return "10^{" + with_minus(std::to_string(exponent)) + "}";
}

Ticks linear_ticks(double low, double high, int count) {
  Ticks ticks;
  if (!(high > low) || count < 1) return ticks;
  const double step = nice_step((high - low) / count);
  const double largest = std::max(std::abs(low), std::abs(high));
  const int magnitude = int(std::floor(std::log10(largest)));
  if (magnitude >= 4 || magnitude < -2) ticks.exponent = 3 * int(std::floor(magnitude / 3.0));
  const double unit = std::pow(10, ticks.exponent);
  const int decimals = std::max(0, -int(std::floor(std::log10(step / unit) + 1e-9)));
  for (double i = std::ceil(low / step - 1e-9); i <= std::floor(high / step + 1e-9); ++i) {
    ticks.values.push_back(i * step);
    ticks.labels.push_back(fixed(i * step / unit, decimals));
  }
  return ticks;
}

Ticks logarithmic_ticks(double low, double high) {
  Ticks ticks;
  const double first = std::log10(low) - 1e-9, last = std::log10(high) + 1e-9;
  const auto add = [&](double value) {
    if (std::log10(value) < first || std::log10(value) > last) return;
    ticks.values.push_back(value);
    ticks.labels.push_back(number_label(value));
  };
  const bool few = std::floor(last) - std::ceil(first) < 2;
  for (int e = int(std::floor(first)); e <= std::ceil(last); ++e)
    for (const int digit : {1, 2, 5})
      if (digit == 1 || few) add(digit * std::pow(10, e));
  return ticks;
}

std::string number_label(double value) {
  if (value == 0) return "0";
  if (!std::isfinite(value))
    return std::isnan(value) ? "not a number" : value > 0 ? "\u221e" : "\u2212\u221e";
  const int magnitude = int(std::floor(std::log10(std::abs(value)) + 1e-9));
  if (magnitude > 4 || magnitude < -3) {
    const double mantissa = value / std::pow(10, magnitude);
    if (std::abs(mantissa - 1) < 5e-3) return power_of_ten(magnitude);
    return number_label(mantissa) + "\u00d7" + power_of_ten(magnitude);
  }
  char text[64];
  std::snprintf(text, sizeof text, "%.*f", std::max(0, 2 - magnitude), value);
  std::string digits = text;
  if (digits.find('.') != std::string::npos) {
    digits.erase(digits.find_last_not_of('0') + 1);
    if (digits.back() == '.') digits.pop_back();
  }
  return with_minus(digits);
}

}  // namespace anticrack
