// The cart: what hardware (or simulation of it) is attached, and at which rate and priority each node runs.
// Files: deploy/carts/*.yaml, documented there.
#pragma once

#include <array>
#include <filesystem>
#include <numbers>
#include <string>
#include <vector>

#include "services/base/config/strict_yaml.h"
#include "services/base/core/messages.h"
#include "services/base/core/pad_hands.h"

namespace fulcrum::config {

/// kButtons: the buttons of the haptic devices.
enum class LinkKind { kNone, kSimulated, kSerial, kOperator, kButtons };

/// Place and speed of a serial line; the format is 8N1 without flow control.
struct SerialLink {
  std::string port;  ///< "/dev/ttyUSB0", better "/dev/serial/by-path/…"; empty: found by USB identity.
  /// 0: not given. With vendor, product and serial number the device is found again on another socket.
  int usb_vendor_id = 0;
  int usb_product_id = 0;
  std::string usb_serial;  ///< Empty: any.
  int baud = 115200;
};

/// Jaw angle as a function of the voltage that the handle's converter reports: monotone, through 2 to 9 points.
/// Default: the paper's linear relation, 2.37 to 2.54 V for 0 to 60 degrees.
struct JawCalibration {
  /// Volt per count of the 10-bit converter: 5 V / 1024. The paper rounds it to 0.00488; its lines (2.4512 is count
  /// 502) show the exact step.
  double adc_step_V = 5.0 / 1024;
  std::vector<double> volts = {2.37, 2.54};
  std::vector<double> angles_rad = {0.0, 1.0471975511965976};
};

/// Line format of a handle or pedal. The bridge detects it; for simulated firmware it is configured.
enum class LineProtocol { kPlain, kFramed };

/// A simulated handle or pedal: its properties and its faults. Time windows are pairs (from, to, from, to, …) of
/// session time [s]; the keys of the jaw are for handles only.
struct SimulatedUnit {
  LineProtocol protocol = LineProtocol::kPlain;
  double closed_V = 2.37, open_V = 2.54;  ///< At 0 and 60 degrees.
  double bow = 0;                         ///< Excess of the voltage in the middle, as a share of the span.
  double noise_V = 0.001;                 ///< Standard deviation.
  double tremor_rad = 0;                  ///< Amplitude.
  double drop = 0, flip = 0;              ///< Probabilities that a byte is lost and that it has a flipped bit.
  std::vector<double> silent_s, garbage_s, wrong_baud_s, broken_wire_s, unplugged_s;
};

enum class Hand { kLeft, kRight };

/// A button of a haptic device.
struct ToolButton {
  int tool = 0;
  int button = 0;  ///< From 1, the one nearest to the tip; 0: none.
};

/// One handle; its index in CartConfig::handles is the tool that it operates.
struct HandleConfig {
  LinkKind kind = LinkKind::kNone;
  SerialLink link;          ///< For kSerial.
  SimulatedUnit simulated;  ///< For kSimulated.
  Hand hand = Hand::kLeft;  ///< Hand whose frames are accepted; a plain line does not contain it. Tool 1: right.
  /// For kButtons, and for kSerial while the handle is not there and the tool's device is a Touch: the button of that
  /// device, from 1, which closes the jaw; 0: none.
  int button = 1;
  JawCalibration calibration;  ///< Used unless `handle_bridge calibrate` has stored a calibration for the unit.
};

struct PedalConfig {
  LinkKind kind = LinkKind::kNone;
  SerialLink link;          ///< For kSerial.
  SimulatedUnit simulated;  ///< For kSimulated.
  /// For kButtons, and for kSerial while the pedal is not there and the cart has a Touch.
  ToolButton cut{1, 2}, coag{0, 2};
};

/// Power setting of the generator's panel at the start of a session, by mode [W].
struct GeneratorConfig {
  float cut_W = 35;
  float coag_W = 35;
  float blend_W = 35;
};

enum class DeviceKind { kNone, kSimulated, kTouch, kOperator };

/// The hand that holds a simulated device: the one of the scene, or one of three standard hands.
enum class HandHold { kScene, kFingertip, kLightGrip, kFirmGrip };

/// Placement of the frame D of a device in the world: p_W = trocar_W + scale R_WD (p_D - trocar_D). For the Touch, D
/// has x to the right, y up and z towards the operator.
struct WorkspaceConfig {
  /// Rotations about the fixed axes x, y, z, in this order [rad]. Default: the device stands on a table, world z is up
  /// and the operator looks along world y.
  Vec3d rotation_rad{std::numbers::pi / 2, 0, 0};
  /// Trocar in D [m]; used unless `haptics_node calibrate-trocar` has stored a better one.
  Vec3d trocar_D{0, -0.1, -0.1};
  double scale = 1;  ///< Motion of the tool per motion of the hand.
};

/// One haptic device; its index in CartConfig::devices is the tool that it operates.
struct DeviceConfig {
  DeviceKind kind = DeviceKind::kNone;
  std::string name = "Default Device";  ///< For kTouch: as in the Touch's setup program.
  std::string serial;                   ///< For kTouch; empty: any device with that name.
  double force_scale = 1;               ///< Share of the servo's force that the device applies, 0 to 1.
  WorkspaceConfig workspace;            ///< For kTouch and for recorded motion.
  HandHold hand = HandHold::kScene;     ///< For kSimulated and kOperator.
  std::string motion;                   ///< For kSimulated: file of recorded poses; empty: the scene's script.
};

/// Scheduling of a node's cyclic thread.
struct NodeTiming {
  double rate_Hz = 100;
  int fifo_priority = 0;  ///< 1 to 99: SCHED_FIFO when permitted; 0: normal scheduling.
  int cpu = -1;           ///< CPU to which the thread is pinned; -1: any.
  double spin_s = 0;      ///< Longest time that the thread spins before a period.
  int threads = 1;        ///< Threads that share the work of a period; physics_node only.
};

/// Access to the session's bus: services/transport/bus/DESIGN.md.
struct SecurityConfig {
  std::string keys;      ///< Folder made by `fulcrum keys init`; empty: each session makes its own.
  bool encrypt = false;  ///< Encrypts all datagrams.
  std::string group;     ///< Group whose members may send commands to a session; empty: its user only.
};

/// Domain of a cart that names none: differs between users, so that two of them do not meet on one bus.
[[nodiscard]] int DefaultDomain();

/// What a session may suffer and still be called well.
inline constexpr int kMostRestarts = 1'000'000;
struct VerdictConfig {
  int restarts = 3;  ///< Deaths of one node after which it was started again.
};

/// What a recording may take of its disk.
struct RecorderConfig {
  double keep_free_MB = 500;  ///< Free space that a recording leaves: it ends in order before [10^6 B].
};

struct CartConfig;
/// True if an operator's input moves a tool of the cart, a handle or the pedal (kind: operator).
[[nodiscard]] bool IsOperated(const CartConfig& cart);

struct CartConfig {
  std::string name = "simulated";
  int domain = DefaultDomain();  ///< DDS domain, 1 to 100.
  std::string builds;  ///< Folder whose subfolders NAME/bin have builds for `fulcrum swap --build NAME`; empty: none.
  std::array<HandleConfig, kMaxTools> handles;
  PedalConfig pedal;
  GeneratorConfig generator;
  std::array<DeviceConfig, kMaxTools> devices;  ///< By tool.
  std::array<NodeTiming, kNodeCount> nodes;     ///< By NodeId.
  SecurityConfig security;
  VerdictConfig verdict;
  RecorderConfig recorder;
  InputSettings inputs;  ///< At the window.

  /// Everything simulated, at the rates of the architecture page.
  CartConfig();
  [[nodiscard]] const NodeTiming& timing(NodeId node) const { return nodes[static_cast<std::size_t>(node)]; }
};

/// Checks the rules that span several fields. Throws InputError naming field, value and valid range.
void Validate(const CartConfig& cart);

/// Reads and validates. Relative paths in the file are taken from its folder. Throws InputError.
[[nodiscard]] CartConfig LoadCart(const std::filesystem::path& file);
/// As LoadCart, for text in memory; `name` stands for the file in messages.
[[nodiscard]] CartConfig LoadCartText(const std::string& text, const std::string& name);

/// Every key that a cart file may have; comments are in the lines of `file`.
[[nodiscard]] std::vector<KeyRule> CartRules(const std::filesystem::path& file);

/// The whole configuration, defaults included, as a cart file that loads to the same.
[[nodiscard]] std::string CartToYaml(const CartConfig& cart);

}  // namespace fulcrum::config
