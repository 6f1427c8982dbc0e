// A second process of a node that waits to take the place of the first (services/nodes/app/spare.h).
#pragma once

#include "services/session/supervisor/supervised_node.h"

namespace fulcrum::supervisor {

class SpareProcess {
 public:
  /// Throws InputError when the program cannot be started.
  explicit SpareProcess(const NodeCommand& command);
  ~SpareProcess();  ///< Kills one that still waits.
  SpareProcess(const SpareProcess&) = delete;
  SpareProcess& operator=(const SpareProcess&) = delete;

  /// False when it has ended.
  [[nodiscard]] bool IsThere();
  /// Tells it that it is needed; it is the caller's from then on. Also while it is still getting ready: it then goes on
  /// as soon as it is.
  [[nodiscard]] ChildProcess Take();

 private:
  ChildProcess process_;
  int call_ = -1;  ///< Its standard input.
};

}  // namespace fulcrum::supervisor
