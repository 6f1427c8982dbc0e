// One message of each type with a different value in every field, so that lost, swapped or truncated fields are
// detected.
#pragma once

#include "services/base/core/messages.h"
#include "services/base/core/tissue_blocks.h"

namespace fulcrum::bus::test {

inline Vec3f Vec(float first) { return {first, first + 0.001f, first + 0.002f}; }
inline Quatf Turn() { return Quatf(Eigen::AngleAxisf(0.7f, Vec3f(1, 2, 3).normalized())); }

template <class T>
T Sample(std::uint64_t sequence = 7);

template <>
inline HandleState Sample(std::uint64_t sequence) {
  HandleState m;
  m.stamp = {sequence, 11, 1000};
  m.handles[0] = {true, 0.5f, -1.5f, 0.75f, 512};
  m.handles[1] = {false, 0.25f, 2.5f, 0.5f, 1023};
  m.pedals = kPedalCut | kPedalBlend;
  return m;
}

template <>
inline ToolState Sample(std::uint64_t sequence) {
  ToolState m;
  m.stamp = {sequence, 12, 2000};
  m.tools[0] = {ToolKind::kGrasper, ServoState::kNormal, Vec(0.1f), Turn(), Vec(0.2f), Vec(0.3f), Vec(0.4f), 0.01f};
  m.tools[1] = {ToolKind::kHook, ServoState::kFade, Vec(-0.5f), Turn().conjugate(),
                Vec(0.6f),       Vec(0.7f),         Vec(0.8f),  0.02f};
  return m;
}

template <>
inline TissueFrame Sample(std::uint64_t sequence) {
  TissueFrame m;
  m.header = {{sequence, 13, 3000}, 0xfeedf00d12345678ull, 3, 4, 5, 1.25, 1.5, 0.1, 20556, 2};
  for (int i = 0; i < 3 * 20556; ++i) m.xyz.push_back(PositionOf(i));
  return m;
}

template <>
inline ContactModel Sample(std::uint64_t sequence) {
  ContactModel m;
  m.stamp = {sequence, 14, 4000};
  m.tool_sequence = 99;
  m.tool_stamp_ns = 3999;
  m.physics_dt_s = 0.01f;
  float x = 0.0f;
  for (DeviceContacts& d : m.devices) {
    d = {2, 0.5f + x, 3.0f + x, {}};
    for (Contact& c : d.contacts) {
      x += 0.01f;
      c.kind = ContactKind::kGrasp;
      c.id = 17;
      c.x_ref = Vec(x);
      c.f_ref = Vec(x + 0.1f);
      c.n = Vec(x).normalized();
      c.e1 = Vec(-x).normalized();
      c.p_s = Vec(x + 0.2f);
      c.v_s = Vec(x + 0.3f);
      c.u_c = Vec(x + 0.4f);
      c.du_c = Vec(x + 0.5f);
      c.gap = -x;
      c.k1 = 100 + x;
      c.k3 = 1e6f + 1e4f * x;
      c.kt = 50 + x;
      c.k_body = 30 + x;
      c.b_body = 2 + x;
      c.friction = 0.2f + x;
      c.kappa1 = 40 + x;
      c.kappa2 = -20 - x;
      c.slip_force = 8 + x;
      c.radius = 0.005f + x;
    }
  }
  return m;
}

template <>
inline GeneratorSetting Sample(std::uint64_t sequence) {
  GeneratorSetting m;
  m.stamp = {sequence, 12, 4500};
  m.cut_W = 40;
  m.coag_W = 25;
  m.blend_W = 30;
  return m;
}

template <>
inline OperatorInput Sample(std::uint64_t sequence) {
  OperatorInput m;
  m.stamp = {sequence, 13, 4600};
  m.claim_ns = 4000;
  m.tools[0] = {{0.01f, -0.02f, 0.03f}, 0.5f, 0.125f, true};
  m.tools[1] = {{-0.04f, 0.05f, 0.06f}, 0.25f, -0.5f, true};
  m.pedals = kPedalCoag;
  m.source = OperatorSource::kWindow;
  return m;
}

template <>
inline Picture Sample(std::uint64_t sequence) {
  Picture m;
  m.header.stamp = {sequence, 14, 4700};
  m.header.session_time_s = 2.25;
  m.header.tool_sequence = 31;
  m.header.tissue_sequence = 32;
  m.header.width = 960;
  m.header.height = 540;
  m.header.present = 3;
  m.header.scopes = 2;
  m.header.eye_W = Vec(0.11f);
  m.header.right_W = Vec3f::UnitY();
  m.header.up_W = Vec3f::UnitX();
  m.header.forward_W = -Vec3f::UnitZ();
  m.header.pixel_rad = 0.002f;
  m.header.tip_W = {Vec(0.21f), Vec(0.31f), Vec(0.41f), Vec(0.51f)};
  m.header.scale = 0.75f;
  m.jpeg = {0xff, 0xd8, 1, 2, 3, 0xff, 0xd9};
  m.header.size = static_cast<std::uint32_t>(m.jpeg.size());
  return m;
}

template <>
inline CauteryContact Sample(std::uint64_t sequence) {
  CauteryContact m;
  m.stamp = {sequence, 15, 5000};
  m.session_time_s = 2.5;
  m.topology_revision = 6;
  m.touching = true;
  m.tented = true;
  m.tool = 1;
  m.triangle = 1234;
  m.barycentric = {0.25f, 0.125f, 0.625f};
  m.material = {0.03f, 0.04f};
  m.material_rate = {-0.01f, 0.02f};
  m.contact_radius_m = 0.0005f;
  m.footprint = {-300, 400, kFootprintCells, {}};
  for (std::uint32_t i = 0; i < kFootprintCells * kFootprintCells; ++i) {
    m.footprint.gap.push_back(static_cast<std::uint8_t>(i * 3));
  }
  return m;
}

/// A message of the largest size.
template <>
inline TopologyState Sample(std::uint64_t sequence) {
  TopologyState m;
  m.stamp = {sequence, 16, 6000};
  m.scene_hash = 0xabcdef;
  m.revision = 42;
  m.rows = 625;
  m.cols = 400;
  m.cut_length_m = 0.025f;
  m.cut_width_m = 0.0016f;
  m.cut_off_way_m = 0.0003f;
  const std::size_t nodes = 625 * 400;
  static_assert(625 * 400 == kMaxMembraneNodes);
  for (std::size_t i = 0; i < nodes / 8; ++i) m.dead_nodes.push_back(static_cast<std::uint8_t>(i * 7));
  for (std::size_t i = 0; i < 3 * nodes / 8; ++i) m.dead_edges.push_back(static_cast<std::uint8_t>(i * 11));
  for (std::size_t i = 0; i < 3 * nodes; ++i) m.shrink.push_back(static_cast<std::uint8_t>(i * 13));
  return m;
}

/// A message of the largest size.
template <>
inline TearState Sample(std::uint64_t sequence) {
  TearState m;
  m.stamp = {sequence, 16, 6500};
  m.scene_hash = 0xabcdef;
  m.rows = 625;
  m.cols = 400;
  for (std::size_t i = 0; i < std::size_t{3} * 625 * 400 / 8; ++i)
    m.torn_edges.push_back(static_cast<std::uint8_t>(i * 5));
  return m;
}

template <>
inline OpenCells Sample(std::uint64_t sequence) {
  OpenCells m;
  m.stamp = {sequence, 16, 6600};
  m.scene_hash = 0xabcdef;
  m.x = -8;
  m.y = 1200;
  for (std::size_t i = 0; i < m.rows.size(); ++i) m.rows[i] = 0x9e3779b97f4a7c15u * (i + 1);
  return m;
}

template <>
inline ClipState Sample(std::uint64_t sequence) {
  ClipState m;
  m.stamp = {sequence, 16, 6700};
  m.scene_hash = 0xabcdef;
  m.count = kMaxClips;
  for (std::uint32_t i = 0; i < m.count; ++i) {
    m.clips[i] = {{0.001f * static_cast<float>(i), -0.002f, 0.003f},
                  {0.5f, -0.5f, 0.5f, -0.5f},
                  {7 * i, 7 * i + 3, 7 * i + 2},
                  0.006f + 1e-4f * static_cast<float>(i),
                  static_cast<std::uint8_t>(i % kMaxTools)};
  }
  return m;
}

template <>
inline TemperaturePatch Sample(std::uint64_t sequence) {
  TemperaturePatch m;
  m.header = {{sequence, 17, 7000}, 8, 3, BurntSurface::kSolids, 128, 3840, 101.5f};
  for (std::size_t i = 0; i < 4 * 256 * 256; ++i) m.texels.push_back(static_cast<std::uint8_t>(i * 3 + i / 256));
  return m;
}

template <>
inline ThermalEvent Sample(std::uint64_t sequence) {
  ThermalEvent m;
  m.stamp = {sequence, 18, 8000};
  m.session_time_s = 3.5;
  m.kind = ThermalEventKind::kNerveWarning;
  m.material = {0.01f, 0.02f};
  m.temperature_C = 55.5f;
  m.value = 0.125f;
  m.solid = 3;
  m.topology_revision = 9;
  return m;
}

template <>
inline SceneManifest Sample(std::uint64_t sequence) {
  SceneManifest m;
  m.stamp = {sequence, 19, 9000};
  m.scene_name = "built-in";
  m.session_id = "20260101-120000";
  m.scene_hash = 0x1122334455667788ull;
  m.session_start_ns = 123456789012345;
  m.mode = SessionMode::kLockStep;
  m.recorded = true;
  return m;
}

template <>
inline TickManifest Sample(std::uint64_t sequence) {
  TickManifest m;
  m.stamp = {sequence, 22, 12000};
  m.node = NodeId::kHaptics;
  m.tick = 4242;
  m.session_time_s = 4.5;
  m.state_hash = 0x99aabbccddeeff00ull;
  m.consumed = {{TopicId::kToolState, 5, 6}, {TopicId::kHealth, 7, 8}};
  m.tick_times_ns = {10000, 11000, 12000};
  return m;
}

template <>
inline Health Sample(std::uint64_t sequence) {
  Health m;
  m.stamp = {sequence, 23, 13000};
  m.node = NodeId::kPhysics;
  m.state = HealthState::kDegraded;
  m.pid = 4321;
  m.schema_hash = 1;
  m.scene_hash = 2;
  m.rate_asked_Hz = 100;
  m.rate_achieved_Hz = 99.5f;
  m.ticks = 3;
  m.overruns = 4;
  m.write_failures = 5;
  m.step = {1, 2, 3};
  m.wake = {4, 5, 6};
  m.last_error = "ToolState is 52 ms old";
  m.inputs = {{TopicId::kToolState, true, 1.5f, 6, 7, 8}, {TopicId::kTopologyState, false, -1, 9, 10, 11}};
  m.metrics = {{"max_displacement_mm", 12.5}, {"grasped_particles", 31}};
  return m;
}

}  // namespace fulcrum::bus::test
