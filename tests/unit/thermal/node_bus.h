// In-process topics of a ThermalNode with their other ends.
#pragma once

#include <memory>

#include "services/transport/bus/in_process.h"
#include "thermal_node/node/thermal_node.h"

namespace fulcrum::thermal {

/// The pedal of a mode, down.
inline std::uint8_t PedalOf(CauteryMode mode) {
  switch (mode) {
    case CauteryMode::kCut:
      return kPedalCut;
    case CauteryMode::kCoag:
      return kPedalCoag;
    case CauteryMode::kBlend:
      return kPedalBlend;
    case CauteryMode::kOff:
      break;
  }
  return kPedalNone;
}

struct NodeBus {
  bus::InProcessTopic<CauteryContact> contacts;
  bus::InProcessTopic<TearState> tears;
  bus::InProcessTopic<HandleState> handles;
  bus::InProcessTopic<GeneratorSetting> generator;
  bus::InProcessTopic<TopologyState> topology;
  bus::InProcessTopic<OpenCells> open_cells;
  bus::InProcessTopic<TemperaturePatch> patches;
  bus::InProcessTopic<ThermalEvent> events;
  bus::InProcessTopic<TickManifest> manifests;
  std::unique_ptr<bus::Output<CauteryContact>> contact_out = contacts.MakeOutput();
  std::unique_ptr<bus::Input<CauteryContact>> contact_in = contacts.MakeInput();
  std::unique_ptr<bus::Output<TearState>> tear_out = tears.MakeOutput();
  std::unique_ptr<bus::Input<TearState>> tear_in = tears.MakeInput();
  std::unique_ptr<bus::Output<HandleState>> handle_out = handles.MakeOutput();
  std::unique_ptr<bus::Input<HandleState>> handle_in = handles.MakeInput();
  std::unique_ptr<bus::Output<GeneratorSetting>> setting_out = generator.MakeOutput();
  std::unique_ptr<bus::Input<GeneratorSetting>> setting_in = generator.MakeInput();
  std::unique_ptr<bus::Output<TopologyState>> topology_out = topology.MakeOutput();
  std::unique_ptr<bus::Output<OpenCells>> open_out = open_cells.MakeOutput();
  std::unique_ptr<bus::LoanOutput<TemperaturePatch>> patch_out = patches.MakeOutput();
  std::unique_ptr<bus::Output<ThermalEvent>> event_out = events.MakeOutput();
  std::unique_ptr<bus::Output<TickManifest>> manifest_out = manifests.MakeOutput();
  // A test makes its own reader of patches, because without a reader the node draws none.
  std::unique_ptr<bus::Input<TopologyState>> topology_in = topology.MakeInput(64);
  std::unique_ptr<bus::Input<OpenCells>> open_in = open_cells.MakeInput(64);
  std::unique_ptr<bus::Input<ThermalEvent>> event_in = events.MakeInput(4096);
  std::unique_ptr<bus::Input<TickManifest>> manifest_in = manifests.MakeInput(4);

  /// Sends a pressed pedal of this mode and this setting of the generator, from `ns` on.
  void Demand(CauteryMode mode, float power_W, std::int64_t ns) {
    HandleState state;
    state.stamp = {++demands, 1, ns};
    state.pedals = PedalOf(mode);
    handle_out->Write(state);
    setting_out->Write({state.stamp, power_W, power_W, power_W});
  }
  std::uint64_t demands = 0;

  /// Ports of the node.
  [[nodiscard]] ThermalNode::Ports ports() const {
    return {*contact_in, *tear_in,   *handle_in, *setting_in,  *topology_out,
            *open_out,   *patch_out, *event_out, *manifest_out};
  }
};

/// Contact of metal with the membrane at a place.
inline CauteryContact TouchAt(const Vec2f& material, float radius_m) {
  CauteryContact contact;
  contact.touching = true;
  contact.contact_radius_m = radius_m;
  contact.material = material;
  contact.triangle = 0;
  contact.barycentric = {1, 0, 0};
  return contact;
}

/// Advances to the next frame of 10 ms.
inline void Advance(Tick* tick) {
  ++tick->index;
  tick->dt_s = 0.01;
  tick->session_time_s += 0.01;
  tick->stamp_ns += 10'000'000;
}

}  // namespace fulcrum::thermal
