#include "services/session/supervisor/remote_nodes.h"

#include <algorithm>

#include "services/nodes/app/cart_security.h"
#include "services/transport/bus/access.h"
#include "services/transport/link/health.h"
#include "services/transport/link/options.h"
#include "services/transport/link/scene_transfer.h"

namespace fulcrum::supervisor {
namespace {

bus::FarSettings FarOf(const UpSettings& up) {
  bus::FarSettings far = link::FarSettingsFor(bus::FarSide::kCart, up.peer, up.address, up.cart.domain, up.link_domain);
  far.keys = up.cart.security.keys;
  return far;
}

/// The data that the other host needs to run its nodes.
link::Offer OfferOf(const SessionSetup& setup) {
  const link::FileFacts facts = link::FactsOf(setup.folder.scene);
  link::Offer offer;
  offer.session_id = setup.folder.session_id;
  offer.scene_name = setup.scene.view().name;
  offer.scene_hash = setup.scene.view().hash;
  offer.scene_B = facts.size_B;
  offer.scene_checksum = facts.checksum;
  for (const NodeId node : setup.remote_ids) offer.nodes |= 1u << static_cast<unsigned>(node);
  offer.cart_yaml = config::CartToYaml(setup.settings.cart);
  return offer;
}

}  // namespace

RemoteNodes::RemoteNodes(const SessionSetup& setup, bus::DdsParticipant* participant) : setup_(setup) {
  const config::CartConfig& cart = setup.settings.cart;
  link_.emplace(link::LinkSettings{.far = FarOf(setup.settings), .offer = OfferOf(setup), .scene = setup.folder.scene});
  if (!cart.security.keys.empty()) {
    link_bus_ =
        std::make_unique<bus::DdsParticipant>(bus::DdsSettings{.domain = cart.domain,
                                                               .node_name = "link",
                                                               .shared_memory = setup.memory,
                                                               .security = app::SecurityOf(cart, bus::kLinkIdentity)});
    participant = link_bus_.get();
  }
  link_->Join(participant, link_->settings().offer->nodes);
}

std::optional<CommandAnswer> RemoteNodes::Restart(const std::string& name) const {
  const auto node =
      std::find_if(setup_.remote_ids.begin(), setup_.remote_ids.end(), [&](NodeId id) { return name == NodeName(id); });
  if (node == setup_.remote_ids.end()) return std::nullopt;
  return CommandAnswer{false, name + " runs on " + setup_.settings.peer + ": restart it there (fulcrum restart " +
                                  name + "); no command travels to another host"};
}

void RemoteNodes::AddTo(Health* health) { link::FillHealth(link_->status(), health); }

}  // namespace fulcrum::supervisor
