// TissueFrame and TemperaturePatch in their loans, TopologyState, TearState, OpenCells, ThermalEvent.
#include <algorithm>
#include <cstring>

#include "services/bus/convert/convert.h"
#include "services/bus/convert/pieces.h"

namespace fulcrum::bus {

namespace cv = convert;

static_assert(idl::MAX_TISSUE_VERTICES == kMaxTissueVertices && idl::MAX_TISSUE_FLOATS == 3 * kMaxTissueVertices);
static_assert(idl::PATCH_TEXELS == kPatchTexels && idl::ATLAS_TEXELS == kAtlasTexels);
static_assert(idl::PATCH_BYTES == 4 * kPatchTexels * kPatchTexels);
static_assert(idl::MAX_MEMBRANE_NODES == kMaxMembraneNodes && idl::MAX_EDGES == 3 * kMaxMembraneNodes);
static_assert(idl::MAX_NODE_BYTES == kMaxMembraneNodes / 8 && idl::MAX_EDGE_BYTES == 3 * kMaxMembraneNodes / 8);
static_assert(idl::EVENT_QUARANTINE == static_cast<int>(ThermalEventKind::kQuarantine));

// A plain type is its header followed by its payload, without padding: so the payload begins at sizeof(header).
static_assert(sizeof(idl::TissueFrame) == sizeof(idl::TissueFrameHeader) + idl::MAX_TISSUE_FLOATS * sizeof(float));
static_assert(sizeof(idl::TemperaturePatch) == sizeof(idl::TemperaturePatchHeader) + idl::PATCH_BYTES);

namespace {

constexpr std::size_t kFrameOffset = sizeof(idl::TissueFrameHeader);
constexpr std::size_t kPatchOffset = sizeof(idl::TemperaturePatchHeader);

/// Headers are copied byte by byte: a loan need not be aligned for their 8-byte members.
template <class WireHeader>
void PutHeader(const WireHeader& header, std::byte* loan) {
  std::memcpy(loan, static_cast<const void*>(&header), sizeof header);
}
template <class WireHeader>
WireHeader GetHeader(const std::byte* loan) {
  WireHeader header;
  std::memcpy(static_cast<void*>(&header), loan, sizeof header);
  return header;
}

TissueFrameHeader FromWire(const idl::TissueFrameHeader& w) {
  return {.stamp = cv::FromWire(w.stamp()),
          .scene_hash = w.scene_hash(),
          .topology_revision = w.topology_revision(),
          .tool_sequence = w.tool_sequence(),
          .handle_sequence = w.handle_sequence(),
          .session_time_s = w.session_time_s(),
          .simulated_time_s = w.simulated_time_s(),
          .vertex_count = w.vertex_count(),
          .grasping_tools = w.grasping_tools()};
}

TemperaturePatchHeader FromWire(const idl::TemperaturePatchHeader& w) {
  return {.stamp = cv::FromWire(w.stamp()),
          .topology_revision = w.topology_revision(),
          .slot = w.slot(),
          .origin_x = w.origin_x(),
          .origin_y = w.origin_y(),
          .max_temperature_C = w.max_temperature_C()};
}

}  // namespace

TissueFrame::View OpenLoan(std::byte* loan, TissueFrameHeader* header) {
  *header = {};
  return {*header, {reinterpret_cast<float*>(loan + kFrameOffset), idl::MAX_TISSUE_FLOATS}};
}

bool CloseLoan(const TissueFrameHeader& header, std::byte* loan) {
  if (header.vertex_count > kMaxTissueVertices) return false;
  idl::TissueFrameHeader w;
  w.stamp(cv::ToWire(header.stamp));
  w.scene_hash(header.scene_hash);
  w.topology_revision(header.topology_revision);
  w.tool_sequence(header.tool_sequence);
  w.handle_sequence(header.handle_sequence);
  w.session_time_s(header.session_time_s);
  w.simulated_time_s(header.simulated_time_s);
  w.vertex_count(header.vertex_count);
  w.grasping_tools(header.grasping_tools);
  PutHeader(w, loan);
  return true;
}

bool ToLoan(const TissueFrame& from, std::byte* loan) {
  if (from.xyz.size() != std::size_t{3} * from.header.vertex_count) return false;
  if (!CloseLoan(from.header, loan)) return false;
  if (!from.xyz.empty()) std::memcpy(loan + kFrameOffset, from.xyz.data(), from.xyz.size() * sizeof(float));
  return true;
}

bool FromLoan(const std::byte* loan, TissueFrame* to) {
  to->header = FromWire(GetHeader<idl::TissueFrameHeader>(loan));
  if (to->header.vertex_count > kMaxTissueVertices) return false;
  const auto* xyz = reinterpret_cast<const float*>(loan + kFrameOffset);
  to->xyz.assign(xyz, xyz + std::size_t{3} * to->header.vertex_count);
  return true;
}

Stamp StampOfLoan(const std::byte* loan, const TissueFrame*) {
  return cv::FromWire(GetHeader<idl::TissueFrameHeader>(loan).stamp());
}

TemperaturePatch::View OpenLoan(std::byte* loan, TemperaturePatchHeader* header) {
  *header = {};
  return {*header, {reinterpret_cast<std::uint8_t*>(loan + kPatchOffset), idl::PATCH_BYTES}};
}

bool CloseLoan(const TemperaturePatchHeader& header, std::byte* loan) {
  idl::TemperaturePatchHeader w;
  w.stamp(cv::ToWire(header.stamp));
  w.topology_revision(header.topology_revision);
  w.slot(header.slot);
  w.origin_x(header.origin_x);
  w.origin_y(header.origin_y);
  w.max_temperature_C(header.max_temperature_C);
  PutHeader(w, loan);
  return true;
}

bool ToLoan(const TemperaturePatch& from, std::byte* loan) {
  if (from.texels.size() != idl::PATCH_BYTES || !CloseLoan(from.header, loan)) return false;
  std::memcpy(loan + kPatchOffset, from.texels.data(), from.texels.size());
  return true;
}

bool FromLoan(const std::byte* loan, TemperaturePatch* to) {
  to->header = FromWire(GetHeader<idl::TemperaturePatchHeader>(loan));
  const auto* texels = reinterpret_cast<const std::uint8_t*>(loan + kPatchOffset);
  to->texels.assign(texels, texels + idl::PATCH_BYTES);
  return true;
}

Stamp StampOfLoan(const std::byte* loan, const TemperaturePatch*) {
  return cv::FromWire(GetHeader<idl::TemperaturePatchHeader>(loan).stamp());
}

bool ToWire(const TopologyState& from, idl::TopologyState* to) {
  if (from.dead_nodes.size() > idl::MAX_NODE_BYTES || from.dead_edges.size() > idl::MAX_EDGE_BYTES ||
      from.shrink.size() > idl::MAX_EDGES) {
    return false;
  }
  to->stamp(cv::ToWire(from.stamp));
  to->scene_hash(from.scene_hash);
  to->revision(from.revision);
  to->rows(from.rows);
  to->cols(from.cols);
  to->cut_length_m(from.cut_length_m);
  to->cut_width_m(from.cut_width_m);
  to->cut_off_way_m(from.cut_off_way_m);
  to->dead_nodes(from.dead_nodes);
  to->dead_edges(from.dead_edges);
  to->shrink(from.shrink);
  return true;
}

void FromWire(const idl::TopologyState& from, TopologyState* to) {
  to->stamp = cv::FromWire(from.stamp());
  to->scene_hash = from.scene_hash();
  to->revision = from.revision();
  to->rows = from.rows();
  to->cols = from.cols();
  to->cut_length_m = from.cut_length_m();
  to->cut_width_m = from.cut_width_m();
  to->cut_off_way_m = from.cut_off_way_m();
  to->dead_nodes = from.dead_nodes();
  to->dead_edges = from.dead_edges();
  to->shrink = from.shrink();
}

bool ToWire(const TearState& from, idl::TearState* to) {
  if (from.torn_edges.size() > idl::MAX_EDGE_BYTES) return false;
  to->stamp(cv::ToWire(from.stamp));
  to->scene_hash(from.scene_hash);
  to->rows(from.rows);
  to->cols(from.cols);
  to->torn_edges(from.torn_edges);
  return true;
}

void FromWire(const idl::TearState& from, TearState* to) {
  to->stamp = cv::FromWire(from.stamp());
  to->scene_hash = from.scene_hash();
  to->rows = from.rows();
  to->cols = from.cols();
  to->torn_edges = from.torn_edges();
}

bool ToWire(const OpenCells& from, idl::OpenCells* to) {
  to->stamp(cv::ToWire(from.stamp));
  to->scene_hash(from.scene_hash);
  to->x(from.x);
  to->y(from.y);
  to->rows(from.rows);
  return true;
}

void FromWire(const idl::OpenCells& from, OpenCells* to) {
  to->stamp = cv::FromWire(from.stamp());
  to->scene_hash = from.scene_hash();
  to->x = from.x();
  to->y = from.y();
  to->rows = from.rows();
}

bool ToWire(const ThermalEvent& from, idl::ThermalEvent* to) {
  to->stamp(cv::ToWire(from.stamp));
  to->session_time_s(from.session_time_s);
  to->kind(cv::Octet(from.kind));
  to->material(cv::ToWire(from.material));
  to->temperature_C(from.temperature_C);
  to->value(from.value);
  to->topology_revision(from.topology_revision);
  return true;
}

void FromWire(const idl::ThermalEvent& from, ThermalEvent* to) {
  to->stamp = cv::FromWire(from.stamp());
  to->session_time_s = from.session_time_s();
  to->kind = static_cast<ThermalEventKind>(from.kind());
  to->material = cv::FromWire(from.material());
  to->temperature_C = from.temperature_C();
  to->value = from.value();
  to->topology_revision = from.topology_revision();
}

}  // namespace fulcrum::bus
