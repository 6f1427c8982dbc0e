// A program of this build as a child of a test.
#pragma once

#include <sys/types.h>

#include <optional>
#include <string>
#include <vector>

namespace fulcrum::testing {

/// Killed and reaped at the end of its scope, and killed when the thread that started it ends.
class Program {
 public:
  Program() = default;
  /// Starts bin/`name`, or a path from the root, with `arguments`; `input` stands in its standard input, what it says
  /// is kept in memory.
  Program(const std::string& name, const std::vector<std::string>& arguments, const std::string& input = "");
  ~Program();
  Program(Program&& other) noexcept;
  Program& operator=(Program&& other) noexcept;

  [[nodiscard]] pid_t pid() const { return pid_; }
  /// Standard output and error until now.
  [[nodiscard]] std::string Said() const;
  void Signal(int signal) const;
  /// Sends `signal`, 0 for none, and waits for the end: exit code, or minus the signal that ended it.
  int End(int signal);
  /// The same, once it has ended by itself; nothing while it runs.
  [[nodiscard]] std::optional<int> Poll();

 private:
  int Ended(int status);

  pid_t pid_ = -1;
  int output_ = -1;
};

}  // namespace fulcrum::testing
