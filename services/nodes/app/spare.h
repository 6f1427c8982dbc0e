// A spare: a second process of a node that has made ready what needs no bus, and waits until the first is gone
// (services/session/supervisor/DESIGN.md). It is started with --spare and hears on its standard input that it is
// needed.
#pragma once

#include "services/base/core/messages.h"

namespace fulcrum::app {

/// The process bears another name until it is needed, so that nobody takes it for the node. Call first.
void BecomeSpare(NodeId node);

/// False when it is not needed: its supervisor is gone, or a stop signal has come.
[[nodiscard]] bool WaitUntilNeeded(NodeId node);

}  // namespace fulcrum::app
