// A child process whose output goes to a file and that dies with its parent.
#pragma once

#include <sys/types.h>

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "services/base/core/error.h"

namespace fulcrum::runtime {

/// The system has no descriptor, process or memory left for a program. The same start may succeed later.
class ShortageError : public InputError {
 public:
  using InputError::InputError;
};

/// File descriptors of a child's standard streams.
struct ChildStreams {
  int input = -1;  ///< -1: empty input.
  int output = -1;
  int error = -1;  ///< -1: that of the output.
};

/// Whether a child ends with its parent, also when the parent is killed.
enum class WithParent { kDies, kStays };

/// How a child ended.
struct ProcessEnd {
  int exit_code = 0;  ///< Valid when signal is 0.
  int signal = 0;
  /// "killed by signal 9 (Killed)" or "ended with exit code 3 (scene or schema mismatch)".
  [[nodiscard]] std::string Describe() const;
};

class ChildProcess {
 public:
  ChildProcess() = default;
  ~ChildProcess();  ///< Kills and reaps a child that still runs, unless it may stay.
  ChildProcess(ChildProcess&& other) noexcept;
  ChildProcess& operator=(ChildProcess&& other) noexcept;

  /// Starts `program` with `arguments`; standard output and error are appended to `log`, `input` is an open file or -1.
  /// The child is killed when the calling thread ends, so start children from the main thread. Throws InputError when
  /// the program cannot be started, ShortageError when it cannot now.
  [[nodiscard]] static ChildProcess Start(const std::filesystem::path& program,
                                          const std::vector<std::string>& arguments, const std::filesystem::path& log,
                                          WithParent with_parent = WithParent::kDies, int input = -1);
  /// The same with open files, which the caller closes.
  [[nodiscard]] static ChildProcess StartOn(const std::filesystem::path& program,
                                            const std::vector<std::string>& arguments, const ChildStreams& streams,
                                            WithParent with_parent = WithParent::kDies);

  [[nodiscard]] bool running() const { return pid_ > 0; }
  [[nodiscard]] pid_t pid() const { return pid_; }
  /// Reaps the child and returns how it ended, once; nullopt while it runs and after that.
  [[nodiscard]] std::optional<ProcessEnd> Poll();
  void Signal(int signal) const;

 private:
  pid_t pid_ = -1;
  WithParent with_parent_ = WithParent::kDies;
};

/// The program of that name in the folders of PATH; empty: there is none.
[[nodiscard]] std::filesystem::path FindInPath(const std::string& name);

}  // namespace fulcrum::runtime
