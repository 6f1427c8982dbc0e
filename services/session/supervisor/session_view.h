// What is seen of a running session from outside, gathered from Health alone: for `status`, `top` and the console.
#pragma once

#include <memory>
#include <string>
#include <string_view>

#include "services/session/supervisor/session_record.h"
#include "services/transport/bus/dds/participant.h"

namespace fulcrum::supervisor {

/// A node that has not been heard for so long is silent [ns].
inline constexpr std::int64_t kSilence_ns = 1'000'000'000;

/// A metric by name; `missing` when the node does not report it.
[[nodiscard]] double MetricOf(const Health& health, std::string_view name, double missing = 0);
/// Samples lost, refused at the gate or not written.
[[nodiscard]] std::uint64_t DropsOf(const Health& health);

class SessionView {
 public:
  explicit SessionView(int domain);

  /// Takes what has come since the last call.
  void Update();
  /// Empty, or why this one and the supervisor do not speak with each other.
  [[nodiscard]] std::string mismatch() const { return participant_.schema_mismatch(); }
  /// True when a supervisor has been heard.
  [[nodiscard]] bool has_supervisor() const { return has_supervisor_; }
  /// How many nodes have been heard.
  [[nodiscard]] int heard() const;
  /// Scene, session time, node table, figures.
  [[nodiscard]] std::string Text() const;

  /// Newest of a node; pid 0: never heard.
  [[nodiscard]] const Health& health(NodeId node) const { return newest_[static_cast<std::size_t>(node)]; }
  [[nodiscard]] const SceneManifest& manifest() const { return manifest_; }
  /// For a port of the caller's own.
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
