#pragma once

#include <stdexcept>

namespace anticrack {

/// A computation left its domain: not-finite state, inverted particle. The message names step, time,
/// particle, quantity.
struct NumericalError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// An argument or input is outside what the called function accepts. The message names quantity, value and
/// allowed range.
struct InputError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// A file could not be read or written. The message names the file and the reason.
struct FileError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

}  // namespace anticrack
