// One supervisor per domain on this machine, whoever runs it: two sessions on one bus would mix their samples.
#pragma once

#include <optional>
#include <string>

#include "services/transport/control/control_socket.h"

namespace fulcrum::supervisor {

/// Listens on a name in the abstract socket namespace, which is that of the loopback. The kernel releases it however
/// the process ends, and no file remains. The kernel names the process behind it to everyone who connects.
class DomainGuard {
 public:
  /// Throws InputError when another supervisor holds the domain, with its pid, user and host.
  explicit DomainGuard(int domain);
  ~DomainGuard();
  DomainGuard(const DomainGuard&) = delete;
  DomainGuard& operator=(const DomainGuard&) = delete;

  /// Socket on which members of the cart's group send commands; everyone else is refused there.
  [[nodiscard]] int listening() const { return socket_; }

  /// The process that holds the domain; empty also when that cannot be asked (see Connect).
  [[nodiscard]] static std::optional<control::Caller> Holder(int domain);
  /// True when a supervisor of any user runs in the domain.
  [[nodiscard]] static bool IsTaken(int domain);
  /// True when a supervisor of this user runs in the domain, or one of which the user is not known.
  [[nodiscard]] static bool IsHeld(int domain);
  /// Where another user's supervisor runs in the domain: one line about it, which says how to ask it for its state.
  /// Otherwise empty.
  [[nodiscard]] static std::string OtherUsers(int domain);
  /// Connection to the holder, to be closed by the caller; -1: none holds the domain, or (errno EAGAIN) its queue of
  /// connections is full: a session that is ending accepts none.
  [[nodiscard]] static int Connect(int domain);

 private:
  int socket_;
};

}  // namespace fulcrum::supervisor
