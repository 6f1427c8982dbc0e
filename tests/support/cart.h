// A complete cart, started as by a user and observed from outside.
#pragma once

#include <sys/types.h>

#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "tests/support/program.h"

namespace fulcrum::testing {

/// Waits until `done` returns true; returns false at the time limit.
bool WaitFor(double limit_s, const std::function<bool()>& done);

[[nodiscard]] std::string ReadFile(const std::filesystem::path& file);

/// Number under `key` in a summary.json; NaN: it is missing.
[[nodiscard]] double FigureOf(const std::string& summary, const std::string& key);

/// Empty for a session that found no fault but, at most, nodes that this machine is too slow for. Otherwise its faults
/// and all that it printed.
/// @param code exit code of `fulcrum up`, or minus the signal that ended it.
/// @param said all that it printed.
[[nodiscard]] std::string FaultBesidePace(int code, const std::string& said);

/// Running child processes of a process, by name.
[[nodiscard]] std::map<std::string, pid_t> ChildrenOf(pid_t parent);

/// Processor time that a process has used [s]; none when it has ended.
[[nodiscard]] std::optional<double> CpuSeconds(pid_t pid);

/// One run of `fulcrum up SCENE` without the video at its end; the destructor ends all its processes.
class Cart {
 public:
  Cart(const std::string& scene, int domain, const std::vector<std::string>& more_arguments = {});
  ~Cart();
  Cart(const Cart&) = delete;
  Cart& operator=(const Cart&) = delete;

  /// Running nodes, by name.
  [[nodiscard]] std::map<std::string, pid_t> nodes() const;
  /// Process of `fulcrum up`.
  [[nodiscard]] pid_t pid() const { return up_.pid(); }
  [[nodiscard]] std::string Said() const { return up_.Said(); }
  [[nodiscard]] std::filesystem::path session() const { return folder_ / "latest"; }
  /// Session time of the newest picture [s], a measure of progress that is visible from outside; negative without a
  /// picture.
  [[nodiscard]] double PictureTime() const;
  /// Sends a signal to `fulcrum up`.
  void Signal(int signal) const { up_.Signal(signal); }
  /// Exit code of `fulcrum up`, or minus the signal; no value if it does not end within the limit.
  [[nodiscard]] std::optional<int> WaitForEnd(double limit_s);
  /// Waits for the end, which must come by itself; then FaultBesidePace of this session.
  [[nodiscard]] std::string FaultAtEnd(double limit_s);

 private:
  std::filesystem::path folder_;
  Program up_;
};

}  // namespace fulcrum::testing
