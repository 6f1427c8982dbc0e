// A physics process by itself, or one of a pair: "a" and "b" have a checkpoint each.
#pragma once

#include <string>

#include "services/base/core/error.h"

namespace fulcrum::physics {

struct Seat {
  std::string own, other;  ///< Names of the checkpoint files; `other` empty: no pair.
  bool follows = false;
};

/// Of the options --pair and --follow. Throws InputError.
[[nodiscard]] inline Seat SeatOf(const std::string& pair, bool follows) {
  if (pair.empty() && !follows) return {"physics_node.checkpoint", "", false};
  if (pair != "a" && pair != "b") throw InputError("--pair must be a or b, and --follow goes with it only");
  const auto file = [](const std::string& seat) { return "physics_node-" + seat + ".checkpoint"; };
  return {file(pair), file(pair == "a" ? "b" : "a"), follows};
}

}  // namespace fulcrum::physics
