#pragma once

#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cstdio>
#include <string>
#include <vector>

namespace anticrack {

struct Outcome {
  int status;        ///< exit status, or -1 if a signal ended it
  std::string text;  ///< stdout and stderr
};

/// Runs a line of shell.
inline Outcome run_shell(const std::string& line) {
  std::FILE* pipe = popen(("{ " + line + "\n} 2>&1").c_str(), "r");
  Outcome outcome{-1, {}};
  std::array<char, 256> buffer;
  while (std::fgets(buffer.data(), int(buffer.size()), pipe)) outcome.text += buffer.data();
  const int status = pclose(pipe);
  if (WIFEXITED(status)) outcome.status = WEXITSTATUS(status);
  return outcome;
}

/// Runs the command with these arguments.
inline Outcome run(const std::string& arguments) {
  return run_shell(std::string(ANTICRACK_BINARY " ") + arguments);
}

/// Starts the command in a process of its own, silent.
inline pid_t start(const std::vector<std::string>& arguments) {
  const pid_t child = fork();
  if (child != 0) return child;
  std::vector<char*> argv{const_cast<char*>(ANTICRACK_BINARY)};
  for (const std::string& a : arguments) argv.push_back(const_cast<char*>(a.c_str()));
  argv.push_back(nullptr);
  if (!std::freopen("/dev/null", "w", stdout) || !std::freopen("/dev/null", "w", stderr)) _exit(126);
  execv(ANTICRACK_BINARY, argv.data());
  _exit(127);
}

inline int exit_status(pid_t child) {
  int status = 0;
  waitpid(child, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

}  // namespace anticrack
