#include "services/session/supervisor/remote_nodes.h"

#include <algorithm>
#include <utility>

#include "services/base/core/error.h"
#include "services/session/supervisor/offered_cart.h"
#include "services/transport/bus/access.h"
#include "services/transport/bus/gate.h"
#include "services/transport/link/health.h"
#include "services/transport/link/options.h"
#include "services/transport/link/scene_transfer.h"

namespace fulcrum::supervisor {
namespace {

bus::FarSettings FarOf(const UpSettings& up) {
  bus::FarSettings far = link::FarSettingsFor(bus::FarSide::kCart, up.peer, up.address, up.link_domain);
  far.keys = up.link_keys;
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
  OfferedCart offered = CartForHost(setup.settings.cart, offer.nodes);
  offer.cart_yaml = config::CartToYaml(offered.cart);
  offer.withheld = std::move(offered.withheld);
  if (!link::IsPlainName(offer.session_id, bus::kMaxSessionId) ||
      !link::IsPlainName(offer.scene_name, bus::kMaxSceneName)) {
    throw InputError("scene \"" + offer.scene_name +
                     "\": a scene on two hosts needs a name of printable ASCII characters without \"/\"");
  }
  return offer;
}

}  // namespace

RemoteNodes::RemoteNodes(const SessionSetup& setup, bus::DdsParticipant* participant) : setup_(setup) {
  link_.emplace(link::LinkSettings{.far = FarOf(setup.settings), .offer = OfferOf(setup), .scene = setup.folder.scene});
  if (const bus::Security security = bus::AnnouncedSecurity(setup.memory, bus::kLinkIdentity); security.on()) {
    link_bus_ = std::make_unique<bus::DdsParticipant>(
        bus::DdsSettings{.domain = setup.settings.cart.domain,
                         .node_name = "link",
                         .shared_memory = setup.memory,
                         .security = security,
                         .tissue_vertices = static_cast<int>(setup.scene.view().rest_position.size())});
    participant = link_bus_.get();
  }
  link_->Join(participant, link_->settings().offer->nodes);
}

std::optional<CommandAnswer> RemoteNodes::Restart(const std::string& name) const {
  const auto node =
      std::find_if(setup_.remote_ids.begin(), setup_.remote_ids.end(), [&](NodeId id) { return name == NodeName(id); });
  if (node == setup_.remote_ids.end()) return std::nullopt;
  return CommandAnswer{false, name + " runs on the host " + setup_.settings.peer +
                                  ", and no command crosses the link: run fulcrum restart " + name + " there"};
}

void RemoteNodes::AddTo(Health* health) { link::FillHealth(link_->status(), health); }

}  // namespace fulcrum::supervisor
