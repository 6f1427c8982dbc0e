// Field-by-field equality of messages, in tests only. Beside the messages, so that argument lookup finds it.
#pragma once

#include <algorithm>

#include "services/core/messages.h"

namespace fulcrum {

inline bool Same(const Stamp& a, const Stamp& b) {
  return a.sequence == b.sequence && a.epoch == b.epoch && a.stamp_ns == b.stamp_ns;
}
template <class Range>
bool AllSame(const Range& a, const Range& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](const auto& x, const auto& y) { return Same(x, y); });
}

inline bool Same(const HandleSample& a, const HandleSample& b) {
  return a.present == b.present && a.jaw_angle_rad == b.jaw_angle_rad && a.jaw_rate_rad_s == b.jaw_rate_rad_s &&
         a.quality == b.quality && a.raw_counts == b.raw_counts;
}
inline bool Same(const HandleState& a, const HandleState& b) {
  return Same(a.stamp, b.stamp) && a.pedals == b.pedals && AllSame(a.handles, b.handles);
}

inline bool Same(const ToolSample& a, const ToolSample& b) {
  return a.kind == b.kind && a.state == b.state && a.p_WT == b.p_WT && a.q_WT.coeffs() == b.q_WT.coeffs() &&
         a.v_WT == b.v_WT && a.w_WT == b.w_WT && a.f_W == b.f_W && a.model_age_s == b.model_age_s;
}
inline bool Same(const ToolState& a, const ToolState& b) { return Same(a.stamp, b.stamp) && AllSame(a.tools, b.tools); }

inline bool Same(const TissueFrameHeader& a, const TissueFrameHeader& b) {
  return Same(a.stamp, b.stamp) && a.scene_hash == b.scene_hash && a.topology_revision == b.topology_revision &&
         a.tool_sequence == b.tool_sequence && a.handle_sequence == b.handle_sequence &&
         a.session_time_s == b.session_time_s && a.simulated_time_s == b.simulated_time_s &&
         a.vertex_count == b.vertex_count && a.grasping_tools == b.grasping_tools;
}
inline bool Same(const TissueFrame& a, const TissueFrame& b) { return Same(a.header, b.header) && a.xyz == b.xyz; }

inline bool Same(const Contact& a, const Contact& b) {
  return a.kind == b.kind && a.id == b.id && a.x_ref == b.x_ref && a.f_ref == b.f_ref && a.n == b.n && a.e1 == b.e1 &&
         a.p_s == b.p_s && a.v_s == b.v_s && a.u_c == b.u_c && a.du_c == b.du_c && a.gap == b.gap && a.k1 == b.k1 &&
         a.k3 == b.k3 && a.kt == b.kt && a.k_body == b.k_body && a.b_body == b.b_body && a.friction == b.friction &&
         a.kappa1 == b.kappa1 && a.kappa2 == b.kappa2 && a.slip_force == b.slip_force && a.radius == b.radius;
}
inline bool Same(const DeviceContacts& a, const DeviceContacts& b) {
  return a.count == b.count && a.p_ext_W == b.p_ext_W && a.force_cap_N == b.force_cap_N &&
         AllSame(a.contacts, b.contacts);
}
inline bool Same(const ContactModel& a, const ContactModel& b) {
  return Same(a.stamp, b.stamp) && a.tool_sequence == b.tool_sequence && a.tool_stamp_ns == b.tool_stamp_ns &&
         a.physics_dt_s == b.physics_dt_s && AllSame(a.devices, b.devices);
}

inline bool Same(const Footprint& a, const Footprint& b) {
  return a.x == b.x && a.y == b.y && a.width == b.width && a.gap == b.gap;
}
inline bool Same(const GeneratorSetting& a, const GeneratorSetting& b) {
  return Same(a.stamp, b.stamp) && a.cut_W == b.cut_W && a.coag_W == b.coag_W && a.blend_W == b.blend_W;
}
inline bool Same(const CauteryContact& a, const CauteryContact& b) {
  return Same(a.stamp, b.stamp) && a.session_time_s == b.session_time_s && a.topology_revision == b.topology_revision &&
         a.touching == b.touching && a.tented == b.tented && a.tool == b.tool && a.triangle == b.triangle &&
         a.barycentric == b.barycentric && a.material == b.material && a.material_rate == b.material_rate &&
         Same(a.footprint, b.footprint) && a.contact_radius_m == b.contact_radius_m;
}

inline bool Same(const TopologyState& a, const TopologyState& b) {
  return Same(a.stamp, b.stamp) && a.scene_hash == b.scene_hash && a.revision == b.revision && a.rows == b.rows &&
         a.cols == b.cols && a.cut_length_m == b.cut_length_m && a.cut_width_m == b.cut_width_m &&
         a.cut_off_way_m == b.cut_off_way_m && a.dead_nodes == b.dead_nodes && a.dead_edges == b.dead_edges &&
         a.shrink == b.shrink;
}

inline bool Same(const TearState& a, const TearState& b) {
  return Same(a.stamp, b.stamp) && a.scene_hash == b.scene_hash && a.rows == b.rows && a.cols == b.cols &&
         a.torn_edges == b.torn_edges;
}

inline bool Same(const OpenCells& a, const OpenCells& b) {
  return Same(a.stamp, b.stamp) && a.scene_hash == b.scene_hash && a.x == b.x && a.y == b.y && a.rows == b.rows;
}

inline bool Same(const TemperaturePatch& a, const TemperaturePatch& b) {
  const TemperaturePatchHeader &p = a.header, &q = b.header;
  return Same(p.stamp, q.stamp) && p.topology_revision == q.topology_revision && p.slot == q.slot &&
         p.origin_x == q.origin_x && p.origin_y == q.origin_y && p.max_temperature_C == q.max_temperature_C &&
         a.texels == b.texels;
}

inline bool Same(const ThermalEvent& a, const ThermalEvent& b) {
  return Same(a.stamp, b.stamp) && a.session_time_s == b.session_time_s && a.kind == b.kind &&
         a.material == b.material && a.temperature_C == b.temperature_C && a.value == b.value &&
         a.topology_revision == b.topology_revision;
}

inline bool Same(const SceneManifest& a, const SceneManifest& b) {
  return Same(a.stamp, b.stamp) && a.scene_name == b.scene_name && a.session_id == b.session_id &&
         a.scene_hash == b.scene_hash && a.session_start_ns == b.session_start_ns && a.mode == b.mode &&
         a.recorded == b.recorded;
}

inline bool Same(const Command& a, const Command& b) {
  return Same(a.stamp, b.stamp) && a.request_id == b.request_id && a.target == b.target && a.verb == b.verb &&
         a.argument == b.argument;
}

inline bool Same(const CommandReply& a, const CommandReply& b) {
  return Same(a.stamp, b.stamp) && a.request_id == b.request_id && a.from == b.from && a.ok == b.ok && a.text == b.text;
}

inline bool Same(const ConsumedInput& a, const ConsumedInput& b) {
  return a.topic == b.topic && a.epoch == b.epoch && a.sequence == b.sequence;
}
inline bool Same(const TickManifest& a, const TickManifest& b) {
  return Same(a.stamp, b.stamp) && a.node == b.node && a.tick == b.tick && a.session_time_s == b.session_time_s &&
         a.state_hash == b.state_hash && AllSame(a.consumed, b.consumed);
}

inline bool Same(const TimingSummary& a, const TimingSummary& b) {
  return a.p50_us == b.p50_us && a.p99_us == b.p99_us && a.max_us == b.max_us;
}
inline bool Same(const InputHealth& a, const InputHealth& b) {
  return a.topic == b.topic && a.matched == b.matched && a.age_ms == b.age_ms && a.received == b.received &&
         a.lost == b.lost && a.rejected == b.rejected;
}
inline bool Same(const Metric& a, const Metric& b) { return a.name == b.name && a.value == b.value; }
inline bool Same(const Health& a, const Health& b) {
  return Same(a.stamp, b.stamp) && a.node == b.node && a.state == b.state && a.pid == b.pid &&
         a.schema_hash == b.schema_hash && a.scene_hash == b.scene_hash && a.rate_asked_Hz == b.rate_asked_Hz &&
         a.rate_achieved_Hz == b.rate_achieved_Hz && a.ticks == b.ticks && a.overruns == b.overruns &&
         a.write_failures == b.write_failures && Same(a.step, b.step) && Same(a.wake, b.wake) &&
         a.last_error == b.last_error && AllSame(a.inputs, b.inputs) && AllSame(a.metrics, b.metrics);
}

}  // namespace fulcrum
