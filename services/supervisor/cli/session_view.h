// What `status` and `top` show of a running session, gathered from Health alone.
#pragma once

#include <memory>
#include <string>

#include "services/bus/dds/participant.h"
#include "services/supervisor/session_record.h"

namespace fulcrum::supervisor::cli {

class SessionView {
 public:
  explicit SessionView(int domain);

  /// Takes what has come since the last call.
  void Update();
  /// Empty, or why this one and the supervisor do not speak with each other.
  [[nodiscard]] std::string mismatch() const { return participant_.schema_mismatch(); }
  /// True when a supervisor has been heard.
  [[nodiscard]] bool has_supervisor() const { return has_supervisor_; }
  /// Scene, session time, node table, figures.
  [[nodiscard]] std::string Text() const;

 private:
  bus::DdsParticipant participant_;
  std::unique_ptr<bus::Input<Health>> healths_;
  std::unique_ptr<bus::Input<SceneManifest>> manifests_;
  std::array<Health, kNodeCount> newest_{};
  SceneManifest manifest_;
  bool has_supervisor_ = false;
};

}  // namespace fulcrum::supervisor::cli
