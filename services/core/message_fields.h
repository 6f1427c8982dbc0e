// The fields of each message by name, for whoever must treat all messages alike: printing, comparing, exporting.
//
//   ForEachField<Stamp>([&](const char* name, auto member) { std::cout << name << ' ' << stamp.*member << '\n'; });
#pragma once

#include <array>
#include <cstddef>
#include <tuple>
#include <type_traits>
#include <vector>

#include "services/core/messages.h"

namespace fulcrum {

template <class Message, class Value>
struct Field {
  const char* name;
  Value Message::*member;
};
template <class Message, class Value>
Field(const char*, Value Message::*) -> Field<Message, Value>;

/// `list`: a tuple of Field, in the order of the struct. Specialised for each message and what it is made of.
template <class T>
struct FieldsOf;

#define FULCRUM_FIELD(T, name) \
  Field { #name, &T::name }

template <>
struct FieldsOf<Stamp> {
  static constexpr auto list =
      std::tuple{FULCRUM_FIELD(Stamp, sequence), FULCRUM_FIELD(Stamp, epoch), FULCRUM_FIELD(Stamp, stamp_ns)};
};
template <>
struct FieldsOf<HandleSample> {
  static constexpr auto list =
      std::tuple{FULCRUM_FIELD(HandleSample, present), FULCRUM_FIELD(HandleSample, jaw_angle_rad),
                 FULCRUM_FIELD(HandleSample, jaw_rate_rad_s), FULCRUM_FIELD(HandleSample, quality),
                 FULCRUM_FIELD(HandleSample, raw_counts)};
};
template <>
struct FieldsOf<HandleState> {
  static constexpr auto list = std::tuple{FULCRUM_FIELD(HandleState, stamp), FULCRUM_FIELD(HandleState, handles),
                                          FULCRUM_FIELD(HandleState, pedals)};
};
template <>
struct FieldsOf<GeneratorSetting> {
  static constexpr auto list =
      std::tuple{FULCRUM_FIELD(GeneratorSetting, stamp), FULCRUM_FIELD(GeneratorSetting, cut_W),
                 FULCRUM_FIELD(GeneratorSetting, coag_W), FULCRUM_FIELD(GeneratorSetting, blend_W)};
};
template <>
struct FieldsOf<ToolSample> {
  static constexpr auto list = std::tuple{FULCRUM_FIELD(ToolSample, kind), FULCRUM_FIELD(ToolSample, state),
                                          FULCRUM_FIELD(ToolSample, p_WT), FULCRUM_FIELD(ToolSample, q_WT),
                                          FULCRUM_FIELD(ToolSample, v_WT), FULCRUM_FIELD(ToolSample, w_WT),
                                          FULCRUM_FIELD(ToolSample, f_W),  FULCRUM_FIELD(ToolSample, model_age_s)};
};
template <>
struct FieldsOf<ToolState> {
  static constexpr auto list = std::tuple{FULCRUM_FIELD(ToolState, stamp), FULCRUM_FIELD(ToolState, tools)};
};
template <>
struct FieldsOf<TissueFrameHeader> {
  static constexpr auto list = std::tuple{FULCRUM_FIELD(TissueFrameHeader, stamp),
                                          FULCRUM_FIELD(TissueFrameHeader, scene_hash),
                                          FULCRUM_FIELD(TissueFrameHeader, topology_revision),
                                          FULCRUM_FIELD(TissueFrameHeader, tool_sequence),
                                          FULCRUM_FIELD(TissueFrameHeader, handle_sequence),
                                          FULCRUM_FIELD(TissueFrameHeader, session_time_s),
                                          FULCRUM_FIELD(TissueFrameHeader, simulated_time_s),
                                          FULCRUM_FIELD(TissueFrameHeader, vertex_count),
                                          FULCRUM_FIELD(TissueFrameHeader, grasping_tools)};
};
template <>
struct FieldsOf<TissueFrame> {
  static constexpr auto list = std::tuple{FULCRUM_FIELD(TissueFrame, header), FULCRUM_FIELD(TissueFrame, xyz)};
};
template <>
struct FieldsOf<Contact> {
  static constexpr auto list =
      std::tuple{FULCRUM_FIELD(Contact, kind),   FULCRUM_FIELD(Contact, id),         FULCRUM_FIELD(Contact, x_ref),
                 FULCRUM_FIELD(Contact, f_ref),  FULCRUM_FIELD(Contact, n),          FULCRUM_FIELD(Contact, e1),
                 FULCRUM_FIELD(Contact, p_s),    FULCRUM_FIELD(Contact, v_s),        FULCRUM_FIELD(Contact, u_c),
                 FULCRUM_FIELD(Contact, du_c),   FULCRUM_FIELD(Contact, gap),        FULCRUM_FIELD(Contact, k1),
                 FULCRUM_FIELD(Contact, k3),     FULCRUM_FIELD(Contact, kt),         FULCRUM_FIELD(Contact, k_body),
                 FULCRUM_FIELD(Contact, b_body), FULCRUM_FIELD(Contact, friction),   FULCRUM_FIELD(Contact, kappa1),
                 FULCRUM_FIELD(Contact, kappa2), FULCRUM_FIELD(Contact, slip_force), FULCRUM_FIELD(Contact, radius)};
};
template <>
struct FieldsOf<DeviceContacts> {
  static constexpr auto list =
      std::tuple{FULCRUM_FIELD(DeviceContacts, count), FULCRUM_FIELD(DeviceContacts, p_ext_W),
                 FULCRUM_FIELD(DeviceContacts, force_cap_N), FULCRUM_FIELD(DeviceContacts, contacts)};
};
template <>
struct FieldsOf<ContactModel> {
  static constexpr auto list =
      std::tuple{FULCRUM_FIELD(ContactModel, stamp), FULCRUM_FIELD(ContactModel, tool_sequence),
                 FULCRUM_FIELD(ContactModel, tool_stamp_ns), FULCRUM_FIELD(ContactModel, physics_dt_s),
                 FULCRUM_FIELD(ContactModel, devices)};
};
template <>
struct FieldsOf<Footprint> {
  static constexpr auto list = std::tuple{FULCRUM_FIELD(Footprint, x), FULCRUM_FIELD(Footprint, y),
                                          FULCRUM_FIELD(Footprint, width), FULCRUM_FIELD(Footprint, gap)};
};
template <>
struct FieldsOf<CauteryContact> {
  static constexpr auto list = std::tuple{FULCRUM_FIELD(CauteryContact, stamp),
                                          FULCRUM_FIELD(CauteryContact, session_time_s),
                                          FULCRUM_FIELD(CauteryContact, topology_revision),
                                          FULCRUM_FIELD(CauteryContact, touching),
                                          FULCRUM_FIELD(CauteryContact, tented),
                                          FULCRUM_FIELD(CauteryContact, tool),
                                          FULCRUM_FIELD(CauteryContact, triangle),
                                          FULCRUM_FIELD(CauteryContact, barycentric),
                                          FULCRUM_FIELD(CauteryContact, material),
                                          FULCRUM_FIELD(CauteryContact, material_rate),
                                          FULCRUM_FIELD(CauteryContact, contact_radius_m),
                                          FULCRUM_FIELD(CauteryContact, footprint)};
};
template <>
struct FieldsOf<TopologyState> {
  static constexpr auto list =
      std::tuple{FULCRUM_FIELD(TopologyState, stamp),       FULCRUM_FIELD(TopologyState, scene_hash),
                 FULCRUM_FIELD(TopologyState, revision),    FULCRUM_FIELD(TopologyState, rows),
                 FULCRUM_FIELD(TopologyState, cols),        FULCRUM_FIELD(TopologyState, cut_length_m),
                 FULCRUM_FIELD(TopologyState, cut_width_m), FULCRUM_FIELD(TopologyState, cut_off_way_m),
                 FULCRUM_FIELD(TopologyState, dead_nodes),  FULCRUM_FIELD(TopologyState, dead_edges),
                 FULCRUM_FIELD(TopologyState, shrink)};
};
template <>
struct FieldsOf<TearState> {
  static constexpr auto list =
      std::tuple{FULCRUM_FIELD(TearState, stamp), FULCRUM_FIELD(TearState, scene_hash), FULCRUM_FIELD(TearState, rows),
                 FULCRUM_FIELD(TearState, cols), FULCRUM_FIELD(TearState, torn_edges)};
};
template <>
struct FieldsOf<OpenCells> {
  static constexpr auto list =
      std::tuple{FULCRUM_FIELD(OpenCells, stamp), FULCRUM_FIELD(OpenCells, scene_hash), FULCRUM_FIELD(OpenCells, x),
                 FULCRUM_FIELD(OpenCells, y), FULCRUM_FIELD(OpenCells, rows)};
};
template <>
struct FieldsOf<TemperaturePatchHeader> {
  static constexpr auto list = std::tuple{
      FULCRUM_FIELD(TemperaturePatchHeader, stamp),    FULCRUM_FIELD(TemperaturePatchHeader, topology_revision),
      FULCRUM_FIELD(TemperaturePatchHeader, slot),     FULCRUM_FIELD(TemperaturePatchHeader, origin_x),
      FULCRUM_FIELD(TemperaturePatchHeader, origin_y), FULCRUM_FIELD(TemperaturePatchHeader, max_temperature_C)};
};
template <>
struct FieldsOf<TemperaturePatch> {
  static constexpr auto list =
      std::tuple{FULCRUM_FIELD(TemperaturePatch, header), FULCRUM_FIELD(TemperaturePatch, texels)};
};
template <>
struct FieldsOf<ThermalEvent> {
  static constexpr auto list = std::tuple{FULCRUM_FIELD(ThermalEvent, stamp),
                                          FULCRUM_FIELD(ThermalEvent, session_time_s),
                                          FULCRUM_FIELD(ThermalEvent, kind),
                                          FULCRUM_FIELD(ThermalEvent, material),
                                          FULCRUM_FIELD(ThermalEvent, temperature_C),
                                          FULCRUM_FIELD(ThermalEvent, value),
                                          FULCRUM_FIELD(ThermalEvent, topology_revision)};
};
template <>
struct FieldsOf<SceneManifest> {
  static constexpr auto list = std::tuple{FULCRUM_FIELD(SceneManifest, stamp),
                                          FULCRUM_FIELD(SceneManifest, scene_name),
                                          FULCRUM_FIELD(SceneManifest, session_id),
                                          FULCRUM_FIELD(SceneManifest, scene_hash),
                                          FULCRUM_FIELD(SceneManifest, session_start_ns),
                                          FULCRUM_FIELD(SceneManifest, mode),
                                          FULCRUM_FIELD(SceneManifest, recorded)};
};
template <>
struct FieldsOf<Command> {
  static constexpr auto list =
      std::tuple{FULCRUM_FIELD(Command, stamp), FULCRUM_FIELD(Command, request_id), FULCRUM_FIELD(Command, target),
                 FULCRUM_FIELD(Command, verb), FULCRUM_FIELD(Command, argument)};
};
template <>
struct FieldsOf<CommandReply> {
  static constexpr auto list =
      std::tuple{FULCRUM_FIELD(CommandReply, stamp), FULCRUM_FIELD(CommandReply, request_id),
                 FULCRUM_FIELD(CommandReply, from), FULCRUM_FIELD(CommandReply, ok), FULCRUM_FIELD(CommandReply, text)};
};
template <>
struct FieldsOf<ConsumedInput> {
  static constexpr auto list = std::tuple{FULCRUM_FIELD(ConsumedInput, topic), FULCRUM_FIELD(ConsumedInput, epoch),
                                          FULCRUM_FIELD(ConsumedInput, sequence)};
};
template <>
struct FieldsOf<TickManifest> {
  static constexpr auto list =
      std::tuple{FULCRUM_FIELD(TickManifest, stamp),      FULCRUM_FIELD(TickManifest, node),
                 FULCRUM_FIELD(TickManifest, tick),       FULCRUM_FIELD(TickManifest, session_time_s),
                 FULCRUM_FIELD(TickManifest, state_hash), FULCRUM_FIELD(TickManifest, consumed)};
};
template <>
struct FieldsOf<TimingSummary> {
  static constexpr auto list = std::tuple{FULCRUM_FIELD(TimingSummary, p50_us), FULCRUM_FIELD(TimingSummary, p99_us),
                                          FULCRUM_FIELD(TimingSummary, max_us)};
};
template <>
struct FieldsOf<InputHealth> {
  static constexpr auto list = std::tuple{FULCRUM_FIELD(InputHealth, topic),  FULCRUM_FIELD(InputHealth, matched),
                                          FULCRUM_FIELD(InputHealth, age_ms), FULCRUM_FIELD(InputHealth, received),
                                          FULCRUM_FIELD(InputHealth, lost),   FULCRUM_FIELD(InputHealth, rejected)};
};
template <>
struct FieldsOf<Metric> {
  static constexpr auto list = std::tuple{FULCRUM_FIELD(Metric, name), FULCRUM_FIELD(Metric, value)};
};
template <>
struct FieldsOf<Health> {
  static constexpr auto list =
      std::tuple{FULCRUM_FIELD(Health, stamp),          FULCRUM_FIELD(Health, node),
                 FULCRUM_FIELD(Health, state),          FULCRUM_FIELD(Health, pid),
                 FULCRUM_FIELD(Health, schema_hash),    FULCRUM_FIELD(Health, scene_hash),
                 FULCRUM_FIELD(Health, rate_asked_Hz),  FULCRUM_FIELD(Health, rate_achieved_Hz),
                 FULCRUM_FIELD(Health, ticks),          FULCRUM_FIELD(Health, overruns),
                 FULCRUM_FIELD(Health, write_failures), FULCRUM_FIELD(Health, step),
                 FULCRUM_FIELD(Health, wake),           FULCRUM_FIELD(Health, last_error),
                 FULCRUM_FIELD(Health, inputs),         FULCRUM_FIELD(Health, metrics)};
};
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
