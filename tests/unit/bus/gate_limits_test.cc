// Every limit of the gate: the last value that passes and the next one, which does not.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "services/transport/bus/gate.h"
#include "tests/unit/bus/samples.h"

namespace fulcrum::bus {
namespace {

/// The field that `get` names passes at `low` and `high` and not beyond. An unsigned field has no value below 0.
template <class T, class Get, class Low, class High>
void ExpectLimits(const char* what, const Get& get, Low low, High high) {
  T m = test::Sample<T>();
  auto& x = get(m);
  using Value = std::remove_reference_t<decltype(x)>;
  const Value first = static_cast<Value>(low), last = static_cast<Value>(high);
  x = first;
  EXPECT_TRUE(PassesGate(m)) << what << " = " << +x;
  x = last;
  EXPECT_TRUE(PassesGate(m)) << what << " = " << +x;
  if constexpr (std::is_floating_point_v<Value>) {
    x = std::nextafter(first, -std::numeric_limits<Value>::infinity());
    EXPECT_FALSE(PassesGate(m)) << what << " = " << x;
    x = std::nextafter(last, std::numeric_limits<Value>::infinity());
    EXPECT_FALSE(PassesGate(m)) << what << " = " << x;
  } else {
    if (std::is_signed_v<Value> || first > 0) {
      x = static_cast<Value>(first - 1);
      EXPECT_FALSE(PassesGate(m)) << what << " = " << +x;
    }
    if (last < std::numeric_limits<Value>::max()) {
      x = static_cast<Value>(last + 1);
      EXPECT_FALSE(PassesGate(m)) << what << " = " << +x;
    }
  }
}

#define EXPECT_LIMITS(T, field, low, high) \
  ExpectLimits<T>(                         \
      #T "." #field, [](T & m) -> auto& { return m.field; }, low, high)

/// Each component of a vector.
#define EXPECT_VECTOR_LIMITS(T, field, size, high)                                       \
  for (int axis = 0; axis < (size); ++axis) {                                            \
    ExpectLimits<T>(                                                                     \
        #T "." #field, [axis](T & m) -> auto& { return m.field[axis]; }, -(high), high); \
  }

/// A unit vector or quaternion may be 1 % off in the square of its length, or in its length.
template <class T, class Get>
void ExpectUnit(const char* what, const Get& get, bool of_the_square) {
  const auto passes = [&](double length) {
    T m = test::Sample<T>();
    get(m) *= static_cast<float>(of_the_square ? std::sqrt(length) : length);
    return PassesGate(m);
  };
  EXPECT_TRUE(passes(0.9905)) << what;
  EXPECT_TRUE(passes(1.0095)) << what;
  EXPECT_FALSE(passes(0.9895)) << what;
  EXPECT_FALSE(passes(1.0105)) << what;
}

constexpr std::int64_t kEver = std::numeric_limits<std::int64_t>::max();

TEST(GateLimits, OfHandlesGeneratorAndOperator) {
  EXPECT_LIMITS(HandleState, stamp.stamp_ns, 0, kEver);
  EXPECT_LIMITS(HandleState, pedals, 0, 7);
  EXPECT_LIMITS(HandleState, handles[1].jaw_angle_rad, -3.2f, 3.2f);
  EXPECT_LIMITS(HandleState, handles[1].jaw_rate_rad_s, -1000.0f, 1000.0f);
  EXPECT_LIMITS(HandleState, handles[1].quality, 0.0f, 1.0f);
  EXPECT_LIMITS(GeneratorSetting, cut_W, 0.0f, 300.0f);
  EXPECT_LIMITS(GeneratorSetting, coag_W, 0.0f, 300.0f);
  EXPECT_LIMITS(GeneratorSetting, blend_W, 0.0f, 300.0f);
  EXPECT_LIMITS(OperatorInput, claim_ns, 0, 4600);  // The stamp of the sample.
  EXPECT_LIMITS(OperatorInput, pedals, 0, 7);
  EXPECT_VECTOR_LIMITS(OperatorInput, tools[2].p_WT, 3, 10.0f);
  EXPECT_LIMITS(OperatorInput, tools[2].jaw_angle_rad, -3.2f, 3.2f);
  EXPECT_LIMITS(OperatorInput, tools[2].roll_rad, -6.3f, 6.3f);
}

TEST(GateLimits, OfTools) {
  EXPECT_VECTOR_LIMITS(ToolState, tools[1].p_WT, 3, 10.0f);
  EXPECT_VECTOR_LIMITS(ToolState, tools[1].v_WT, 3, 100.0f);
  EXPECT_VECTOR_LIMITS(ToolState, tools[1].w_WT, 3, 1000.0f);
  EXPECT_VECTOR_LIMITS(ToolState, tools[1].f_W, 3, 1000.0f);
  EXPECT_LIMITS(ToolState, tools[1].model_age_s, 0.0f, 1e9f);
  ExpectUnit<ToolState>(
      "q_WT", [](ToolState & m) -> auto& { return m.tools[1].q_WT.coeffs(); }, true);
}

TEST(GateLimits, OfTissue) {
  EXPECT_LIMITS(TissueFrame, header.session_time_s, -1e9, 1e9);
  EXPECT_LIMITS(TissueFrame, header.simulated_time_s, -1e9, 1e9);
  EXPECT_LIMITS(TissueFrame, header.next_within_s, 0, 10);
  EXPECT_LIMITS(TissueFrame, header.grasping_tools, 0, 15);
  EXPECT_LIMITS(TissueFrame, xyz[7], -10.0f, 10.0f);
  TissueFrame largest;
  largest.header.vertex_count = 250'000;
  largest.xyz.resize(3 * std::size_t{250'000});
  EXPECT_TRUE(PassesGate(largest));
}

TEST(GateLimits, OfContacts) {
  EXPECT_LIMITS(ContactModel, tool_stamp_ns, 0, kEver);
  EXPECT_LIMITS(ContactModel, physics_dt_s, 0.0f, 10.0f);
  EXPECT_LIMITS(ContactModel, devices[1].count, 0, 4);
  EXPECT_LIMITS(ContactModel, devices[1].p_ext_W, -1000.0f, 1000.0f);
  EXPECT_LIMITS(ContactModel, devices[1].force_cap_N, 0.0f, 1000.0f);
  EXPECT_VECTOR_LIMITS(ContactModel, devices[0].contacts[1].x_ref, 3, 10.0f);
  EXPECT_VECTOR_LIMITS(ContactModel, devices[0].contacts[1].f_ref, 3, 1000.0f);
  EXPECT_VECTOR_LIMITS(ContactModel, devices[0].contacts[1].p_s, 3, 10.0f);
  EXPECT_VECTOR_LIMITS(ContactModel, devices[0].contacts[1].v_s, 3, 100.0f);
  EXPECT_VECTOR_LIMITS(ContactModel, devices[0].contacts[1].u_c, 3, 10.0f);
  EXPECT_VECTOR_LIMITS(ContactModel, devices[0].contacts[1].du_c, 3, 100.0f);
  EXPECT_LIMITS(ContactModel, devices[0].contacts[1].gap, -10.0f, 10.0f);
  EXPECT_LIMITS(ContactModel, devices[0].contacts[1].k1, 0.0f, 1e12f);
  EXPECT_LIMITS(ContactModel, devices[0].contacts[1].k3, 0.0f, 1e12f);
  EXPECT_LIMITS(ContactModel, devices[0].contacts[1].kt, 0.0f, 1e12f);
  EXPECT_LIMITS(ContactModel, devices[0].contacts[1].k_body, 0.0f, 1e12f);
  EXPECT_LIMITS(ContactModel, devices[0].contacts[1].b_body, 0.0f, 1e12f);
  EXPECT_LIMITS(ContactModel, devices[0].contacts[1].friction, 0.0f, 10.0f);
  EXPECT_LIMITS(ContactModel, devices[0].contacts[1].kappa1, -1e12f, 1e12f);
  EXPECT_LIMITS(ContactModel, devices[0].contacts[1].kappa2, -1e12f, 1e12f);
  EXPECT_LIMITS(ContactModel, devices[0].contacts[1].slip_force, 0.0f, 1000.0f);
  EXPECT_LIMITS(ContactModel, devices[0].contacts[1].radius, 0.0f, 10.0f);
  ExpectUnit<ContactModel>(
      "n", [](ContactModel & m) -> auto& { return m.devices[0].contacts[1].n; }, true);
  ExpectUnit<ContactModel>(
      "e1", [](ContactModel & m) -> auto& { return m.devices[0].contacts[1].e1; }, true);
}

TEST(GateLimits, OfTheHooksContact) {
  EXPECT_LIMITS(CauteryContact, session_time_s, -1e9, 1e9);
  EXPECT_LIMITS(CauteryContact, tool, 0, 3);
  EXPECT_VECTOR_LIMITS(CauteryContact, material, 2, 10.0f);
  EXPECT_VECTOR_LIMITS(CauteryContact, material_rate, 2, 100.0f);
  EXPECT_LIMITS(CauteryContact, contact_radius_m, 0.0f, 10.0f);
  // Weights and their sum may be 0.01 off.
  const auto passes = [](float a, float b, float c) {
    CauteryContact m = test::Sample<CauteryContact>();
    m.barycentric = {a, b, c};
    return PassesGate(m);
  };
  EXPECT_TRUE(passes(1.009f, 0, 0));
  EXPECT_TRUE(passes(0.5f, 0.509f, -0.009f));
  EXPECT_TRUE(passes(0.991f, 0, 0));
  EXPECT_FALSE(passes(1.011f, 0, 0));
  EXPECT_FALSE(passes(0.989f, 0, 0));
  EXPECT_FALSE(passes(1.005f, -0.011f, 0));
  EXPECT_FALSE(passes(1.011f, -0.005f, 0)) << "a weight above 1";
  EXPECT_FALSE(passes(-0.011f, 0.5f, 0.511f));
}

TEST(GateLimits, OfTopologyTearsCellsAndClips) {
  EXPECT_LIMITS(TopologyState, cut_length_m, 0.0f, 1000.0f);
  EXPECT_LIMITS(TopologyState, cut_width_m, 0.0f, 1.0f);
  EXPECT_LIMITS(TopologyState, cut_off_way_m, 0.0f, 1.0f);
  EXPECT_LIMITS(OpenCells, x, -100'000'000, 100'000'000);
  EXPECT_LIMITS(OpenCells, y, -100'000'000, 100'000'000);
  EXPECT_VECTOR_LIMITS(ClipState, clips[15].p_AC, 3, 10.0f);
  EXPECT_LIMITS(ClipState, clips[15].length_m, 0.0f, 0.1f);
  EXPECT_LIMITS(ClipState, clips[15].tool, 0, 3);
  EXPECT_LIMITS(ClipState, clips[15].anchors[1], 106, 249'999);  // 105 is the first anchor of the sample.
  ExpectUnit<ClipState>(
      "q_AC", [](ClipState & m) -> auto& { return m.clips[15].q_AC.coeffs(); }, true);
  for (const auto& [i, j] : {std::pair{0, 1}, {1, 2}, {2, 0}}) {
    ClipState m = test::Sample<ClipState>();
    m.clips[3].anchors[static_cast<std::size_t>(i)] = m.clips[3].anchors[static_cast<std::size_t>(j)];
    EXPECT_FALSE(PassesGate(m)) << i << " and " << j << " are one vertex";
  }
  // What is beyond the count is not read.
  ClipState few = test::Sample<ClipState>();
  few.count = 2;
  few.clips[2].length_m = -1;
  EXPECT_TRUE(PassesGate(few));
}

TEST(GateLimits, OfSizesThatAreNoMultipleOfEight) {
  // 15 nodes take 2 bytes, 45 edges 6.
  TopologyState topology;
  topology.rows = 3;
  topology.cols = 5;
  topology.dead_nodes.resize(2);
  topology.dead_edges.resize(6);
  topology.shrink.resize(45);
  EXPECT_TRUE(PassesGate(topology));
  topology.dead_nodes.resize(1);
  EXPECT_FALSE(PassesGate(topology));
  topology.dead_nodes.resize(2);
  topology.dead_edges.resize(5);
  EXPECT_FALSE(PassesGate(topology));
  TearState tears;
  tears.rows = 3;
  tears.cols = 5;
  tears.torn_edges.resize(6);
  EXPECT_TRUE(PassesGate(tears));
  tears.torn_edges.resize(5);
  EXPECT_FALSE(PassesGate(tears));
  // 250,001 nodes in one row, with all that belongs to them.
  topology.rows = tears.rows = 1;
  topology.cols = tears.cols = 250'001;
  topology.dead_nodes.resize(31'251);
  topology.dead_edges.resize(93'751);
  topology.shrink.resize(750'003);
  tears.torn_edges.resize(93'751);
  EXPECT_FALSE(PassesGate(topology));
  EXPECT_FALSE(PassesGate(tears));
}

TEST(GateLimits, OfPatchesAndEvents) {
  EXPECT_LIMITS(TemperaturePatch, header.origin_x, 0, 3840);
  EXPECT_LIMITS(TemperaturePatch, header.origin_y, 0, 3840);
  EXPECT_LIMITS(TemperaturePatch, header.max_temperature_C, -50.0f, 3000.0f);
  TemperaturePatch unknown = test::Sample<TemperaturePatch>();
  unknown.header.surface = static_cast<BurntSurface>(2);
  EXPECT_FALSE(PassesGate(unknown));
  EXPECT_LIMITS(ThermalEvent, session_time_s, -1e9, 1e9);
  EXPECT_VECTOR_LIMITS(ThermalEvent, material, 2, 10.0f);
  EXPECT_LIMITS(ThermalEvent, temperature_C, -50.0f, 3000.0f);
}

TEST(GateLimits, OfPictures) {
  EXPECT_LIMITS(Picture, header.session_time_s, -1e9, 1e9);
  EXPECT_LIMITS(Picture, header.width, 1, 16384);
  EXPECT_LIMITS(Picture, header.height, 1, 16384);
  EXPECT_LIMITS(Picture, header.present, 0, 15);
  EXPECT_LIMITS(Picture, header.scopes, 0, 15);
  EXPECT_LIMITS(Picture, jpeg[0], 0xff, 0xff);
  EXPECT_LIMITS(Picture, jpeg[1], 0xd8, 0xd8);
  EXPECT_LIMITS(Picture, header.pixel_rad, 1e-6f, 1.0f);
  EXPECT_LIMITS(Picture, header.scale, 1e-3f, 4.0f);
  EXPECT_VECTOR_LIMITS(Picture, header.eye_W, 3, 10.0f);
  EXPECT_VECTOR_LIMITS(Picture, header.tip_W[3], 3, 10.0f);
  ExpectUnit<Picture>(
      "right_W", [](Picture & m) -> auto& { return m.header.right_W; }, false);
  ExpectUnit<Picture>(
      "up_W", [](Picture & m) -> auto& { return m.header.up_W; }, false);
  ExpectUnit<Picture>(
      "forward_W", [](Picture & m) -> auto& { return m.header.forward_W; }, false);
  const auto passes = [](std::size_t bytes) {
    Picture m = test::Sample<Picture>();
    m.jpeg.resize(bytes);
    m.header.size = static_cast<std::uint32_t>(bytes);
    return PassesGate(m);
  };
  EXPECT_TRUE(passes(4));
  EXPECT_TRUE(passes(512 * 1024));
  EXPECT_FALSE(passes(512 * 1024 + 1));
}

TEST(GateLimits, OfSessionMessages) {
  EXPECT_LIMITS(SceneManifest, session_start_ns, 0, kEver);
  EXPECT_LIMITS(TickManifest, session_time_s, -1e9, 1e9);
  EXPECT_LIMITS(TickManifest, tick_times_ns[1], 0, kEver);
  const auto named = [](const std::string& name) {
    SceneManifest m = test::Sample<SceneManifest>();
    m.scene_name = name;
    return PassesGate(m);
  };
  EXPECT_TRUE(named(std::string(63, 'x')));
  EXPECT_TRUE(named("a b~\xc3\xa9")) << "from a space on, in UTF-8";
  EXPECT_FALSE(named("a\x1f")) << "a control character";
  EXPECT_FALSE(named("a\x7f")) << "a control character";
  TickManifest full = test::Sample<TickManifest>();
  full.consumed.resize(33);
  full.tick_times_ns.resize(10);
  EXPECT_TRUE(PassesGate(full));
  full.tick_times_ns.resize(11);
  EXPECT_FALSE(PassesGate(full)) << "11 ticks";
  full.tick_times_ns.resize(10);
  full.consumed.resize(34);
  EXPECT_FALSE(PassesGate(full)) << "34 inputs";
  const auto passes = [](int node, int topic) {
    TickManifest m = test::Sample<TickManifest>();
    m.node = static_cast<NodeId>(node);
    m.consumed[0].topic = static_cast<TopicId>(topic);
    return PassesGate(m);
  };
  EXPECT_TRUE(passes(kNodeCount - 1, kTopicCount - 1));
  EXPECT_FALSE(passes(kNodeCount, 0));
  EXPECT_FALSE(passes(0, kTopicCount));
}

TEST(GateLimits, OfHealth) {
  EXPECT_LIMITS(Health, pid, 0, std::numeric_limits<std::int32_t>::max());
  EXPECT_LIMITS(Health, rate_asked_Hz, 0.0f, 1e6f);
  EXPECT_LIMITS(Health, rate_achieved_Hz, 0.0f, 1e6f);
  EXPECT_LIMITS(Health, step.p50_us, 0.0f, 999'999'995'904.0f);  // The last float up to 1e12.
  EXPECT_LIMITS(Health, step.p99_us, 0.0f, 999'999'995'904.0f);
  EXPECT_LIMITS(Health, wake.max_us, 0.0f, 999'999'995'904.0f);
  Health full = test::Sample<Health>();
  full.inputs.resize(16);
  full.metrics.resize(28);
  full.metrics[27].name = std::string(31, 'x');
  EXPECT_TRUE(PassesGate(full));
  full.metrics[27].name = std::string(32, 'x');
  EXPECT_FALSE(PassesGate(full)) << "a long name";
  full.metrics.resize(29);
  full.metrics[27].name.clear();
  EXPECT_FALSE(PassesGate(full)) << "29 metrics";
  full.metrics.resize(28);
  full.inputs.resize(17);
  EXPECT_FALSE(PassesGate(full)) << "17 inputs";
}

}  // namespace
}  // namespace fulcrum::bus
