#pragma once

#include <cstddef>

namespace anticrack {

/// The most memory that operator new has handed out at once since this object began, beyond what was in use
/// then [bytes]. All that the readers and OpenVDB allocate comes from there.
class PeakMemory {
 public:
  PeakMemory();
  std::size_t bytes() const;

 private:
  std::size_t before_;
};

}  // namespace anticrack
