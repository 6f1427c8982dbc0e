// A program of this build as a child of a test.
#pragma once

#include <sys/types.h>

#include <optional>
#include <string>
#include <vector>

namespace fulcrum::testing {

/// A child process. It is killed and reaped at the end of the object's scope, and killed when the thread that started
/// it ends.
class Program {
 public:
  Program() = default;
  /// Starts bin/`name`, or a path from the root, with `arguments`. `input` is its standard input; its output is kept in
  /// memory.
  Program(const std::string& name, const std::vector<std::string>& arguments, const std::string& input = "");
  ~Program();
  Program(Program&& other) noexcept;
  Program& operator=(Program&& other) noexcept;

  [[nodiscard]] pid_t pid() const { return pid_; }
  /// Standard output and error so far.
  [[nodiscard]] std::string Said() const;
  void Signal(int signal) const;
  /// Sends `signal`, 0 for none, and waits for the end: exit code, or minus the signal that ended it.
  int End(int signal);
  /// Exit code, or minus the signal, if it has ended; no value while it runs.
  [[nodiscard]] std::optional<int> Poll();

 private:
  int Ended(int status);

  pid_t pid_ = -1;
  int output_ = -1;
};

}  // namespace fulcrum::testing
