// The nodes of a session that run on another host, and the link to that host, where `fulcrum host` starts, watches and
// ends them.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "services/session/supervisor/command_desk.h"
#include "services/session/supervisor/session_setup.h"
#include "services/transport/bus/dds/participant.h"
#include "services/transport/link/link.h"

namespace fulcrum::supervisor {

class RemoteNodes {
 public:
  /// Opens the link with an offer of the session and joins it to the bus. Throws InputError.
  /// @param setup must outlive this.
  /// @param participant the supervisor's; must outlive this.
  RemoteNodes(const SessionSetup& setup, bus::DdsParticipant* participant);

  /// Reply to the command to restart a node: no command crosses the link. nullopt: no such node runs there.
  [[nodiscard]] std::optional<CommandAnswer> Restart(const std::string& name) const;

  /// Reason, in one line, why the two sides cannot work together; empty: they can.
  [[nodiscard]] std::string mismatch() { return link_->mismatch(); }
  [[nodiscard]] bus::Refusals refusals() { return link_->refusals(); }
  /// Adds the link's metrics, and last_error where there is none yet.
  void AddTo(Health* health);
  void SendBye() { link_->SendBye(); }

 private:
  const SessionSetup& setup_;
  /// On a secured cart the link needs its own participant: the supervisor's may not publish the remote nodes' topics.
  std::unique_ptr<bus::DdsParticipant> link_bus_;
  std::optional<link::Link> link_;  ///< Declared after the participants, so that its ports are destroyed first.
};

}  // namespace fulcrum::supervisor
