#include "services/base/config/cart.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "services/base/config/operation.h"
#include "services/base/core/error.h"

namespace fulcrum::config {
namespace {

std::string Refusal(const std::string& text) {
  try {
    static_cast<void>(LoadCartText(text, "cart.yaml"));
  } catch (const InputError& e) {
    return e.what();
  }
  return "accepted";
}

TEST(Cart, EveryShippedFileLoads) {
  int files = 0;
  for (const auto& entry : std::filesystem::directory_iterator(FULCRUM_SOURCE_DIR "/deploy/carts")) {
    const CartConfig cart = LoadCart(entry.path());
    EXPECT_EQ(cart.name, entry.path().stem().string());
    ++files;
  }
  EXPECT_GE(files, 3);
}

TEST(Cart, SimulatedFileIsTheDefault) {
  const CartConfig cart = LoadCart(FULCRUM_SOURCE_DIR "/deploy/carts/simulated.yaml");
  EXPECT_EQ(CartToYaml(cart), CartToYaml(CartConfig()));
  EXPECT_EQ(cart.timing(NodeId::kHandleBridge).rate_Hz, 400);
  EXPECT_EQ(cart.timing(NodeId::kHaptics).rate_Hz, 1000);
}

TEST(Cart, LabFileNamesThreeSerialLinks) {
  const CartConfig cart = LoadCart(FULCRUM_SOURCE_DIR "/deploy/carts/lab.yaml");
  EXPECT_EQ(cart.handles[0].kind, LinkKind::kSerial);
  EXPECT_EQ(cart.handles[1].kind, LinkKind::kSerial);
  EXPECT_EQ(cart.pedal.kind, LinkKind::kSerial);
  EXPECT_NE(cart.handles[0].link.port, cart.handles[1].link.port);
  EXPECT_NEAR(cart.timing(NodeId::kHaptics).spin_s, 100e-6, 1e-12);
}

TEST(Cart, TouchFileNamesTwoDevices) {
  const CartConfig cart = LoadCart(FULCRUM_SOURCE_DIR "/deploy/carts/touch.yaml");
  EXPECT_EQ(cart.devices[0].kind, DeviceKind::kTouch);
  EXPECT_EQ(cart.devices[1].kind, DeviceKind::kTouch);
  EXPECT_NE(cart.devices[0].serial, cart.devices[1].serial);
}

TEST(Cart, AScriptMovesSimulatedDevicesWhateverTheCartHas) {
  CartConfig cart = LoadCart(FULCRUM_SOURCE_DIR "/deploy/carts/touch.yaml");
  std::array<ToolDescription, kMaxTools> tools;
  EXPECT_TRUE(HasTouch(cart));
  EXPECT_FALSE(MovedByPerson(cart, tools)) << "the scene has no tools";
  tools[1].kind = ToolKind::kHook;
  EXPECT_TRUE(MovedByPerson(cart, tools));
  const int domain = cart.domain;
  LetScriptMove(&cart);
  EXPECT_FALSE(HasTouch(cart));
  EXPECT_FALSE(MovedByPerson(cart, tools));
  EXPECT_EQ(cart.handles[0].kind, LinkKind::kSimulated);
  EXPECT_EQ(cart.pedal.kind, LinkKind::kSimulated);
  EXPECT_EQ(cart.domain, domain);
}

TEST(Cart, AssignsAxesAndButtonsOfAGamepadByName) {
  const CartConfig cart = LoadCartText(
      "inputs: {gamepad: {speed_mm_s: 80, motion: {up: -left_y}, buttons: {cut: a, jaw: right_trigger}},\n"
      "         space_mouse: {motion: {along: -turn_x}, buttons: {jaw: none}}}",
      "cart.yaml");
  const PadSettings& pad = cart.inputs.gamepad;
  EXPECT_FLOAT_EQ(pad.speed_m_s, 0.08f);
  EXPECT_EQ(pad.motion[0], PadDirection{PadAxis::kLeftX});
  EXPECT_EQ(pad.motion[1], (PadDirection{PadAxis::kLeftY, -1}));
  EXPECT_EQ(pad.buttons[static_cast<std::size_t>(PadAction::kCut)], PadButton::kA);
  EXPECT_EQ(pad.buttons[static_cast<std::size_t>(PadAction::kCoag)], PadButton::kLeftTrigger);
  EXPECT_EQ(cart.inputs.space_mouse.motion[2], (PadDirection{PadAxis::kTurnX, -1}));
  EXPECT_EQ(cart.inputs.space_mouse.buttons[static_cast<std::size_t>(PadAction::kJaw)], std::nullopt);
  const std::string yaml = CartToYaml(cart);
  EXPECT_EQ(CartToYaml(LoadCartText(yaml, "effective")), yaml);
}

TEST(Cart, MotionFileIsFoundFromTheCartsFolder) {
  const auto folder = std::filesystem::temp_directory_path();
  const auto file = folder / ("cart_test." + std::to_string(::getpid()) + ".yaml");
  std::ofstream(file) << "devices: {tool0: {motion: hands/left.csv}, tool1: {motion: /right.csv}}\n";
  const CartConfig cart = LoadCart(file);
  std::filesystem::remove(file);
  EXPECT_EQ(cart.devices[0].motion, (folder / "hands/left.csv").string());
  EXPECT_EQ(cart.devices[1].motion, "/right.csv");
}

TEST(Cart, InADeepFolderItsEffectiveConfigurationLoadsToItself) {
  const auto root = std::filesystem::temp_directory_path() / ("cart_test." + std::to_string(::getpid()));
  std::filesystem::path folder = root;
  for (const char c : {'a', 'b', 'c', 'd', 'e', 'f'}) folder /= std::string(60, c);
  std::filesystem::create_directories(folder);
  std::ofstream(folder / "cart.yaml") << "security: {keys: keys}\nbuilds: builds\ndevices: {tool0: {motion: a.csv}}\n";
  const CartConfig cart = LoadCart(folder / "cart.yaml");
  std::filesystem::remove_all(root);
  EXPECT_EQ(cart.security.keys, (folder / "keys").string());
  const std::string yaml = CartToYaml(cart);
  EXPECT_EQ(CartToYaml(LoadCartText(yaml, "again")), yaml);
}

TEST(Cart, EffectiveConfigurationLoadsToItself) {
  CartConfig cart = LoadCart(FULCRUM_SOURCE_DIR "/deploy/carts/lab.yaml");
  cart.handles[0].simulated.protocol = LineProtocol::kFramed;
  cart.handles[0].simulated.bow = 0.03;
  cart.handles[0].simulated.unplugged_s = {5, 6.5, 8, 9};
  cart.pedal.simulated.drop = 1e-3;
  cart.handles[0].calibration.volts = {2.3, 2.4, 2.55};
  cart.handles[0].calibration.angles_rad = {1.0, 0.5, 0.0};
  cart.devices[0].kind = DeviceKind::kTouch;
  cart.devices[0].name = "Left";
  cart.devices[0].serial = "0042";
  cart.devices[0].force_scale = 0.5;
  cart.devices[0].workspace = {Vec3d(0.1, -0.2, 0.3), Vec3d(0.01, 0.02, -0.03), 1.5};
  cart.devices[1].hand = HandHold::kFirmGrip;
  const std::string yaml = CartToYaml(cart);
  EXPECT_EQ(LoadCartText(yaml, "again").devices[0].serial, "0042");
  EXPECT_EQ(CartToYaml(LoadCartText(yaml, "again")), yaml) << yaml;
  const CartConfig again = LoadCartText(yaml, "again");
  EXPECT_EQ(again.handles[0].simulated.protocol, LineProtocol::kFramed);
  EXPECT_NEAR(again.handles[0].simulated.bow, 0.03, 1e-12);
  EXPECT_EQ(again.handles[0].simulated.unplugged_s, (std::vector<double>{5, 6.5, 8, 9}));
  EXPECT_EQ(again.handles[1].hand, Hand::kRight);
  EXPECT_EQ(again.pedal.simulated.drop, 1e-3);
}

struct BadCart {
  const char* rule;
  const char* text;
  const char* said;
};

class RefusedCart : public ::testing::TestWithParam<BadCart> {};

TEST_P(RefusedCart, SaysFileFieldAndValidRange) {
  const std::string said = Refusal(GetParam().text);
  EXPECT_EQ(said.rfind("cart.yaml", 0), 0u) << said;
  EXPECT_NE(said.find(GetParam().said), std::string::npos) << said;
}

const BadCart kBadCarts[] = {
    {"DomainZero", "domain: 0", "domain: '0' is not valid; valid: an integer from 1 to 100"},
    {"DomainAbove", "domain: 101", "1 to 100"},
    {"UnknownButton", "handles: {tool0: {kind: buttons, button: 9}}", "handles.tool0.button"},
    {"ButtonOfUnknownTool", "pedal: {kind: buttons, cut: {tool: 4}}", "pedal.cut.tool"},
    {"UnknownTool", "handles: {tool4: {kind: simulated}}", "handles.tool4: unknown key"},
    {"UnknownLinkKind", "handles: {tool0: {kind: usb}}", "valid: none, simulated, serial, operator"},
    {"UnknownDevice", "devices: {tool0: {kind: omega}}", "valid: none, simulated, touch, operator"},
    {"UnknownHandHold", "devices: {tool0: {hand: fist}}", "valid: scene, fingertip, light_grip, firm_grip"},
    {"ForceScale", "devices: {tool0: {force_scale: 1.5}}", "valid: 0 to 1"},
    {"WorkspaceScale", "devices: {tool0: {workspace: {scale: 0}}}", "valid: 0.1 to 10"},
    {"WorkspaceUnit", "devices: {tool0: {workspace: {trocar_mm: [0, 10 deg, 0]}}}", "has the wrong unit"},
    {"WorkspaceTrocar", "devices: {tool0: {workspace: {trocar_mm: [0, 2000, 0]}}}", "valid: -1000 to 1000 mm"},
    {"TooStiff", "devices: {tool1: {force_scale: 0.8, workspace: {scale: 2}}}",
     "devices.tool1: force_scale 0.800000 times workspace.scale 2.000000 makes contacts stiffer"},
    {"MotionOfATouch", "devices: {tool0: {kind: touch, motion: a.csv}}", "devices.tool0.motion: only a simulated"},
    {"SameTouchTwice", "devices: {tool0: {kind: touch}, tool1: {kind: touch}}",
     "devices.tool1.name: 'Default Device' is given to two tools"},
    {"SameSerialTwice",
     "devices: {tool0: {kind: touch, name: a, serial: \"1\"}, tool1: {kind: touch, name: b, serial: \"1\"}}",
     "devices.tool1.serial: '1' is given to two tools"},
    {"OneSerialOnly", "devices: {tool0: {kind: touch, name: a, serial: \"1\"}, tool1: {kind: touch, name: b}}",
     "devices.tool1.serial: one Touch has a serial number"},
    {"SerialWithoutPort", "handles: {tool0: {kind: serial}}", "handles.tool0: kind is serial, but neither"},
    {"PedalWithoutPort", "pedal: {kind: serial}", "pedal: kind is serial, but neither"},
    {"OddBaud", "handles: {tool0: {kind: serial, port: /dev/ttyUSB0, baud: 100000}}", "100000 is not a usual speed"},
    {"SharedPort", "handles: {tool0: {kind: serial, port: /dev/a}, tool1: {kind: serial, port: /dev/a}}",
     "handles.tool1.port: '/dev/a' is given to two links"},
    {"CalibrationLengths", "handles: {tool0: {calibration: {points_V: [2.3, 2.4, 2.5]}}}", "the same number, 2 to 9"},
    {"CalibrationOrder", "handles: {tool0: {calibration: {points_V: [2.5, 2.3]}}}", "must exceed the one before"},
    {"CalibrationNotMonotone", "handles: {tool0: {calibration: {points_V: [2.3, 2.4, 2.5], angles_deg: [0, 30, 20]}}}",
     "breaks the order"},
    {"CalibrationUnit", "handles: {tool0: {calibration: {adc_step_V: 4.88 mm}}}", "has the wrong unit"},
    {"UnknownHand", "handles: {tool0: {hand: both}}", "valid: left, right"},
    {"UnknownProtocol", "handles: {tool0: {simulated: {protocol: nmea}}}", "valid: plain, framed"},
    {"DropAbove", "handles: {tool0: {simulated: {drop: 0.9}}}", "valid: 0 to 0.5"},
    {"HalfWindow", "handles: {tool0: {simulated: {unplugged_s: [5]}}}", "a list of pairs"},
    {"WindowBackwards", "pedal: {simulated: {silent_s: [5, 4]}}", "a list of pairs"},
    {"PedalWithPotentiometer", "pedal: {simulated: {broken_wire_s: [1, 2]}}", "unknown key"},
    {"RateZero", "nodes: {physics_node: {rate_Hz: 0}}",
     "nodes.physics_node.rate_Hz: '0' is out of range; valid: 1 to 4000 Hz"},
    {"RateAtWhichAPedalGivesCurrentHalfOfTheTime", "nodes: {handle_bridge: {rate_Hz: 5}}",
     "nodes.handle_bridge.rate_Hz: '5' is out of range; valid: 25 to 4000 Hz"},
    {"UnknownNode", "nodes: {physic_node: {rate_Hz: 100}}", "did you mean 'physics_node'?"},
    {"Priority", "nodes: {physics_node: {fifo_priority: 100}}", "an integer from 0 to 99"},
    {"Cpu", "nodes: {physics_node: {cpu: -2}}", "an integer from -1 to 1023"},
    {"Threads", "nodes: {physics_node: {threads: 17}}", "an integer from 1 to 16"},
    {"ThreadsElsewhere", "nodes: {thermal_node: {threads: 2}}", "threads"},
    {"Spin", "nodes: {physics_node: {spin_us: 1000}}", "valid: 0 to 500 us"},
    {"PadSpeed", "inputs: {gamepad: {speed_mm_s: 0}}",
     "inputs.gamepad.speed_mm_s: '0' is out of range; valid: 1 to 500"},
    {"PadDeadZone", "inputs: {gamepad: {dead_zone_percent: 95}}", "valid: 0 to 90 %"},
    {"PadAxis", "inputs: {gamepad: {motion: {up: left_z}}}", "valid: none, left_x, -left_x, left_y"},
    {"PadAxisOfASpaceMouse", "inputs: {gamepad: {motion: {up: turn_x}}}", "valid: none, left_x"},
    {"PadButton", "inputs: {gamepad: {buttons: {cut: r2}}}", "valid: none, a, b, x, y, back"},
    {"PadAction", "inputs: {gamepad: {buttons: {fire: a}}}", "inputs.gamepad.buttons.fire: unknown key"},
    {"PadButtonTwice", "inputs: {gamepad: {buttons: {cut: a}}}", "inputs.gamepad.buttons.cut: button a also does jaw"},
    {"PadRumble", "inputs: {gamepad: {rumble_from_N: 4}}", "rumble_full_N must be above rumble_from_N"},
    {"SpaceMouseButton", "inputs: {space_mouse: {buttons: {cut: a}}}", "valid: none, first, second"},
    {"SpaceMouseRumble", "inputs: {space_mouse: {rumble_from_N: 1}}", "unknown key"},
};

INSTANTIATE_TEST_SUITE_P(Rules, RefusedCart, ::testing::ValuesIn(kBadCarts),
                         [](const auto& test) { return test.param.rule; });

TEST(Cart, ValidateChecksAStructThatNoFileProduced) {
  CartConfig cart;
  EXPECT_NO_THROW(Validate(cart));
  cart.domain = 200;
  EXPECT_THROW(Validate(cart), InputError);
}

}  // namespace
}  // namespace fulcrum::config
