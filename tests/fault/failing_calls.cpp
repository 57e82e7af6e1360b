#include "fault/failing_calls.h"

#include <sys/syscall.h>
#include <sys/uio.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <mutex>

namespace anticrack {
namespace {

bool active = false;
int failing_number, failing_error;
FailingCalls::Extent failing_extent;
std::vector<std::string> calls;
std::mutex mutex;

std::string name_of(int descriptor) {
  std::error_code ignored;
  const auto link = "/proc/self/fd/" + std::to_string(descriptor);
  return std::filesystem::read_symlink(link, ignored).filename().string();
}

// The errno with which this call fails; 0 if it does not.
int record(const std::string& call) {
  const std::lock_guard lock(mutex);
  const int number = int(calls.size());
  calls.push_back(call);
  if (failing_number < 0 || number < failing_number) return 0;
  return number == failing_number || failing_extent == FailingCalls::Extent::from_there_on ? failing_error
                                                                                           : 0;
}

template <class Call>
auto pass_on(const std::string& what, Call call) {
  const int failed = record(what);
  if (failed == 0) return call();
  errno = failed;
  return decltype(call())(-1);
}

}  // namespace

FailingCalls::FailingCalls(int number, int error_number, Extent extent) {
  failing_number = number, failing_error = error_number, failing_extent = extent;
  calls.clear();
  active = true;
}

FailingCalls::~FailingCalls() {
  active = false;
}

const std::vector<std::string>& FailingCalls::recorded() {
  return calls;
}

}  // namespace anticrack

// These stand before the C library's for the whole program, its shared libraries included.
extern "C" {

ssize_t write(int descriptor, const void* bytes, size_t count) {
  const auto call = [&] { return ssize_t(syscall(SYS_write, descriptor, bytes, count)); };
  return anticrack::active ? anticrack::pass_on("write " + anticrack::name_of(descriptor), call) : call();
}

ssize_t writev(int descriptor, const iovec* parts, int count) {
  const auto call = [&] { return ssize_t(syscall(SYS_writev, descriptor, parts, count)); };
  return anticrack::active ? anticrack::pass_on("write " + anticrack::name_of(descriptor), call) : call();
}

int fsync(int descriptor) {
  const auto call = [&] { return int(syscall(SYS_fsync, descriptor)); };
  return anticrack::active ? anticrack::pass_on("fsync " + anticrack::name_of(descriptor), call) : call();
}

int rename(const char* from, const char* to) noexcept {
  const auto call = [&] { return int(syscall(SYS_rename, from, to)); };
  const auto name = [](const char* path) { return std::filesystem::path(path).filename().string(); };
  return anticrack::active ? anticrack::pass_on("rename " + name(from) + ' ' + name(to), call) : call();
}
}
