#pragma once

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include <csignal>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>

#include "errors.h"

namespace anticrack {

/// A fresh folder for each test, removed at its end.
class IoTest : public testing::Test {
 protected:
  IoTest() {
    const auto* info = testing::UnitTest::GetInstance()->current_test_info();
    folder = std::filesystem::temp_directory_path() / ("anticrack_" + std::string(info->test_suite_name()) +
                                                       "_" + info->name() + "_" + std::to_string(::getpid()));
    std::filesystem::create_directories(folder);
  }
  ~IoTest() override { std::filesystem::remove_all(folder); }

  std::size_t files_in_folder() const {
    const auto entries = std::filesystem::directory_iterator(folder);
    return std::size_t(std::distance(begin(entries), end(entries)));
  }

  std::filesystem::path folder;
};

inline std::string file_content(const std::filesystem::path& file) {
  std::ostringstream text;
  text << std::ifstream(file, std::ios::binary).rdbuf();
  return text.str();
}

inline void put_file(const std::filesystem::path& file, const std::string& content) {
  std::filesystem::remove(
      file);  // file systems flush a file that is cut and filled again, which takes milliseconds
  std::ofstream(file, std::ios::binary) << content;
}

/// What the FileError says that `action` throws; "" if it throws nothing. Other exceptions escape and fail
/// the test.
template <class Action>
std::string file_error_of(const Action& action) {
  try {
    action();
  } catch (const FileError& error) {
    return error.what();
  }
  return "";
}

/// Within its life no file may grow past `bytes`: writing fails as on a full disk, by another errno.
class FullDisk {
 public:
  explicit FullDisk(rlim_t bytes) {
    ::getrlimit(RLIMIT_FSIZE, &before_);
    handler_ = std::signal(SIGXFSZ, SIG_IGN);
    const rlimit limit = {bytes, before_.rlim_max};
    ::setrlimit(RLIMIT_FSIZE, &limit);
  }
  ~FullDisk() {
    ::setrlimit(RLIMIT_FSIZE, &before_);
    std::signal(SIGXFSZ, handler_);
  }

 private:
  rlimit before_;
  void (*handler_)(int);
};

/// Within its life the folder takes no new files, for root neither: root becomes `nobody`.
class UnwritableFolder {
 public:
  explicit UnwritableFolder(const std::filesystem::path& folder) : folder_(folder) {
    std::filesystem::permissions(folder_, std::filesystem::perms(0555));
    if (::geteuid() == 0) switched_ = ::seteuid(65534) == 0;
  }
  ~UnwritableFolder() {
    if (switched_ && ::seteuid(0) != 0) ADD_FAILURE() << "cannot become root again";
    std::filesystem::permissions(folder_, std::filesystem::perms(0755));
  }

 private:
  std::filesystem::path folder_;
  bool switched_ = false;
};

}  // namespace anticrack
