#include "stop_signal.h"

#include <atomic>

namespace anticrack {

namespace {

// Any thread may be the one that gets the signal, and others ask.
std::atomic<bool> stop_requested = false;
static_assert(std::atomic<bool>::is_always_lock_free);  // else not for a signal handler

}  // namespace

StopOnSignal::StopOnSignal() {
  stop_requested = false;
  struct sigaction action = {};
  action.sa_handler = [](int) { stop_requested = true; };
  action.sa_flags = int(SA_RESETHAND);
  sigaction(SIGINT, &action, &old_interrupt_);
  sigaction(SIGTERM, &action, &old_terminate_);
}

StopOnSignal::~StopOnSignal() {
  sigaction(SIGINT, &old_interrupt_, nullptr);
  sigaction(SIGTERM, &old_terminate_, nullptr);
}

bool StopOnSignal::requested() const {
  return stop_requested;
}

}  // namespace anticrack
