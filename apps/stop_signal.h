#pragma once

#include <csignal>

namespace anticrack {

/// While it lives, Ctrl-C and SIGTERM ask for a stop at the next good place; a second one acts as usual.
class StopOnSignal {
 public:
  StopOnSignal();
  ~StopOnSignal();
  StopOnSignal(const StopOnSignal&) = delete;
  StopOnSignal& operator=(const StopOnSignal&) = delete;

  bool requested() const;

 private:
  struct sigaction old_interrupt_, old_terminate_;
};

}  // namespace anticrack
