#include "services/transport/bus/gate.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "services/base/core/clips.h"

namespace fulcrum::bus {
namespace {

/// False for NaN too: every comparison with NaN is false.
bool Within(double x, double low, double high) { return x >= low && x <= high; }
bool Magnitude(double x, double limit) { return std::abs(x) <= limit; }
bool Magnitude(const Vec3f& v, float limit) {
  return std::abs(v.x()) <= limit && std::abs(v.y()) <= limit && std::abs(v.z()) <= limit;
}
bool Magnitude(const Vec2f& v, float limit) { return std::abs(v.x()) <= limit && std::abs(v.y()) <= limit; }

bool IsUnit(const Vec3f& v) { return Within(v.squaredNorm(), 1.0f - kUnitTolerance, 1.0f + kUnitTolerance); }
bool IsUnit(const Quatf& q) { return Within(q.squaredNorm(), 1.0f - kUnitTolerance, 1.0f + kUnitTolerance); }

template <class Enum>
bool UpTo(Enum value, Enum last) {
  return static_cast<unsigned>(value) <= static_cast<unsigned>(last);
}
bool IsTopic(TopicId id) { return static_cast<int>(id) < kTopicCount; }
bool IsNode(NodeId id) { return static_cast<int>(id) < kNodeCount; }

bool IsStamp(const Stamp& s) { return s.stamp_ns >= 0; }

/// Whether the text is a name without control characters. Bytes that are no valid message decode to empty names or to
/// names with such characters.
bool IsName(const std::string& name, std::size_t longest) {
  return !name.empty() && name.size() <= longest && std::none_of(name.begin(), name.end(), [](char c) {
    return static_cast<unsigned char>(c) < 0x20 || c == 0x7f;
  });
}

/// Accepts negative times, which occur before the start of the session is known.
bool IsSessionTime(double t) { return Magnitude(t, 1e9); }

/// Branch-free over the whole range so that it compiles to vector code: 77,000 floats pass in about 10 us.
bool AllWithin(std::span<const float> values, float limit) {
  unsigned bad = 0;
  for (const float x : values) bad |= static_cast<unsigned>(!(std::abs(x) <= limit));
  return bad == 0;
}

bool IsTool(const ToolSample& t) {
  return UpTo(t.kind, ToolKind::kClipApplier) && UpTo(t.state, ServoState::kRise) &&
         Magnitude(t.p_WT, kMaxCoordinate_m) && IsUnit(t.q_WT) && Magnitude(t.v_WT, kMaxSpeed_m_s) &&
         Magnitude(t.w_WT, kMaxTurnRate_rad_s) && Magnitude(t.f_W, kMaxForce_N) && Within(t.model_age_s, 0.0, 1e9);
}

bool IsClip(const Clip& c) {
  const auto& a = c.anchors;
  return Magnitude(c.p_AC, kMaxCoordinate_m) && IsUnit(c.q_AC) && Within(c.length_m, 0.0, kMaxClipLength_m) &&
         c.tool < kMaxTools && a[0] != a[1] && a[1] != a[2] && a[2] != a[0] &&
         std::all_of(a.begin(), a.end(), [](std::uint32_t vertex) { return vertex < kMaxTissueVertices; });
}

bool IsContact(const Contact& c) {
  return UpTo(c.kind, ContactKind::kGrasp) && Magnitude(c.x_ref, kMaxCoordinate_m) && Magnitude(c.f_ref, kMaxForce_N) &&
         IsUnit(c.n) && IsUnit(c.e1) && Magnitude(c.p_s, kMaxCoordinate_m) && Magnitude(c.v_s, kMaxSpeed_m_s) &&
         Magnitude(c.u_c, kMaxCoordinate_m) && Magnitude(c.du_c, kMaxSpeed_m_s) && Magnitude(c.gap, kMaxCoordinate_m) &&
         Within(c.k1, 0.0, kMaxCoefficient) && Within(c.k3, 0.0, kMaxCoefficient) &&
         Within(c.kt, 0.0, kMaxCoefficient) && Within(c.k_body, 0.0, kMaxCoefficient) &&
         Within(c.b_body, 0.0, kMaxCoefficient) && Within(c.friction, 0.0, 10.0) &&
         Magnitude(c.kappa1, kMaxCoefficient) && Magnitude(c.kappa2, kMaxCoefficient) &&
         Within(c.slip_force, 0.0, kMaxForce_N) && Within(c.radius, 0.0, kMaxCoordinate_m);
}

/// Entries beyond `count` are checked as well: a node never reads them, but they are copied with the message.
bool IsDevice(const DeviceContacts& d) {
  return d.count <= kMaxContacts && Magnitude(d.p_ext_W, kMaxPower_W) && Within(d.force_cap_N, 0.0, kMaxForce_N) &&
         std::all_of(d.contacts.begin(), d.contacts.end(), IsContact);
}

bool IsTiming(const TimingSummary& t) {
  return Within(t.p50_us, 0.0, 1e12) && Within(t.p99_us, 0.0, 1e12) && Within(t.max_us, 0.0, 1e12);
}

bool ArePedals(std::uint8_t bits) { return (bits & ~unsigned{kPedalCut | kPedalCoag | kPedalBlend}) == 0; }

}  // namespace

bool PassesGate(const HandleState& m) noexcept {
  return IsStamp(m.stamp) && ArePedals(m.pedals) &&
         std::all_of(m.handles.begin(), m.handles.end(), [](const HandleSample& h) {
           return Magnitude(h.jaw_angle_rad, kMaxJawAngle_rad) && Magnitude(h.jaw_rate_rad_s, kMaxTurnRate_rad_s) &&
                  Within(h.quality, 0.0, 1.0);
         });
}

bool PassesGate(const GeneratorSetting& m) noexcept {
  return IsStamp(m.stamp) && Within(m.cut_W, 0.0, kMaxSetPower_W) && Within(m.coag_W, 0.0, kMaxSetPower_W) &&
         Within(m.blend_W, 0.0, kMaxSetPower_W);
}

bool PassesGate(const OperatorInput& m) noexcept {
  return IsStamp(m.stamp) && m.claim_ns >= 0 && m.claim_ns <= m.stamp.stamp_ns && ArePedals(m.pedals) &&
         UpTo(m.source, OperatorSource::kBrowser) &&
         std::all_of(m.tools.begin(), m.tools.end(), [](const OperatorTool& t) {
           return Magnitude(t.p_WT, kMaxCoordinate_m) && Magnitude(t.jaw_angle_rad, kMaxJawAngle_rad) &&
                  Magnitude(t.roll_rad, kMaxRoll_rad);
         });
}

bool PassesGate(const ToolState& m) noexcept {
  return IsStamp(m.stamp) && std::all_of(m.tools.begin(), m.tools.end(), IsTool);
}

/// Longest announced time without a frame [s].
constexpr double kMaxSilence_s = 10;

bool PassesGate(const TissueFrame& m) noexcept {
  const TissueFrameHeader& h = m.header;
  return IsStamp(h.stamp) && IsSessionTime(h.session_time_s) && IsSessionTime(h.simulated_time_s) &&
         Within(h.next_within_s, 0.0, kMaxSilence_s) && h.vertex_count <= kMaxTissueVertices &&
         (h.grasping_tools >> kMaxTools) == 0 && m.xyz.size() == 3 * std::size_t{h.vertex_count} &&
         AllWithin(m.xyz, kMaxCoordinate_m);
}

bool PassesGate(const ContactModel& m) noexcept {
  return IsStamp(m.stamp) && m.tool_stamp_ns >= 0 && Within(m.physics_dt_s, 0.0, 10.0) &&
         std::all_of(m.devices.begin(), m.devices.end(), IsDevice);
}

bool PassesGate(const CauteryContact& m) noexcept {
  const auto& b = m.barycentric;
  const bool weights_in_range =
      std::all_of(b.begin(), b.end(), [](float w) { return Within(w, -kUnitTolerance, 1.0f + kUnitTolerance); });
  const bool place_is_known = m.triangle != kNoIndex && Magnitude(b[0] + b[1] + b[2] - 1.0f, kUnitTolerance);
  return IsStamp(m.stamp) && IsSessionTime(m.session_time_s) && m.tool < kMaxTools && weights_in_range &&
         (!(m.touching || m.on_solid) || place_is_known) && !(m.on_solid && (m.touching || m.tented)) &&
         Magnitude(m.material, kMaxCoordinate_m) && Magnitude(m.material_rate, kMaxSpeed_m_s) &&
         Within(m.contact_radius_m, 0.0, kMaxCoordinate_m) && m.footprint.whole();
}

bool PassesGate(const TopologyState& m) noexcept {
  const std::uint64_t nodes = std::uint64_t{m.rows} * m.cols;
  return IsStamp(m.stamp) && nodes <= kMaxMembraneNodes && m.dead_nodes.size() == (nodes + 7) / 8 &&
         m.dead_edges.size() == (3 * nodes + 7) / 8 && m.shrink.size() == 3 * nodes &&
         Within(m.cut_length_m, 0.0, 1e3) && Within(m.cut_width_m, 0.0, 1.0) && Within(m.cut_off_way_m, 0.0, 1.0);
}

bool PassesGate(const TearState& m) noexcept {
  const std::uint64_t nodes = std::uint64_t{m.rows} * m.cols;
  return IsStamp(m.stamp) && nodes <= kMaxMembraneNodes && m.torn_edges.size() == (3 * nodes + 7) / 8;
}

bool PassesGate(const OpenCells& m) noexcept { return IsStamp(m.stamp) && Magnitude(m.x, 1e8) && Magnitude(m.y, 1e8); }

bool PassesGate(const ClipState& m) noexcept {
  return IsStamp(m.stamp) && m.count <= kMaxClips && std::all_of(m.clips.begin(), m.clips.begin() + m.count, IsClip);
}

bool PassesGate(const TemperaturePatch& m) noexcept {
  const TemperaturePatchHeader& h = m.header;
  constexpr std::uint32_t kLastOrigin = kAtlasTexels - kPatchTexels;
  return IsStamp(h.stamp) && UpTo(h.surface, BurntSurface::kSolids) && h.origin_x <= kLastOrigin &&
         h.origin_y <= kLastOrigin && Within(h.max_temperature_C, kMinTemperature_C, kMaxTemperature_C) &&
         m.texels.size() == std::size_t{4} * kPatchTexels * kPatchTexels;
}

bool PassesGate(const Picture& m) noexcept {
  constexpr std::uint32_t kMaxEdge_px = 16384;
  constexpr float kMaxScale = 4;            // render::QualityControl::kMostScale.
  constexpr std::size_t kShortestJpeg = 4;  // Its first and its last mark.
  const PictureHeader& h = m.header;
  const auto unit = [](const Vec3f& v) { return Within(v.norm(), 1.0f - kUnitTolerance, 1.0f + kUnitTolerance); };
  return IsStamp(h.stamp) && IsSessionTime(h.session_time_s) && h.width >= 1 && h.width <= kMaxEdge_px &&
         h.height >= 1 && h.height <= kMaxEdge_px && h.size <= kMaxPictureBytes && m.jpeg.size() == h.size &&
         h.size >= kShortestJpeg && m.jpeg[0] == 0xff && m.jpeg[1] == 0xd8 &&
         (h.present | h.scopes) >> kMaxTools == 0 && Magnitude(h.eye_W, kMaxCoordinate_m) && unit(h.right_W) &&
         unit(h.up_W) && unit(h.forward_W) && Within(h.pixel_rad, 1e-6f, 1.0f) && Within(h.scale, 1e-3f, kMaxScale) &&
         std::all_of(h.tip_W.begin(), h.tip_W.end(), [](const Vec3f& p) { return Magnitude(p, kMaxCoordinate_m); });
}

bool PassesGate(const ThermalEvent& m) noexcept {
  return IsStamp(m.stamp) && IsSessionTime(m.session_time_s) && UpTo(m.kind, ThermalEventKind::kSolidBurn) &&
         Magnitude(m.material, kMaxCoordinate_m) && Within(m.temperature_C, kMinTemperature_C, kMaxTemperature_C) &&
         std::isfinite(m.value);
}

// A manifest of another scene ends a node, so corrupt bytes that happen to decode to a manifest must not pass.
bool PassesGate(const SceneManifest& m) noexcept {
  return IsStamp(m.stamp) && UpTo(m.mode, SessionMode::kLockStep) && m.session_start_ns >= 0 &&
         IsName(m.scene_name, kMaxSceneName) && IsName(m.session_id, kMaxSessionId);
}

bool PassesGate(const TickManifest& m) noexcept {
  return IsStamp(m.stamp) && IsNode(m.node) && IsSessionTime(m.session_time_s) &&
         m.consumed.size() <= kMaxConsumedInputs && m.tick_times_ns.size() <= kMaxTickTimes &&
         std::all_of(m.tick_times_ns.begin(), m.tick_times_ns.end(), [](std::int64_t ns) { return ns >= 0; }) &&
         std::all_of(m.consumed.begin(), m.consumed.end(), [](const ConsumedInput& c) { return IsTopic(c.topic); });
}

bool PassesGate(const Health& m) noexcept {
  return IsStamp(m.stamp) && IsNode(m.node) && UpTo(m.state, HealthState::kStopping) && m.pid >= 0 &&
         Within(m.rate_asked_Hz, 0.0, 1e6) && Within(m.rate_achieved_Hz, 0.0, 1e6) && IsTiming(m.step) &&
         IsTiming(m.wake) && m.inputs.size() <= kMaxInputHealths && m.metrics.size() <= kMaxMetrics &&
         std::all_of(m.inputs.begin(), m.inputs.end(),
                     [](const InputHealth& i) { return IsTopic(i.topic) && std::isfinite(i.age_ms); }) &&
         std::all_of(m.metrics.begin(), m.metrics.end(), [](const Metric& metric) {
           return metric.name.size() <= kMaxMetricName && std::isfinite(metric.value);
         });
}

}  // namespace fulcrum::bus
