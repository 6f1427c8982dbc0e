// How a participant joins a secured cart, and who was refused there. services/transport/bus/DESIGN.md says what it
// keeps off.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "services/base/core/messages.h"

namespace fulcrum::bus {

struct Security {
  std::filesystem::path keys = {};  ///< Folder of `fulcrum keys init`; empty: no security.
  std::string identity = {};        ///< Row of services/transport/bus/access.h.
  bool encrypt = false;

  [[nodiscard]] bool on() const { return !keys.empty(); }
};

/// Leaves word in the cart's directory on /dev/shm of how its session is secured, so that `fulcrum status` and the like
/// need no option; without security, takes the word of an earlier session back.
void AnnounceSecurity(const std::filesystem::path& shared_memory, const Security& security);
/// What a participant needs to join the session that runs there.
[[nodiscard]] Security AnnouncedSecurity(const std::filesystem::path& shared_memory, std::string_view identity);

/// What was refused since the start.
struct Refusals {
  static constexpr std::size_t kMostTexts = 256;
  std::uint64_t participants = 0;  ///< That did not authenticate, or came with permissions of no use.
  std::uint64_t endpoints = 0;     ///< That an authenticated participant has no right to.
  std::vector<std::string> texts;  ///< For people: who, what, why; the first kMostTexts.

  [[nodiscard]] std::uint64_t count() const { return participants + endpoints; }
};

}  // namespace fulcrum::bus
