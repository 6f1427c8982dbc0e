#include "services/transport/bus/gate.h"

#include <gtest/gtest.h>

#include <functional>
#include <limits>
#include <string>
#include <type_traits>
#include <vector>

#include "render_node/geometry/quality.h"
#include "services/base/core/message_fields.h"
#include "tests/unit/bus/message_types.h"
#include "tests/unit/bus/samples.h"

namespace fulcrum::bus {
namespace {

/// Calls `visit` for every floating-point number of a message; in long lists only for three.
template <class T, class Visit>
void ForEachFloat(T& value, const Visit& visit) {
  if constexpr (std::is_floating_point_v<T>) {
    visit(value);
  } else if constexpr (HasFields<T>) {
    ForEachField<T>([&](const char*, auto member) { ForEachFloat(value.*member, visit); });
  } else if constexpr (std::is_same_v<T, Quatf>) {
    for (int i = 0; i < 4; ++i) visit(value.coeffs()[i]);
  } else if constexpr (requires { value.begin(); }) {
    const auto count = static_cast<std::size_t>(value.size());
    const bool numbers = std::is_arithmetic_v<std::decay_t<decltype(value[0])>>;
    const std::size_t step = numbers && count > 100 ? count / 2 : 1;
    for (std::size_t i = 0; i < count; i += step) ForEachFloat(value[i], visit);
    if (step > 1) ForEachFloat(value[count - 1], visit);
  }
}

template <class T>
class Gate : public testing::Test {};
using Types = test::MessageTypes;
TYPED_TEST_SUITE(Gate, Types);

TYPED_TEST(Gate, PassesAGoodMessage) { EXPECT_TRUE(PassesGate(test::Sample<TypeParam>())); }

TYPED_TEST(Gate, RefusesEveryNumberThatIsNotFinite) {
  TypeParam m = test::Sample<TypeParam>();
  int visited = 0;
  const auto corrupt = [&](auto& x) {
    using Scalar = std::remove_reference_t<decltype(x)>;
    const Scalar good = x;
    for (const Scalar bad : {std::numeric_limits<Scalar>::quiet_NaN(), std::numeric_limits<Scalar>::infinity(),
                             -std::numeric_limits<Scalar>::infinity()}) {
      x = bad;
      EXPECT_FALSE(PassesGate(m)) << "number " << visited << " = " << bad;
    }
    x = good;
    ++visited;
  };
  ForEachFloat(m, corrupt);
  EXPECT_TRUE(PassesGate(m));
}

TYPED_TEST(Gate, RefusesANegativeStamp) {
  TypeParam m = test::Sample<TypeParam>();
  if constexpr (requires { m.header; }) {
    m.header.stamp.stamp_ns = -1;
  } else {
    m.stamp.stamp_ns = -1;
  }
  EXPECT_FALSE(PassesGate(m));
}

/// One way to spoil a message that has only finite numbers.
template <class T>
struct Fault {
  const char* what;
  std::function<void(T&)> spoil;
};

template <class T>
void ExpectRefused(const std::vector<Fault<T>>& faults) {
  for (const Fault<T>& fault : faults) {
    T m = test::Sample<T>();
    fault.spoil(m);
    EXPECT_FALSE(PassesGate(m)) << fault.what;
  }
}

template <class Enum>
Enum BeyondLast() {
  return static_cast<Enum>(200);
}

TEST(GateRanges, HandleState) {
  ExpectRefused<HandleState>({{"unknown pedal", [](auto& m) { m.pedals = 8; }},
                              {"jaw beyond its stop", [](auto& m) { m.handles[1].jaw_angle_rad = 4; }},
                              {"quality above 1", [](auto& m) { m.handles[0].quality = 1.01f; }},
                              {"negative quality", [](auto& m) { m.handles[0].quality = -0.01f; }}});
}

TEST(GateRanges, ToolState) {
  ExpectRefused<ToolState>({{"unknown kind", [](auto& m) { m.tools[0].kind = BeyondLast<ToolKind>(); }},
                            {"unknown state", [](auto& m) { m.tools[1].state = BeyondLast<ServoState>(); }},
                            {"quaternion not unit", [](auto& m) { m.tools[0].q_WT.coeffs() *= 1.1f; }},
                            {"zero quaternion", [](auto& m) { m.tools[0].q_WT.coeffs().setZero(); }},
                            {"outside the room", [](auto& m) { m.tools[0].p_WT.x() = 11; }},
                            {"faster than any hand", [](auto& m) { m.tools[1].v_WT.z() = -101; }},
                            {"force beyond any device", [](auto& m) { m.tools[1].f_W.y() = 1001; }},
                            {"model from the future", [](auto& m) { m.tools[0].model_age_s = -0.1f; }}});
}

TEST(GateRanges, TissueFrame) {
  ExpectRefused<TissueFrame>(
      {{"more vertices than fit", [](auto& m) { m.header.vertex_count = kMaxTissueVertices + 1; }},
       {"payload shorter than its count", [](auto& m) { m.xyz.pop_back(); }},
       {"payload longer than its count", [](auto& m) { --m.header.vertex_count; }},
       {"a fifth tool grasps", [](auto& m) { m.header.grasping_tools = 16; }},
       {"vertex outside the room", [](auto& m) { m.xyz[60000] = -10.5f; }}});
}

TEST(GateRanges, ContactModel) {
  ExpectRefused<ContactModel>(
      {{"more contacts than fit", [](auto& m) { m.devices[0].count = 5; }},
       {"unknown kind", [](auto& m) { m.devices[1].contacts[3].kind = BeyondLast<ContactKind>(); }},
       {"normal not unit", [](auto& m) { m.devices[0].contacts[0].n *= 0.9f; }},
       {"tangent not unit", [](auto& m) { m.devices[0].contacts[1].e1.setZero(); }},
       {"negative stiffness", [](auto& m) { m.devices[0].contacts[0].k1 = -1; }},
       {"negative viscosity", [](auto& m) { m.devices[0].contacts[0].b_body = -1; }},
       {"negative cap", [](auto& m) { m.devices[1].force_cap_N = -1; }},
       {"period of a minute", [](auto& m) { m.physics_dt_s = 60; }},
       {"negative stamp of the tool", [](auto& m) { m.tool_stamp_ns = -5; }}});
}

TEST(GateRanges, CauteryContact) {
  ExpectRefused<CauteryContact>(
      {{"fifth tool", [](auto& m) { m.tool = 4; }},
       {"weights beyond 1",
        [](auto& m) {
          m.barycentric = {2, -1, 0};
        }},
       {"weights do not sum to 1",
        [](auto& m) {
          m.barycentric = {0.1f, 0.1f, 0.1f};
        }},
       {"a footprint wider than there is room for", [](auto& m) { m.footprint.width = kFootprintCells + 1; }},
       {"a footprint of another size than it says", [](auto& m) { m.footprint.gap.pop_back(); }},
       {"a footprint higher than there is room for", [](auto& m) { m.footprint.width /= 2; }},
       {"gaps without a footprint", [](auto& m) { m.footprint.width = 0; }},
       {"a footprint without gaps", [](auto& m) { m.footprint.gap.clear(); }},
       {"a footprint beyond all sheets", [](auto& m) { m.footprint.x = -200'000'000; }},
       {"touching nothing", [](auto& m) { m.triangle = kNoIndex; }},
       {"a solid that is lifted off",
        [](auto& m) {
          m.touching = false;
          m.on_solid = m.tented = true;
        }},
       {"on two surfaces", [](auto& m) { m.on_solid = true; }},
       {"on no triangle of a solid", [](auto& m) {
          m.touching = false;
          m.on_solid = true;
          m.triangle = kNoIndex;
        }}});
}

TEST(GateRanges, GeneratorSetting) {
  ExpectRefused<GeneratorSetting>({{"negative power", [](auto& m) { m.cut_W = -1; }},
                                   {"power beyond any generator", [](auto& m) { m.blend_W = 301; }}});
}

TEST(GateRanges, OperatorInput) {
  ExpectRefused<OperatorInput>({{"a place beyond the room", [](auto& m) { m.tools[1].p_WT.x() = 11; }},
                                {"more than a turn", [](auto& m) { m.tools[3].roll_rad = 7; }},
                                {"a jaw beyond its stop", [](auto& m) { m.tools[0].jaw_angle_rad = 4; }},
                                {"unknown pedal", [](auto& m) { m.pedals = 8; }},
                                {"unknown source", [](auto& m) { m.source = BeyondLast<OperatorSource>(); }},
                                {"controls taken before the clock began", [](auto& m) { m.claim_ns = -1; }},
                                {"controls taken later than now", [](auto& m) { m.claim_ns = m.stamp.stamp_ns + 1; }}});
}

TEST(GateRanges, Picture) {
  ExpectRefused<Picture>({{"no pixel", [](auto& m) { m.header.width = 0; }},
                          {"more pixels than any display", [](auto& m) { m.header.height = 16385; }},
                          {"another length than the header's", [](auto& m) { m.jpeg.push_back(0); }},
                          {"no JPEG", [](auto& m) { m.jpeg[1] = 0xd9; }},
                          {"less than two marks",
                           [](auto& m) {
                             m.jpeg.resize(3);
                             m.header.size = 3;
                           }},
                          {"a tool too many", [](auto& m) { m.header.present = 16; }},
                          {"a scope too many", [](auto& m) { m.header.scopes = 16; }},
                          {"an eye beyond the room", [](auto& m) { m.header.eye_W.z() = 11; }},
                          {"a view of no direction", [](auto& m) { m.header.forward_W.setZero(); }},
                          {"pixels of no size", [](auto& m) { m.header.pixel_rad = 0; }},
                          {"larger than drawn", [](auto& m) { m.header.scale = 4.5f; }}});
  // A fast machine draws more pixels than it shows.
  Picture smooth = test::Sample<Picture>();
  smooth.header.scale = render::QualityControl::kMostScale;
  EXPECT_TRUE(PassesGate(smooth));
}

TEST(GateRanges, TopologyState) {
  ExpectRefused<TopologyState>({{"grid beyond capacity", [](auto& m) { m.rows = 97; }},
                                {"product overflows 32 bits", [](auto& m) { m.rows = m.cols = 0x10000; }},
                                {"node bits too short", [](auto& m) { m.dead_nodes.pop_back(); }},
                                {"edge bits too long", [](auto& m) { m.dead_edges.push_back(0); }},
                                {"shrink missing", [](auto& m) { m.shrink.clear(); }},
                                {"negative length", [](auto& m) { m.cut_length_m = -1; }}});
}

TEST(GateRanges, TearState) {
  ExpectRefused<TearState>({{"grid beyond capacity", [](auto& m) { m.rows = 97; }},
                            {"product overflows 32 bits", [](auto& m) { m.rows = m.cols = 0x10000; }},
                            {"edge bits too short", [](auto& m) { m.torn_edges.pop_back(); }},
                            {"edge bits too long", [](auto& m) { m.torn_edges.push_back(0); }}});
}

TEST(GateRanges, OpenCells) {
  ExpectRefused<OpenCells>({{"beyond all sheets", [](auto& m) { m.x = 200'000'000; }},
                            {"before all sheets", [](auto& m) { m.y = -200'000'000; }}});
}

TEST(GateRanges, ClipState) {
  ExpectRefused<ClipState>({{"more than there can be", [](auto& m) { m.count = kMaxClips + 1; }},
                            {"longer than any", [](auto& m) { m.clips[0].length_m = 0.11f; }},
                            {"negative length", [](auto& m) { m.clips[1].length_m = -1e-3f; }},
                            {"no rotation", [](auto& m) { m.clips[2].q_AC.coeffs().setZero(); }},
                            {"beyond all scenes", [](auto& m) { m.clips[3].p_AC.x() = 11; }},
                            {"two anchors for three", [](auto& m) { m.clips[4].anchors[2] = m.clips[4].anchors[0]; }},
                            {"vertex beyond capacity", [](auto& m) { m.clips[5].anchors[1] = kMaxTissueVertices; }},
                            {"unknown tool", [](auto& m) { m.clips[6].tool = kMaxTools; }}});
}

TEST(GateRanges, TemperaturePatch) {
  ExpectRefused<TemperaturePatch>({{"reaches beyond the atlas", [](auto& m) { m.header.origin_x = 3841; }},
                                   {"reaches beyond the atlas", [](auto& m) { m.header.origin_y = 3841; }},
                                   {"hotter than an arc", [](auto& m) { m.header.max_temperature_C = 3001; }},
                                   {"texels missing", [](auto& m) { m.texels.pop_back(); }}});
}

TEST(GateRanges, ThermalEvent) {
  ExpectRefused<ThermalEvent>({{"unknown kind", [](auto& m) { m.kind = BeyondLast<ThermalEventKind>(); }},
                               {"colder than ice", [](auto& m) { m.temperature_C = -51; }},
                               {"off the sheet", [](auto& m) { m.material.y() = 11; }}});
}

TEST(GateRanges, SessionMessages) {
  ExpectRefused<SceneManifest>({{"unknown mode", [](auto& m) { m.mode = BeyondLast<SessionMode>(); }},
                                {"name too long", [](auto& m) { m.scene_name = std::string(64, 'x'); }},
                                {"no name", [](auto& m) { m.scene_name.clear(); }},
                                {"no session", [](auto& m) { m.session_id.clear(); }},
                                {"no text", [](auto& m) { m.session_id[0] = '\x01'; }},
                                {"session too long", [](auto& m) { m.session_id = std::string(64, 'x'); }},
                                {"negative start", [](auto& m) { m.session_start_ns = -1; }}});
  ExpectRefused<TickManifest>({{"unknown node", [](auto& m) { m.node = BeyondLast<NodeId>(); }},
                               {"unknown topic", [](auto& m) { m.consumed[1].topic = BeyondLast<TopicId>(); }},
                               {"too many inputs", [](auto& m) { m.consumed.resize(kMaxConsumedInputs + 1); }}});
}

TEST(GateRanges, Health) {
  ExpectRefused<Health>({{"unknown node", [](auto& m) { m.node = BeyondLast<NodeId>(); }},
                         {"unknown state", [](auto& m) { m.state = BeyondLast<HealthState>(); }},
                         {"negative pid", [](auto& m) { m.pid = -1; }},
                         {"negative rate", [](auto& m) { m.rate_achieved_Hz = -1; }},
                         {"negative time", [](auto& m) { m.step.p99_us = -1; }},
                         {"unknown topic", [](auto& m) { m.inputs[0].topic = BeyondLast<TopicId>(); }},
                         {"too many inputs", [](auto& m) { m.inputs.resize(17); }},
                         {"too many metrics", [](auto& m) { m.metrics.resize(kMaxMetrics + 1); }},
                         {"metric's name too long", [](auto& m) { m.metrics[0].name = std::string(32, 'x'); }}});
}

TEST(GateRanges, WhatAnIdleNodeSendsPasses) {
  EXPECT_TRUE(PassesGate(HandleState{}));
  EXPECT_TRUE(PassesGate(ToolState{}));
  EXPECT_TRUE(PassesGate(TissueFrame{}));
  EXPECT_TRUE(PassesGate(ContactModel{}));
  EXPECT_TRUE(PassesGate(CauteryContact{}));
  EXPECT_TRUE(PassesGate(TopologyState{}));
  EXPECT_TRUE(PassesGate(Health{}));
}

}  // namespace
}  // namespace fulcrum::bus
