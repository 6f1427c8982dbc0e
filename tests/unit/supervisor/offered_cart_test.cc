#include "services/session/supervisor/offered_cart.h"

#include <gtest/gtest.h>

#include "services/base/core/error.h"

namespace fulcrum::supervisor {
namespace {

constexpr std::uint32_t BitOf(NodeId node) { return 1u << static_cast<unsigned>(node); }
constexpr std::uint32_t kDevices = BitOf(NodeId::kHaptics) | BitOf(NodeId::kHandleBridge);
const char* const kFrom = "10.0.0.1";

/// A cart with a path or a device in every possible place.
config::CartConfig FullOfPaths() {
  config::CartConfig cart;
  cart.handles[0].kind = config::LinkKind::kSerial;
  cart.handles[0].link.port = "/dev/ttyUSB0";
  cart.handles[1].kind = config::LinkKind::kSerial;
  cart.handles[1].link.usb_vendor_id = 0x1234;
  cart.handles[1].link.usb_product_id = 0x5678;
  cart.pedal.link.port = "/dev/ttyUSB1";  // Not used by a simulated pedal.
  cart.devices[0].kind = config::DeviceKind::kTouch;
  cart.devices[1].motion = "/home/user/motion.csv";
  cart.security.keys = "/home/user/keys";
  cart.nodes[static_cast<std::size_t>(NodeId::kPhysics)].rate_Hz = 50;
  return cart;
}

link::Offer OfferOf(const OfferedCart& offered) {
  link::Offer offer;
  offer.cart_yaml = config::CartToYaml(offered.cart);
  offer.withheld = offered.withheld;
  offer.nodes = kDevices;
  return offer;
}

std::string RefusalOf(const link::Offer& offer, const std::optional<config::CartConfig>& own) {
  try {
    (void)CartOnHost(offer, kFrom, own);
    return "";
  } catch (const InputError& error) {
    return error.what();
  }
}

TEST(OfferedCart, HasNoPathAndSaysWhatItWithholdsFromTheNodesThere) {
  const OfferedCart offered = CartForHost(FullOfPaths(), kDevices);
  const std::string yaml = config::CartToYaml(offered.cart);
  EXPECT_EQ(yaml.find("/dev"), std::string::npos) << yaml;
  EXPECT_EQ(yaml.find("/home"), std::string::npos) << yaml;
  EXPECT_EQ(offered.withheld, "handles.tool0, handles.tool1, pedal, devices.tool0, devices.tool1.motion");
  // A node for pictures needs none of them.
  const OfferedCart picture = CartForHost(FullOfPaths(), BitOf(NodeId::kRender));
  EXPECT_EQ(picture.withheld, "");
  EXPECT_EQ(config::CartToYaml(picture.cart), yaml);
  EXPECT_EQ(CartForHost(config::CartConfig(), kDevices).withheld, "");
}

TEST(OfferedCart, AHostNeedsItsOwnCartForWhatIsWithheld) {
  const OfferedCart offered = CartForHost(FullOfPaths(), kDevices);
  const std::string refusal = RefusalOf(OfferOf(offered), {});
  EXPECT_NE(refusal.find("devices.tool1.motion"), std::string::npos) << refusal;
  EXPECT_NE(refusal.find("--cart"), std::string::npos) << refusal;
  config::CartConfig own;
  own.handles[0].kind = config::LinkKind::kSerial;
  own.handles[0].link.port = "/dev/ttyACM3";
  own.devices[1].motion = "/srv/motion.csv";
  const config::CartConfig cart = CartOnHost(OfferOf(offered), kFrom, own);
  EXPECT_EQ(cart.handles[0].link.port, "/dev/ttyACM3");
  EXPECT_EQ(cart.devices[1].motion, "/srv/motion.csv");
  EXPECT_EQ(cart.timing(NodeId::kPhysics).rate_Hz, 50) << "the rates come from the session's cart";
}

TEST(OfferedCart, AnOperatorMovesTheToolsWhateverHardwareTheHostHas) {
  config::CartConfig operated, own;
  for (config::DeviceConfig& device : operated.devices) device.kind = config::DeviceKind::kOperator;
  for (config::HandleConfig& handle : operated.handles) handle.kind = config::LinkKind::kOperator;
  operated.pedal.kind = config::LinkKind::kOperator;
  own.devices[0].kind = config::DeviceKind::kTouch;
  own.pedal.kind = config::LinkKind::kSerial;
  own.pedal.link.port = "/dev/ttyACM3";
  link::Offer offer = OfferOf(CartForHost(operated, kDevices));
  for (const std::uint32_t nodes : {kDevices, BitOf(NodeId::kRender), kDevices | BitOf(NodeId::kRender)}) {
    offer.nodes = nodes;
    const config::CartConfig cart = CartOnHost(offer, kFrom, own);
    EXPECT_TRUE(config::IsOperated(cart));
    EXPECT_EQ(config::CartToYaml(cart), config::CartToYaml(operated)) << nodes;
  }
}

TEST(OfferedCart, AHostUsesItsOwnHardwareOnlyForTheNodesThatRunThere) {
  config::CartConfig own;
  own.devices[0].kind = config::DeviceKind::kTouch;
  own.handles[0].kind = config::LinkKind::kButtons;
  link::Offer offer = OfferOf(CartForHost(config::CartConfig(), kDevices));
  for (const bool haptics : {false, true}) {
    offer.nodes = BitOf(haptics ? NodeId::kHaptics : NodeId::kHandleBridge);
    const config::CartConfig cart = CartOnHost(offer, kFrom, own);
    EXPECT_EQ(cart.devices[0].kind == config::DeviceKind::kTouch, haptics);
    EXPECT_EQ(cart.handles[0].kind == config::LinkKind::kButtons, !haptics);
  }
}

TEST(OfferedCart, APathInAReceivedCartIsRefusedWithItsKey) {
  struct Case {
    const char* yaml;
    const char* key;
    bool with_own;  ///< True if it also holds for a host with a cart file of its own.
  };
  for (const Case& bad : {Case{"security: {keys: /etc/ssh}", "security.keys", true},
                          Case{"handles: {tool0: {kind: serial, port: /dev/mem}}", "handles.tool0", false},
                          Case{"handles: {tool1: {port: /etc/passwd}}", "handles.tool1", false},
                          Case{"pedal: {kind: serial, usb_vendor_id: 1, usb_product_id: 2}", "pedal", false},
                          Case{"devices: {tool0: {motion: ../../etc/passwd}}", "devices.tool0.motion", false},
                          Case{"devices: {tool1: {kind: touch}}", "devices.tool1", false}}) {
    link::Offer offer;
    offer.cart_yaml = bad.yaml;
    EXPECT_NE(RefusalOf(offer, {}).find(bad.key), std::string::npos) << bad.yaml << ": " << RefusalOf(offer, {});
    EXPECT_EQ(RefusalOf(offer, config::CartConfig()).empty(), !bad.with_own) << bad.yaml;
  }
}

TEST(OfferedCart, WithoutPathsItIsTheSame) {
  config::CartConfig cart;
  cart.name = "bench";
  cart.devices[0].force_scale = 0.5;
  const link::Offer offer = OfferOf(CartForHost(cart, kDevices));
  EXPECT_EQ(config::CartToYaml(CartOnHost(offer, kFrom, {})), config::CartToYaml(cart));
}

}  // namespace
}  // namespace fulcrum::supervisor
