// A spare: a second process of a node that has completed the part of its start that needs no bus, and waits until the
// first process has ended (services/session/supervisor/DESIGN.md). It is started with --spare, and the supervisor
// activates it through its standard input.
#pragma once

#include "services/base/core/messages.h"

namespace fulcrum::app {

/// Gives the process another name until it is activated, so that it is not mistaken for the node. Call first.
void BecomeSpare(NodeId node);

/// Waits for the activation. False if the supervisor has ended or a stop signal has come.
[[nodiscard]] bool WaitUntilNeeded(NodeId node);

}  // namespace fulcrum::app
