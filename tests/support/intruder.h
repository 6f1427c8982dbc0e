// Those whom a secured cart must keep off its bus, and a cart for them to knock at. Real processes, real keys.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace fulcrum::testing {

/// One attempt to write ToolState to a secured cart, and what became of it.
struct Attempt {
  std::string name;
  std::string who;             ///< What its process said, its last line.
  int exit_code = 0;           ///< Of its process; minus a signal.
  int wanted_exit_code = 0;    ///< What the table of exit codes asks for.
  std::string wanted_of_cart;  ///< What the cart must report; empty: the attempt ends before it reaches the cart.
  bool reported = false;       ///< It has.
  bool came_through = false;   ///< A sample of the attempt was taken by the cart, or one of the cart by it.

  [[nodiscard]] bool refused() const {
    return !came_through && exit_code == wanted_exit_code && (wanted_of_cart.empty() || reported);
  }
};

/// All attempts against one cart in `domain`; `scratch` is a folder for keys, made and left.
[[nodiscard]] std::vector<Attempt> TryAllAttempts(int domain, const std::filesystem::path& scratch);

}  // namespace fulcrum::testing
