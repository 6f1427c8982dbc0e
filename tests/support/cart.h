// The whole cart as a user starts it, watched from outside.
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

/// Whether `done` came true within the limit.
bool WaitFor(double limit_s, const std::function<bool()>& done);

[[nodiscard]] std::string ReadFile(const std::filesystem::path& file);

/// The processes that a process has started and that still run, by name.
[[nodiscard]] std::map<std::string, pid_t> ChildrenOf(pid_t parent);

/// One run of `fulcrum up SCENE`; everything is gone when the object is.
class Cart {
 public:
  Cart(const std::string& scene, int domain, const std::vector<std::string>& more_arguments = {});
  ~Cart();
  Cart(const Cart&) = delete;
  Cart& operator=(const Cart&) = delete;

  /// The nodes that run now, by name.
  [[nodiscard]] std::map<std::string, pid_t> nodes() const;
  [[nodiscard]] std::string Said() const { return up_.Said(); }
  [[nodiscard]] std::filesystem::path session() const { return folder_ / "latest"; }
  /// Session time of the newest picture [s]: how far the cart has come, seen from outside. Negative: none yet.
  [[nodiscard]] double PictureTime() const;
  /// To `fulcrum up`.
  void Signal(int signal) const { up_.Signal(signal); }
  /// Exit code of `fulcrum up`, minus a signal; nothing if it does not end within the limit.
  [[nodiscard]] std::optional<int> WaitForEnd(double limit_s);

 private:
  std::filesystem::path folder_;
  Program up_;
};

}  // namespace fulcrum::testing
