// The fields of each message and of its parts, by name, in the order of the struct. From this one list are made the
// walks below, which print, compare and export messages, and the conversions to the wire
// (services/transport/bus/convert).
//
//   ForEachField<Stamp>([&](const char* name, auto member) { std::cout << name << ' ' << stamp.*member << '\n'; });
#pragma once

#include <cstddef>
#include <tuple>
#include <type_traits>

#include "services/base/core/messages.h"

namespace fulcrum {

// F(field) for each field of a struct.
// clang-format off
#define FULCRUM_FIELDS_OF_Stamp(F) F(sequence) F(epoch) F(stamp_ns)
#define FULCRUM_FIELDS_OF_HandleSample(F) F(present) F(jaw_angle_rad) F(jaw_rate_rad_s) F(quality) F(raw_counts)
#define FULCRUM_FIELDS_OF_HandleState(F) F(stamp) F(handles) F(pedals)
#define FULCRUM_FIELDS_OF_GeneratorSetting(F) F(stamp) F(cut_W) F(coag_W) F(blend_W)
#define FULCRUM_FIELDS_OF_OperatorTool(F) F(p_WT) F(jaw_angle_rad) F(roll_rad) F(moves)
#define FULCRUM_FIELDS_OF_OperatorInput(F) F(stamp) F(claim_ns) F(tools) F(pedals) F(source)
#define FULCRUM_FIELDS_OF_ToolSample(F) F(kind) F(state) F(p_WT) F(q_WT) F(v_WT) F(w_WT) F(f_W) F(model_age_s) F(buttons)
#define FULCRUM_FIELDS_OF_ToolState(F) F(stamp) F(tools)
#define FULCRUM_FIELDS_OF_TissueFrameHeader(F) F(stamp) F(scene_hash) F(topology_revision) F(tool_sequence) \
  F(handle_sequence) F(session_time_s) F(simulated_time_s) F(next_within_s) F(vertex_count) F(grasping_tools)
#define FULCRUM_FIELDS_OF_TissueFrame(F) F(header) F(xyz)
#define FULCRUM_FIELDS_OF_Contact(F) F(kind) F(id) F(x_ref) F(f_ref) F(n) F(e1) F(p_s) F(v_s) F(u_c) F(du_c) F(gap) \
  F(k1) F(k3) F(kt) F(k_body) F(b_body) F(friction) F(kappa1) F(kappa2) F(slip_force) F(radius)
#define FULCRUM_FIELDS_OF_DeviceContacts(F) F(count) F(p_ext_W) F(force_cap_N) F(contacts)
#define FULCRUM_FIELDS_OF_ContactModel(F) F(stamp) F(tool_sequence) F(tool_stamp_ns) F(physics_dt_s) F(devices)
#define FULCRUM_FIELDS_OF_Footprint(F) F(x) F(y) F(width) F(gap)
#define FULCRUM_FIELDS_OF_CauteryContact(F) F(stamp) F(session_time_s) F(topology_revision) F(touching) F(tented) \
  F(on_solid) F(tool) F(triangle) F(barycentric) F(material) F(material_rate) F(contact_radius_m) F(footprint)
#define FULCRUM_FIELDS_OF_TopologyState(F) F(stamp) F(scene_hash) F(revision) F(rows) F(cols) F(cut_length_m) \
  F(cut_width_m) F(cut_off_way_m) F(dead_nodes) F(dead_edges) F(shrink)
#define FULCRUM_FIELDS_OF_TearState(F) F(stamp) F(scene_hash) F(rows) F(cols) F(torn_edges)
#define FULCRUM_FIELDS_OF_OpenCells(F) F(stamp) F(scene_hash) F(x) F(y) F(rows)
#define FULCRUM_FIELDS_OF_Clip(F) F(p_AC) F(q_AC) F(anchors) F(length_m) F(tool)
#define FULCRUM_FIELDS_OF_ClipState(F) F(stamp) F(scene_hash) F(count) F(clips)
#define FULCRUM_FIELDS_OF_TemperaturePatchHeader(F) F(stamp) F(topology_revision) F(slot) F(surface) F(origin_x) F(origin_y) \
  F(max_temperature_C)
#define FULCRUM_FIELDS_OF_TemperaturePatch(F) F(header) F(texels)
#define FULCRUM_FIELDS_OF_PictureHeader(F) F(stamp) F(session_time_s) F(tool_sequence) F(tissue_sequence) F(width) \
  F(height) F(size) F(present) F(scopes) F(eye_W) F(right_W) F(up_W) F(forward_W) F(pixel_rad) F(tip_W) F(scale)
#define FULCRUM_FIELDS_OF_Picture(F) F(header) F(jpeg)
#define FULCRUM_FIELDS_OF_ThermalEvent(F) F(stamp) F(session_time_s) F(kind) F(material) F(temperature_C) F(value) \
  F(solid) F(topology_revision)
#define FULCRUM_FIELDS_OF_SceneManifest(F) F(stamp) F(scene_name) F(session_id) F(scene_hash) F(session_start_ns) \
  F(mode) F(recorded)
#define FULCRUM_FIELDS_OF_ConsumedInput(F) F(topic) F(epoch) F(sequence)
#define FULCRUM_FIELDS_OF_TickManifest(F) F(stamp) F(node) F(tick) F(session_time_s) F(state_hash) F(consumed) F(tick_times_ns)
#define FULCRUM_FIELDS_OF_TimingSummary(F) F(p50_us) F(p99_us) F(max_us)
#define FULCRUM_FIELDS_OF_InputHealth(F) F(topic) F(matched) F(age_ms) F(received) F(lost) F(rejected)
#define FULCRUM_FIELDS_OF_Metric(F) F(name) F(value)
#define FULCRUM_FIELDS_OF_Health(F) F(stamp) F(node) F(state) F(pid) F(schema_hash) F(scene_hash) F(rate_asked_Hz) \
  F(rate_achieved_Hz) F(ticks) F(overruns) F(write_failures) F(step) F(wake) F(last_error) F(inputs) F(metrics)

/// S(T) for each struct whose fields have the same names in IDL: its conversion is generated from its list.
#define FULCRUM_STRUCTS_ALIKE_IN_IDL(S) S(HandleSample) S(HandleState) S(GeneratorSetting) S(OperatorTool) \
  S(OperatorInput) S(ToolSample) \
  S(ToolState) S(TissueFrameHeader) S(Contact) S(DeviceContacts) S(ContactModel) S(Footprint) S(CauteryContact) \
  S(TopologyState) S(TearState) S(OpenCells) S(Clip) S(ClipState) S(TemperaturePatchHeader) S(PictureHeader) S(ThermalEvent) S(SceneManifest) \
  S(TickManifest) S(TimingSummary) S(InputHealth) S(Metric) S(Health)
/// The others: `sequence` is a keyword of IDL, and the three large messages are sent in loans.
#define FULCRUM_STRUCTS_WITH_A_CONVERSION_OF_THEIR_OWN(S) S(Stamp) S(ConsumedInput) S(TissueFrame) \
  S(TemperaturePatch) S(Picture)
// clang-format on

template <class Message, class Value>
struct Field {
  const char* name;
  Value Message::*member;
};
template <class Message, class Value>
Field(const char*, Value Message::*) -> Field<Message, Value>;

/// `list`: a tuple of Field, in the order of the struct.
template <class T>
struct FieldsOf;

namespace fields {

template <class... Fields>
constexpr auto List(std::nullptr_t, Fields... fields) {
  return std::tuple{fields...};
}

/// Size of a struct with these members.
template <class Message, class... Values>
constexpr std::size_t SizeOf(const std::tuple<Field<Message, Values>...>&) {
  std::size_t size = 0;
  const auto up_to = [&size](std::size_t alignment) { size = (size + alignment - 1) / alignment * alignment; };
  ((up_to(alignof(Values)), size += sizeof(Values)), ...);
  up_to(alignof(Message));
  return size;
}

}  // namespace fields

#define FULCRUM_FIELD(name) \
  , Field { #name, &Struct::name }
#define FULCRUM_DESCRIBE(T)                                                                  \
  template <>                                                                                \
  struct FieldsOf<T> {                                                                       \
    using Struct = T;                                                                        \
    static constexpr auto list = fields::List(nullptr FULCRUM_FIELDS_OF_##T(FULCRUM_FIELD)); \
  };                                                                                         \
  static_assert(fields::SizeOf(FieldsOf<T>::list) == sizeof(T), "a field of " #T " is missing in its list");
FULCRUM_STRUCTS_ALIKE_IN_IDL(FULCRUM_DESCRIBE)
FULCRUM_STRUCTS_WITH_A_CONVERSION_OF_THEIR_OWN(FULCRUM_DESCRIBE)
#undef FULCRUM_DESCRIBE
#undef FULCRUM_FIELD

/// A struct of messages.h whose fields are known.
template <class T>
concept HasFields = requires {
  FieldsOf<T>::list;
};

/// visit(name, pointer to member) for each field.
template <HasFields T, class Visit>
void ForEachField(const Visit& visit) {
  std::apply([&](const auto&... field) { (visit(field.name, field.member), ...); }, FieldsOf<T>::list);
}

}  // namespace fulcrum
