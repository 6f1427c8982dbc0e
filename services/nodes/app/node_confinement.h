// What each node may still do once it has read its options: services/base/runtime/confinement.h.
#pragma once

#include <optional>

#include "services/base/config/cart.h"
#include "services/base/core/messages.h"
#include "services/base/runtime/confinement.h"
#include "services/nodes/app/node_app.h"

namespace fulcrum::app {

/// Where the node writes; nullopt: it runs a driver of somebody else, whose files are not known.
[[nodiscard]] std::optional<runtime::WritablePlaces> WritablePlacesOf(NodeId node, const NodeOptions& options,
                                                                      const config::CartConfig& cart);

/// Confines this process as `node`, before other threads exist. Logs what could not be had; that ends no node.
void ConfineNode(NodeId node, const NodeOptions& options, const config::CartConfig& cart);

}  // namespace fulcrum::app
