// link_node: the cart's end of the link to another host, on which some of its nodes run (`fulcrum host` is the other).
#include <chrono>
#include <cstdlib>
#include <fstream>
#include <sstream>
#include <thread>

#include "services/app/node_app.h"
#include "services/core/error.h"
#include "services/link/health.h"
#include "services/link/link.h"
#include "services/link/options.h"
#include "services/runtime/realtime.h"

namespace {

namespace fs = std::filesystem;
using fulcrum::InputError;

int Number(const std::string& option, const std::string& text, int least, int most) {
  char* end = nullptr;
  const long value = std::strtol(text.c_str(), &end, 10);
  if (text.empty() || *end != '\0' || value < least || value > most) {
    throw InputError(option + " " + text + ": must be " + std::to_string(least) + " to " + std::to_string(most));
  }
  return static_cast<int>(value);
}

fulcrum::link::Offer OfferOf(fulcrum::app::NodeApp* app, std::uint32_t nodes) {
  const fulcrum::link::FileFacts facts = fulcrum::link::FactsOf(app->options().scene);
  fulcrum::link::Offer offer;
  offer.session_id = fs::absolute(app->options().session).lexically_normal().filename();
  offer.scene_name = app->scene().name;
  offer.scene_hash = app->scene().hash;
  offer.scene_B = facts.size_B;
  offer.scene_checksum = facts.checksum;
  offer.nodes = nodes;
  offer.cart_yaml = fulcrum::config::CartToYaml(app->cart());
  return offer;
}

/// Whether the supervisor ends the session, and not merely this process.
bool SessionEnds(fulcrum::bus::Input<fulcrum::Health>* healths) {
  constexpr auto kLongest = std::chrono::milliseconds(400);
  const auto end = std::chrono::steady_clock::now() + kLongest;
  fulcrum::Health health;
  do {
    while (healths->TakeNext(&health)) {
      if (health.node == fulcrum::NodeId::kSupervisor && health.state == fulcrum::HealthState::kStopping) return true;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  } while (std::chrono::steady_clock::now() < end);
  return false;
}

fulcrum::ExitCode RunLink(fulcrum::app::NodeApp& app) {
  const std::string peer = app.options().TakeValue("--peer", "");
  if (peer.empty()) throw InputError("--peer: which host runs the other nodes?");
  // What the scene does not name is not started.
  const std::uint32_t nodes =
      fulcrum::link::NodesFromNames(app.options().TakeValue("--remote", "")) & app.scene().node_mask;
  if (nodes == 0) throw InputError("--remote: none of these nodes is of this scene");
  const std::string address = app.options().TakeValue("--address", "");
  const int link_domain = Number("--link-domain", app.options().TakeValue("--link-domain", "0"), 0, 200);
  fulcrum::link::LinkSettings settings;
  settings.far =
      fulcrum::link::FarSettingsFor(fulcrum::bus::FarSide::kCart, peer, address, app.options().domain, link_domain);
  settings.picture_rate_Hz = Number("--picture-rate", app.options().TakeValue("--picture-rate", "30"), 1, 100);
  settings.offer = OfferOf(&app, nodes);
  settings.scene = app.options().scene;
  const auto healths = app.bus().MakeInput<fulcrum::Health>();
  fulcrum::link::Link link(settings);
  link.Join(&app.bus(), nodes);
  fulcrum::runtime::Log(fulcrum::runtime::LogLevel::kInfo,
                        fulcrum::link::NamesOfNodes(nodes) + " on " + peer + ", reached from " + settings.far.address);
  const fulcrum::ExitCode code = app.Run(
      app.timing(),
      [&](const fulcrum::Tick&) {
        if (const std::string mismatch = link.mismatch(); !mismatch.empty()) {
          app.Finish(fulcrum::ExitCode::kMismatch, mismatch);
        }
      },
      [&](fulcrum::Health* health) { fulcrum::link::FillHealth(link.status(), health); });
  if (SessionEnds(healths.get())) {
    link.SayBye();
    // A few pulses: one may be lost.
    std::this_thread::sleep_for(std::chrono::milliseconds(300));
  }
  return code;
}

}  // namespace

int main(int argc, char** argv) {
  return fulcrum::app::NodeMain(
      argc, argv, fulcrum::NodeId::kLink,
      "The cart's end of the link to another host, which runs `fulcrum host`.\n"
      "  --peer ADDR          the other host\n"
      "  --remote NODE,...    nodes that run there\n"
      "  --address ADDR       own address towards it (default: of the interface that leads there)\n"
      "  --link-domain N      101 to 200 (default: 100 more than --domain), the same on both hosts\n"
      "  --picture-rate HZ    of the tissue on its way there, 1 to 100 (default: 30)\n",
      RunLink);
}
