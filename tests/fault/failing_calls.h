#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace anticrack {

/// The system calls that put a file on disk (write, writev, fsync, rename) of this program, in order. While
/// it lives, one of them, or that and all after it, fails: as they do on a full disk or a dying one.
class FailingCalls {
 public:
  enum class Extent { one, from_there_on };

  /// @param number  of the call that fails, from 0; negative: none, they are only recorded
  FailingCalls(int number, int error_number, Extent extent);
  ~FailingCalls();
  FailingCalls(const FailingCalls&) = delete;

  /// "write NAME", "fsync NAME", "rename OLD NEW" each, with the last part of the path.
  static const std::vector<std::string>& recorded();
};

}  // namespace anticrack
