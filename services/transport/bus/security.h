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

/// Begins a session in the cart's private directory on /dev/shm: writes a new secret number and the security settings,
/// with which nodes and tools of this user join. Replaces those of an earlier session. @return the number, not 0.
/// Throws InputError.
std::uint64_t AnnounceSession(const std::filesystem::path& shared_memory, const Security& security);
/// Number of the session that was announced there; 0: none.
[[nodiscard]] std::uint64_t AnnouncedSession(const std::filesystem::path& shared_memory);
/// Copies the announcement to the key folder of a guest, who cannot read that directory: AnnouncedSession() finds it
/// there. Throws InputError.
void HandOverSession(const std::filesystem::path& shared_memory, const std::filesystem::path& folder);
/// Security settings with which a participant joins the session that was announced there; off: none, or an open bus.
[[nodiscard]] Security AnnouncedSecurity(const std::filesystem::path& shared_memory, std::string_view identity);

/// Refused participants and endpoints since the start; on an open bus only participants of other sessions.
struct Refusals {
  static constexpr std::size_t kMostTexts = 256;
  std::uint64_t participants = 0;  ///< Of another session, not authenticated, or with invalid permissions.
  std::uint64_t endpoints = 0;     ///< Of authenticated participants without the right to the topic.
  std::vector<std::string> texts;  ///< For the operator: participant, fault, reason; the first kMostTexts.

  [[nodiscard]] std::uint64_t count() const { return participants + endpoints; }
};

}  // namespace fulcrum::bus
