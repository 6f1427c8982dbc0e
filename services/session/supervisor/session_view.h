// A running session as seen from outside, collected from Health and SceneManifest: for `status`, `top` and the console.
#pragma once

#include <memory>
#include <string>
#include <string_view>

#include "services/session/supervisor/session_record.h"
#include "services/transport/bus/dds/participant.h"

namespace fulcrum::supervisor {

/// A node is silent after this time without Health [ns].
inline constexpr std::int64_t kSilence_ns = 1'000'000'000;

/// A metric by name; `missing` when the node does not report it.
[[nodiscard]] double MetricOf(const Health& health, std::string_view name, double missing = 0);
/// Samples lost, refused at the gate or not written.
[[nodiscard]] std::uint64_t DropsOf(const Health& health);

/// Secret number of the session of this user that runs in the domain; 0: none, or it has not opened its bus yet.
[[nodiscard]] std::uint64_t RunningSession(int domain);

class SessionView {
 public:
  /// @param identity whose rights the view has on a bus with keys.
  explicit SessionView(int domain, std::string_view identity = bus::kToolIdentity);

  /// Reads all samples that have arrived since the last call.
  void Update();
  /// Reason why this program and the supervisor cannot exchange samples; empty: they can.
  [[nodiscard]] std::string mismatch() const { return participant_.schema_mismatch(); }
  /// True when a Health of a supervisor has arrived.
  [[nodiscard]] bool has_supervisor() const { return has_supervisor_; }
  /// Number of nodes whose Health has arrived.
  [[nodiscard]] int heard() const;
  /// Text with scene, session time, node table and figures.
  [[nodiscard]] std::string Text() const;

  /// Newest Health of a node; pid 0: none has arrived.
  [[nodiscard]] const Health& health(NodeId node) const { return newest_[static_cast<std::size_t>(node)]; }
  [[nodiscard]] const SceneManifest& manifest() const { return manifest_; }
  /// The participant, for further ports of the caller.
  [[nodiscard]] bus::DdsParticipant& participant() { return participant_; }

 private:
  bus::DdsParticipant participant_;
  std::unique_ptr<bus::Input<Health>> healths_;
  std::unique_ptr<bus::Input<SceneManifest>> manifests_;
  std::array<Health, kNodeCount> newest_{};
  SceneManifest manifest_;
  bool has_supervisor_ = false;
};

}  // namespace fulcrum::supervisor
