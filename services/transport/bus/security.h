// How a participant joins a secured cart, and which participants were refused. services/transport/bus/DESIGN.md lists
// what this protects against.
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
  std::string identity = {};        ///< Identity in services/transport/bus/access.h.
  bool encrypt = false;

  [[nodiscard]] bool on() const { return !keys.empty(); }
};

/// Writes the security settings of the session into the cart's directory on /dev/shm, so that `fulcrum status` and
/// similar commands need no option; without security, removes the settings of an earlier session.
void AnnounceSecurity(const std::filesystem::path& shared_memory, const Security& security);
/// Security settings with which a participant joins the session that runs there.
[[nodiscard]] Security AnnouncedSecurity(const std::filesystem::path& shared_memory, std::string_view identity);

/// Refused participants and endpoints since the start.
struct Refusals {
  static constexpr std::size_t kMostTexts = 256;
  std::uint64_t participants = 0;  ///< Not authenticated, or with invalid permissions.
  std::uint64_t endpoints = 0;     ///< Of authenticated participants without the right to the topic.
  std::vector<std::string> texts;  ///< For the operator: participant, fault, reason; the first kMostTexts.

  [[nodiscard]] std::uint64_t count() const { return participants + endpoints; }
};

}  // namespace fulcrum::bus
