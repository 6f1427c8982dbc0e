// A second process of a node that is started ahead of time and replaces the first after its death
// (services/nodes/app/spare.h).
#pragma once

#include "services/session/supervisor/supervised_node.h"

namespace fulcrum::supervisor {

class SpareProcess {
 public:
  /// Throws InputError when the program cannot be started.
  explicit SpareProcess(const NodeCommand& command);
  ~SpareProcess();  ///< Kills the process unless it was taken.
  SpareProcess(const SpareProcess&) = delete;
  SpareProcess& operator=(const SpareProcess&) = delete;

  /// False when the process has ended.
  [[nodiscard]] bool IsThere();
  /// Signals the spare to become the node and hands its process to the caller. A spare that is still preparing its
  /// start becomes the node as soon as it is ready.
  [[nodiscard]] runtime::ChildProcess Take();

 private:
  runtime::ChildProcess process_;
  int call_ = -1;  ///< Its standard input.
};

}  // namespace fulcrum::supervisor
