// Participants that a secured cart must keep off its bus, and a cart as their target. Real processes, real keys.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace fulcrum::testing {

/// One attempt to write ToolState to a secured cart, and its result.
struct Attempt {
  std::string name;
  std::string last_line;       ///< Last line of output of its process.
  int exit_code = 0;           ///< Exit code of its process, or minus the signal.
  int wanted_exit_code = 0;    ///< Exit code that the specification requires.
  std::string wanted_of_cart;  ///< Text that the cart must report; empty: the attempt ends before it reaches the cart.
  bool reported = false;       ///< The cart has reported it.
  bool came_through = false;   ///< The cart received a sample of the attempt, or the attempt one of the cart.

  [[nodiscard]] bool refused() const {
    return !came_through && exit_code == wanted_exit_code && (wanted_of_cart.empty() || reported);
  }
};

/// All attempts against one cart in `domain`; `scratch` is a folder for keys; it is created and not removed.
[[nodiscard]] std::vector<Attempt> TryAllAttempts(int domain, const std::filesystem::path& scratch);

}  // namespace fulcrum::testing
