// What each node may still do once it has read its options: services/base/runtime/confinement.h.
#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include "services/base/config/cart.h"
#include "services/base/core/messages.h"
#include "services/base/runtime/confinement.h"
#include "services/nodes/app/node_app.h"

namespace fulcrum::app {

/// Where the node writes; nullopt: it runs a driver of somebody else, whose files are not known.
[[nodiscard]] std::optional<runtime::WritablePlaces> WritablePlacesOf(NodeId node, const NodeOptions& options,
                                                                      const config::CartConfig& cart);

/// Files and folders of graphics processors: those of the direct rendering manager, of NVIDIA's driver, whichever
/// number a container or the machine gave them, and of WSL. @param devices "/dev".
[[nodiscard]] std::vector<std::filesystem::path> GraphicsDevices(const std::filesystem::path& devices);

/// Confines this process as render_node is in a session, where a device that is closed to it does not draw: for its
/// answer to `fulcrum doctor`.
void ConfineGraphics();

/// Confines this process as `node`, before other threads exist. Logs what could not be had; that ends no node.
void ConfineNode(NodeId node, const NodeOptions& options, const config::CartConfig& cart);

}  // namespace fulcrum::app
