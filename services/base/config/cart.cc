#include "services/base/config/cart.h"

#include <unistd.h>

#include <algorithm>

#include "services/base/config/cart_inputs.h"
#include "services/base/config/strict_yaml.h"

namespace fulcrum::config {
namespace {

const StrictMap::Choices<LinkKind> kLinkKinds = {{"none", LinkKind::kNone},
                                                 {"simulated", LinkKind::kSimulated},
                                                 {"serial", LinkKind::kSerial},
                                                 {"operator", LinkKind::kOperator},
                                                 {"buttons", LinkKind::kButtons}};
const StrictMap::Choices<DeviceKind> kDeviceKinds = {{"none", DeviceKind::kNone},
                                                     {"simulated", DeviceKind::kSimulated},
                                                     {"touch", DeviceKind::kTouch},
                                                     {"operator", DeviceKind::kOperator}};
const StrictMap::Choices<HandHold> kHandHolds = {{"scene", HandHold::kScene},
                                                 {"fingertip", HandHold::kFingertip},
                                                 {"light_grip", HandHold::kLightGrip},
                                                 {"firm_grip", HandHold::kFirmGrip}};
const StrictMap::Choices<LineProtocol> kProtocols = {{"plain", LineProtocol::kPlain},
                                                     {"framed", LineProtocol::kFramed}};
const StrictMap::Choices<Hand> kHands = {{"left", Hand::kLeft}, {"right", Hand::kRight}};
constexpr std::array kBauds = {9600, 19200, 38400, 57600, 115200, 230400, 460800, 921600};
constexpr std::size_t kMaxCalibrationPoints = 9;
constexpr int kMaxUsbId = 0xffff;
constexpr std::size_t kMaxWindowEnds = 32;
/// Longest path [B], PATH_MAX of the system: LoadCart makes paths absolute, and its own copy must be readable.
constexpr std::size_t kLongestPath = 4096;
constexpr int kMaxButton = 8;  // Of a haptic device; a Touch has two.

std::string ToolKey(std::size_t tool) { return std::string("tool") + std::to_string(tool); }

void ReadLink(StrictMap map, SerialLink* link) {
  link->port = map.TextOr("port", link->port);
  link->usb_vendor_id = static_cast<int>(map.Integer("usb_vendor_id", link->usb_vendor_id, 0, kMaxUsbId));
  link->usb_product_id = static_cast<int>(map.Integer("usb_product_id", link->usb_product_id, 0, kMaxUsbId));
  link->usb_serial = map.TextOr("usb_serial", link->usb_serial);
  link->baud = static_cast<int>(map.Integer("baud", link->baud, kBauds.front(), kBauds.back()));
}

void ReadCalibration(StrictMap map, JawCalibration* calibration) {
  calibration->adc_step_V = map.NumberSi("adc_step_V", calibration->adc_step_V, Range::Between(0.0005, 0.05));
  calibration->volts = map.NumbersSi("points_V", calibration->volts, 2, kMaxCalibrationPoints, Range::Between(0, 5.5));
  calibration->angles_rad =
      map.NumbersSi("angles_deg", calibration->angles_rad, 2, kMaxCalibrationPoints, Range::Between(-10, 120));
}

void ReadSimulated(StrictMap map, bool handle, SimulatedUnit* unit) {
  unit->protocol = map.Choice("protocol", unit->protocol, kProtocols);
  const auto window = [&map](const char* key, std::vector<double>* ends) {
    *ends = map.NumbersSi(key, *ends, 0, kMaxWindowEnds, Range::AtLeast(0));
    if (ends->size() % 2 != 0 || !std::is_sorted(ends->begin(), ends->end())) {
      map.Fail(key, "a list of pairs `from, to` in rising order, for example [5, 6]");
    }
  };
  unit->drop = map.Number("drop", unit->drop, Range::Between(0, 0.5));
  unit->flip = map.Number("flip", unit->flip, Range::Between(0, 0.5));
  window("silent_s", &unit->silent_s);
  window("garbage_s", &unit->garbage_s);
  window("wrong_baud_s", &unit->wrong_baud_s);
  window("unplugged_s", &unit->unplugged_s);
  if (handle) {
    unit->closed_V = map.NumberSi("closed_V", unit->closed_V, Range::Between(0, 5));
    unit->open_V = map.NumberSi("open_V", unit->open_V, Range::Between(0, 5));
    unit->bow = map.NumberSi("bow_percent", unit->bow, Range::Between(-20, 20));
    unit->noise_V = map.NumberSi("noise_mV", unit->noise_V, Range::Between(0, 1000));
    unit->tremor_rad = map.NumberSi("tremor_deg", unit->tremor_rad, Range::Between(0, 20));
    window("broken_wire_s", &unit->broken_wire_s);
  }
}

void ReadButton(StrictMap map, ToolButton* button) {
  button->tool = static_cast<int>(map.Integer("tool", button->tool, 0, kMaxTools - 1));
  button->button = static_cast<int>(map.Integer("button", button->button, 0, kMaxButton));
}

void ReadDevice(StrictMap map, DeviceConfig* device) {
  device->kind = map.Choice("kind", device->kind, kDeviceKinds);
  device->name = map.TextOr("name", device->name, 63);
  device->serial = map.TextOr("serial", device->serial, 63);
  device->force_scale = map.Number("force_scale", device->force_scale, Range::Between(0, 1));
  device->hand = map.Choice("hand", device->hand, kHandHolds);
  device->motion = map.TextOr("motion", device->motion, kLongestPath);
  StrictMap workspace = map.MapOrDefaults("workspace");
  WorkspaceConfig& w = device->workspace;
  const auto vector = [&workspace](const char* key, const Range& range, Vec3d* v) {
    *v = Vec3d(workspace.NumbersSi(key, {v->x(), v->y(), v->z()}, 3, 3, range).data());
  };
  vector("rotation_deg", Range::Between(-360, 360), &w.rotation_rad);
  vector("trocar_mm", Range::Between(-1000, 1000), &w.trocar_D);
  w.scale = workspace.Number("scale", w.scale, Range::Between(0.1, 10));
}

void ReadTiming(StrictMap map, NodeId node, NodeTiming* timing) {
  // A pedal counts as up after 0.1 s without a HandleState (kPedalTimeout_ns): one in each 40 ms leaves room for a
  // loss.
  const double slowest_Hz = node == NodeId::kHandleBridge ? 25 : 1;
  timing->rate_Hz = map.NumberSi("rate_Hz", timing->rate_Hz, Range::Between(slowest_Hz, 4000));
  timing->fifo_priority = static_cast<int>(map.Integer("fifo_priority", timing->fifo_priority, 0, 99));
  timing->cpu = static_cast<int>(map.Integer("cpu", timing->cpu, -1, 1023));
  timing->spin_s = map.NumberSi("spin_us", timing->spin_s, Range::Between(0, 500));
  if (node == NodeId::kPhysics) {
    timing->threads = static_cast<int>(map.Integer("threads", timing->threads, 1, 16));
  }
}

/// Reads `file` over `cart`: keys that the file does not contain keep their values.
CartConfig ReadCart(StrictYaml* file, CartConfig cart) {
  StrictMap root = file->root();
  cart.name = root.TextOr("name", cart.name, 31);
  cart.domain = static_cast<int>(root.Integer("domain", cart.domain, 1, 100));
  cart.builds = root.TextOr("builds", cart.builds, kLongestPath);
  StrictMap handles = root.MapOrDefaults("handles");
  for (std::size_t tool = 0; tool < cart.handles.size(); ++tool) {
    StrictMap map = handles.MapOrDefaults(ToolKey(tool));
    HandleConfig& handle = cart.handles[tool];
    handle.kind = map.Choice("kind", handle.kind, kLinkKinds);
    ReadLink(map, &handle.link);
    ReadSimulated(map.MapOrDefaults("simulated"), true, &handle.simulated);
    handle.hand = map.Choice("hand", handle.hand, kHands);
    handle.button = static_cast<int>(map.Integer("button", handle.button, 0, kMaxButton));
    ReadCalibration(map.MapOrDefaults("calibration"), &handle.calibration);
  }
  StrictMap pedal = root.MapOrDefaults("pedal");
  cart.pedal.kind = pedal.Choice("kind", cart.pedal.kind, kLinkKinds);
  ReadLink(pedal, &cart.pedal.link);
  ReadSimulated(pedal.MapOrDefaults("simulated"), false, &cart.pedal.simulated);
  ReadButton(pedal.MapOrDefaults("cut"), &cart.pedal.cut);
  ReadButton(pedal.MapOrDefaults("coag"), &cart.pedal.coag);
  StrictMap generator = root.MapOrDefaults("generator");
  const auto power = [&generator](const char* key, float* power_W) {
    *power_W = static_cast<float>(
        generator.NumberSi(key, static_cast<double>(*power_W), Range::Between(0, static_cast<double>(kMaxSetPower_W))));
  };
  power("cut_W", &cart.generator.cut_W);
  power("coag_W", &cart.generator.coag_W);
  power("blend_W", &cart.generator.blend_W);
  StrictMap devices = root.MapOrDefaults("devices");
  for (std::size_t tool = 0; tool < cart.devices.size(); ++tool) {
    ReadDevice(devices.MapOrDefaults(ToolKey(tool)), &cart.devices[tool]);
  }
  StrictMap nodes = root.MapOrDefaults("nodes");
  for (std::size_t node = 0; node < cart.nodes.size(); ++node) {
    const auto id = static_cast<NodeId>(node);
    ReadTiming(nodes.MapOrDefaults(NodeName(id)), id, &cart.nodes[node]);
  }
  StrictMap security = root.MapOrDefaults("security");
  cart.security.keys = security.TextOr("keys", cart.security.keys, kLongestPath);
  cart.security.encrypt = security.Flag("encrypt", cart.security.encrypt);
  cart.security.group = security.TextOr("group", cart.security.group);
  StrictMap verdict = root.MapOrDefaults("verdict");
  cart.verdict.restarts = static_cast<int>(verdict.Integer("restarts", cart.verdict.restarts, 0, kMostRestarts));
  StrictMap recorder = root.MapOrDefaults("recorder");
  cart.recorder.keep_free_MB = recorder.Number("keep_free_MB", cart.recorder.keep_free_MB, Range::Between(0, 1e6));
  ReadInputs(root.MapOrDefaults("inputs"), &cart.inputs);
  file->Finish();
  return cart;
}

[[noreturn]] void Refuse(const std::string& field, const std::string& reason) {
  std::string message = field;
  throw InputError(message.append(": ").append(reason));
}

void ValidateLink(const std::string& field, LinkKind kind, const SerialLink& link) {
  if (kind != LinkKind::kSerial) {
    return;
  }
  if (link.port.empty() && (link.usb_vendor_id == 0 || link.usb_product_id == 0)) {
    Refuse(field, "kind is serial, but neither `port` nor `usb_vendor_id` with `usb_product_id` is given; give one");
  }
  if (std::find(kBauds.begin(), kBauds.end(), link.baud) == kBauds.end()) {
    std::string valid;
    for (const int baud : kBauds) {
      valid += ' ';
      valid += std::to_string(baud);
    }
    Refuse(field + ".baud", std::to_string(link.baud) + " is not a usual speed; valid:" + valid);
  }
}

void ValidateCalibration(const std::string& field, const JawCalibration& calibration) {
  const auto& v = calibration.volts;
  const auto& a = calibration.angles_rad;
  if (v.size() != a.size() || v.size() < 2 || v.size() > kMaxCalibrationPoints) {
    Refuse(field, "points_V has " + std::to_string(v.size()) + " entries and angles_deg " + std::to_string(a.size()) +
                      "; valid: the same number, 2 to 9");
  }
  // With fewer than four counts between two points the converter's own error would dominate the slope.
  const double min_gap_V = 4 * calibration.adc_step_V;
  for (std::size_t i = 1; i < v.size(); ++i) {
    if (!(v[i] - v[i - 1] >= min_gap_V)) {
      Refuse(field + ".points_V", "entry " + std::to_string(i + 1) + " (" + std::to_string(v[i]) +
                                      " V) must exceed the one before by at least 4 counts (" +
                                      std::to_string(min_gap_V) + " V)");
    }
    if ((a[i] - a[i - 1]) * (a[1] - a[0]) <= 0) {
      Refuse(field + ".angles_deg",
             "entry " + std::to_string(i + 1) + " breaks the order; valid: all rising or all falling");
    }
  }
}

void ValidatePorts(const CartConfig& cart) {
  std::vector<std::string> ports;
  const auto add = [&ports](LinkKind kind, const SerialLink& link, const std::string& field) {
    if (kind != LinkKind::kSerial || link.port.empty()) {
      return;
    }
    if (std::find(ports.begin(), ports.end(), link.port) != ports.end()) {
      Refuse(field + ".port", "'" + link.port + "' is given to two links; each needs its own");
    }
    ports.push_back(link.port);
  };
  for (std::size_t tool = 0; tool < cart.handles.size(); ++tool) {
    add(cart.handles[tool].kind, cart.handles[tool].link, "handles." + ToolKey(tool));
  }
  add(cart.pedal.kind, cart.pedal.link, "pedal");
}

void ValidateDevices(const CartConfig& cart) {
  const DeviceConfig* other = nullptr;
  for (std::size_t tool = 0; tool < cart.devices.size(); ++tool) {
    const DeviceConfig& device = cart.devices[tool];
    const std::string field = "devices." + ToolKey(tool);
    // The servo bounds the stiffness that the hand feels; the scaling after it must not raise it.
    constexpr double kRounding = 1e-9;
    if (device.force_scale * device.workspace.scale > 1 + kRounding) {
      Refuse(field, "force_scale " + std::to_string(device.force_scale) + " times workspace.scale " +
                        std::to_string(device.workspace.scale) +
                        " makes contacts stiffer than the servo holds stable; valid: a product of at most 1");
    }
    if (!device.motion.empty() && device.kind != DeviceKind::kSimulated) {
      Refuse(field + ".motion", "only a simulated device plays recorded motion; valid: kind: simulated");
    }
    if (device.kind != DeviceKind::kTouch) continue;
    if (device.name.empty()) Refuse(field + ".name", "is empty; valid: the name in the Touch's setup program");
    if (other != nullptr) {
      if (device.name == other->name) {
        Refuse(field + ".name", "'" + device.name + "' is given to two tools; each needs its own");
      }
      if (device.serial.empty() != other->serial.empty()) {
        Refuse(field + ".serial", "one Touch has a serial number, the other has none; give both, or neither");
      }
      if (!device.serial.empty() && device.serial == other->serial) {
        Refuse(field + ".serial", "'" + device.serial + "' is given to two tools; each needs its own");
      }
    }
    other = &device;
  }
}

CartConfig ReadAndValidate(StrictYaml* yaml, const std::string& name) {
  CartConfig cart = ReadCart(yaml, CartConfig());
  try {
    Validate(cart);
  } catch (const InputError& e) {
    throw InputError(name + ": " + e.what());
  }
  return cart;
}

}  // namespace

bool IsOperated(const CartConfig& cart) {
  return cart.pedal.kind == LinkKind::kOperator ||
         std::any_of(cart.devices.begin(), cart.devices.end(),
                     [](const DeviceConfig& device) { return device.kind == DeviceKind::kOperator; }) ||
         std::any_of(cart.handles.begin(), cart.handles.end(),
                     [](const HandleConfig& handle) { return handle.kind == LinkKind::kOperator; });
}

CartConfig::CartConfig() {
  for (HandleConfig& handle : handles) {
    handle.kind = LinkKind::kSimulated;
  }
  handles[1].hand = handles[3].hand = Hand::kRight;
  pedal.kind = LinkKind::kSimulated;
  for (DeviceConfig& device : devices) {
    device.kind = DeviceKind::kSimulated;
  }
  const auto timing_of = [this](NodeId node) -> NodeTiming& { return nodes[static_cast<std::size_t>(node)]; };
  timing_of(NodeId::kSupervisor) = {.rate_Hz = 10};
  timing_of(NodeId::kHandleBridge) = {.rate_Hz = 400, .fifo_priority = 60};
  timing_of(NodeId::kHaptics) = {.rate_Hz = 1000, .fifo_priority = 80, .spin_s = 50e-6};
  timing_of(NodeId::kPhysics) = {.rate_Hz = 100, .fifo_priority = 40};
  timing_of(NodeId::kThermal) = {.rate_Hz = 100, .fifo_priority = 30};
  timing_of(NodeId::kRender) = {.rate_Hz = 30};
  timing_of(NodeId::kRecorder) = {.rate_Hz = 20};
}

void Validate(const CartConfig& cart) {
  if (cart.domain < 1 || cart.domain > 100) {
    Refuse("domain", std::to_string(cart.domain) + " is out of range; valid: 1 to 100");
  }
  for (std::size_t tool = 0; tool < cart.handles.size(); ++tool) {
    const std::string field = "handles." + ToolKey(tool);
    ValidateLink(field, cart.handles[tool].kind, cart.handles[tool].link);
    ValidateCalibration(field + ".calibration", cart.handles[tool].calibration);
  }
  ValidateLink("pedal", cart.pedal.kind, cart.pedal.link);
  ValidatePorts(cart);
  ValidateDevices(cart);
}

int DefaultDomain() {
  // Users with neighbouring ids get different domains; the highest ones stay free for tests.
  constexpr unsigned kDomains = 97;
  return 1 + static_cast<int>((::getuid() + 6u) % kDomains);
}

CartConfig LoadCart(const std::filesystem::path& file) {
  StrictYaml yaml = StrictYaml::FromFile(file);
  CartConfig cart = ReadAndValidate(&yaml, file.string());
  const auto from_its_folder = [&file](std::string* path) {
    if (!path->empty()) *path = (std::filesystem::absolute(file).parent_path() / *path).lexically_normal().string();
  };
  for (DeviceConfig& device : cart.devices) from_its_folder(&device.motion);
  from_its_folder(&cart.security.keys);
  from_its_folder(&cart.builds);
  return cart;
}

CartConfig LoadCartText(const std::string& text, const std::string& name) {
  StrictYaml yaml = StrictYaml::FromText(text, name);
  return ReadAndValidate(&yaml, name);
}

std::vector<KeyRule> CartRules(const std::filesystem::path& file) {
  StrictYaml yaml = StrictYaml::FromFile(file);
  (void)ReadAndValidate(&yaml, file.string());
  return yaml.Rules();
}

std::string CartToYaml(const CartConfig& cart) {
  StrictYaml empty = StrictYaml::FromText("{}", "cart");
  ReadCart(&empty, cart);
  return empty.Effective();
}

}  // namespace fulcrum::config
