// Two carts' buses in one process, joined by two links over 127.0.0.1: which samples cross, which do not, and under
// which writer.
#include <gtest/gtest.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <thread>

#include "services/base/core/error.h"
#include "services/base/runtime/cyclic_thread.h"
#include "services/transport/bus/dds/participant.h"
#include "services/transport/bus/dds/shared_memory.h"
#include "services/transport/bus/input_account.h"
#include "services/transport/bus/topics.h"
#include "services/transport/link/link.h"
#include "services/transport/link/scene_transfer.h"
#include "tests/integration/bus/support.h"
#include "tests/unit/bus/samples.h"
#include "tests/unit/link/wire.h"

namespace fulcrum::link {
namespace {

namespace fs = std::filesystem;
using bus::test::Eventually;
using bus::test::Sample;
using runtime::MonotonicNs;

constexpr int kCart = 43, kHost = 44, kBetween = 143;
constexpr std::uint32_t BitOf(NodeId node) { return 1u << static_cast<unsigned>(node); }

const auto* const kCleanCart = testing::AddGlobalTestEnvironment(new bus::test::CleanDomain(kCart));
const auto* const kCleanHost = testing::AddGlobalTestEnvironment(new bus::test::CleanDomain(kHost));

bus::FarSettings Far(bus::FarSide side) {
  return {.domain = kBetween, .address = "127.0.0.1", .peer = "127.0.0.1", .side = side};
}

Offer SomeOffer(std::uint32_t nodes) {
  Offer offer;
  offer.session_id = "session-1";
  offer.scene_name = "none";
  offer.scene_hash = 5;
  offer.scene_B = 100;
  offer.nodes = nodes;
  return offer;
}

/// A cart and a host; the nodes in `far_nodes` run on the host.
struct TwoHosts {
  explicit TwoHosts(std::uint32_t far_nodes)
      : cart_link(LinkSettings{.far = Far(bus::FarSide::kCart), .offer = SomeOffer(far_nodes), .scene = {}}),
        host_link(std::make_unique<Link>(LinkSettings{.far = Far(bus::FarSide::kHost), .offer = {}, .scene = {}})) {
    cart_link.Join(&cart, far_nodes);
    EXPECT_TRUE(Eventually([&] { return host_link->session().number != 0; }));
    EXPECT_EQ(host_link->session().offer.nodes, far_nodes);
    host_link->Join(&host, ~far_nodes);
  }
  ~TwoHosts() {
    cart_link.Leave();
    host_link->Leave();
  }

  bus::DdsParticipant cart{{.domain = kCart, .node_name = "cart", .shared_memory = {}}};
  bus::DdsParticipant host{{.domain = kHost, .node_name = "host", .shared_memory = {}}};
  Link cart_link;
  std::unique_ptr<Link> host_link;
};

template <class T>
void Restamp(T* message, std::uint64_t sequence, std::int64_t epoch) {
  const_cast<Stamp&>(bus::StampOf(*message)) = {sequence, static_cast<std::uint64_t>(epoch), MonotonicNs()};
}

/// Sends `message` on `out` until `in` receives a message that satisfies `is_it`.
template <class T, class IsIt>
bool Crosses(typename bus::OutputOf<T>::type* out, bus::Input<T>* in, T message, T* got, const IsIt& is_it) {
  const std::int64_t epoch = MonotonicNs();
  std::uint64_t sequence = 0;
  std::int64_t next = 0;
  return Eventually([&] {
    if (MonotonicNs() > next) {
      next = MonotonicNs() + 20'000'000;
      Restamp(&message, ++sequence, epoch);
      out->Write(message);
    }
    return in->TakeLatest(got) && is_it(*got);
  });
}
template <class T>
bool Crosses(typename bus::OutputOf<T>::type* out, bus::Input<T>* in, T message, T* got) {
  return Crosses(out, in, std::move(message), got, [](const T&) { return true; });
}

TEST(Link, CarriesWhatNodesOfTheOtherHostReadAndNothingElse) {
  TwoHosts hosts(BitOf(NodeId::kRender));
  const auto tools_out = hosts.cart.MakeOutput<ToolState>();
  const auto tissue_out = hosts.cart.MakeOutput<TissueFrame>();
  const auto topology_out = hosts.cart.MakeOutput<TopologyState>();
  const auto contact_out = hosts.cart.MakeOutput<ContactModel>();
  const auto manifest_out = hosts.cart.MakeOutput<SceneManifest>();
  const auto tools_in = hosts.host.MakeInput<ToolState>();
  const auto tissue_in = hosts.host.MakeInput<TissueFrame>();
  const auto topology_in = hosts.host.MakeInput<TopologyState>();
  const auto manifest_in = hosts.host.MakeInput<SceneManifest>();

  ToolState tool;
  ASSERT_TRUE(Crosses(tools_out.get(), tools_in.get(), Sample<ToolState>(), &tool));
  EXPECT_EQ(tool.tools[0].p_WT, Sample<ToolState>().tools[0].p_WT);
  // Both sides use the same clock here: the difference is the error of the measurement, which decreases with the number
  // of round trips.
  EXPECT_LT(std::abs(MonotonicNs() - tool.stamp.stamp_ns), 20'000'000'000);
  EXPECT_TRUE(Eventually([&] { return std::abs(hosts.host_link->status().offset_us) < 2000; }))
      << hosts.host_link->status().offset_us;

  TissueFrame frame;
  const TissueFrame sheet = test::Sheet(60, 80, 0.003, 1);
  ASSERT_TRUE(Crosses(tissue_out.get(), tissue_in.get(), sheet, &frame));
  EXPECT_LE(test::ErrorOf(frame, sheet), kTissueError_m);

  // Reliable, and sent as a difference from the second message on.
  TopologyState state = Sample<TopologyState>(), got;
  ASSERT_TRUE(Crosses(topology_out.get(), topology_in.get(), state, &got));
  state.revision = got.revision + 1;
  SetBit(state.dead_edges, 17);
  // A copy of the first message may still be in transit.
  ASSERT_TRUE(Crosses(topology_out.get(), topology_in.get(), state, &got,
                      [&](const TopologyState& it) { return it.revision == state.revision; }));
  EXPECT_EQ(got.dead_edges, state.dead_edges);
  EXPECT_EQ(got.shrink, state.shrink);

  SceneManifest manifest = Sample<SceneManifest>(), received;
  manifest.session_start_ns = MonotonicNs();
  ASSERT_TRUE(Crosses(manifest_out.get(), manifest_in.get(), manifest, &received));
  EXPECT_LT(std::abs(received.session_start_ns - manifest.session_start_ns), 5'000'000);
  EXPECT_EQ(received.session_id, manifest.session_id);

  // Without a reader of contact models on the host there is none here either.
  EXPECT_FALSE(contact_out->has_readers());
  EXPECT_TRUE(tools_out->has_readers());
}

TEST(Link, ALateJoinerAndARestartedLinkAreGivenTheNewest) {
  auto hosts = std::make_unique<TwoHosts>(BitOf(NodeId::kRender));
  const auto topology_out = hosts->cart.MakeOutput<TopologyState>();
  TopologyState state = Sample<TopologyState>();
  Restamp(&state, 1, MonotonicNs());
  topology_out->Write(state);
  {
    const auto late = hosts->host.MakeInput<TopologyState>();
    TopologyState got;
    ASSERT_TRUE(Eventually([&] { return late->TakeLatest(&got); }));
    EXPECT_EQ(got.revision, state.revision);
  }
  // The far host's bus keeps running while its link restarts: its readers must see a newer epoch of the same process.
  const auto reader = hosts->host.MakeInput<TopologyState>();
  TopologyState got;
  ASSERT_TRUE(Eventually([&] { return reader->TakeLatest(&got); }));
  const std::uint64_t before = got.stamp.epoch;
  hosts->host_link.reset();
  hosts->host_link = std::make_unique<Link>(LinkSettings{.far = Far(bus::FarSide::kHost), .offer = {}, .scene = {}});
  Link& again = *hosts->host_link;
  ASSERT_TRUE(Eventually([&] { return again.session().number != 0; }));
  again.Join(&hosts->host, ~BitOf(NodeId::kRender));
  ASSERT_TRUE(Eventually([&] { return reader->TakeLatest(&got) && got.stamp.epoch > before; }));
  EXPECT_EQ(got.revision, state.revision);
}

TEST(Link, AReaderThatWasAwayForLongerThanATopicIsCarriedIsServedAtOnce) {
  TwoHosts hosts(BitOf(NodeId::kRender));
  const auto tools_out = hosts.cart.MakeOutput<ToolState>();
  const auto patches_out = hosts.cart.MakeOutput<TemperaturePatch>();
  auto tools_in = hosts.host.MakeInput<ToolState>();
  auto patches_in = hosts.host.MakeInput<TemperaturePatch>();
  ToolState tool = Sample<ToolState>(), got_tool;
  TemperaturePatch patch = Sample<TemperaturePatch>(), got_patch;
  const std::int64_t epoch = MonotonicNs();
  std::uint64_t sequence = 0;
  std::int64_t since = 0;  // Samples from before are not counted: the bus keeps some for a late joiner.
  int tools = 0, patches = 0;
  const auto write_and_count = [&] {
    Restamp(&tool, ++sequence, epoch);
    Restamp(&patch, sequence, epoch);
    tools_out->Write(tool);
    patches_out->Write(patch);
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
    while (tools_in->TakeNext(&got_tool)) tools += got_tool.stamp.stamp_ns > since ? 1 : 0;
    while (patches_in->TakeNext(&got_patch)) patches += got_patch.header.stamp.stamp_ns > since ? 1 : 0;
    return tools > 100 && patches > 100;
  };
  ASSERT_TRUE(Eventually(write_and_count)) << tools << " " << patches;

  // The far node is restarted slowly: the cart stops to carry its topics.
  tools_in.reset();
  patches_in.reset();
  ASSERT_TRUE(Eventually([&] { return !tools_out->has_readers() && !patches_out->has_readers(); }));
  tools_in = hosts.host.MakeInput<ToolState>();
  patches_in = hosts.host.MakeInput<TemperaturePatch>();
  ASSERT_TRUE(Eventually([&] { return tools_out->has_readers() && patches_out->has_readers(); }));
  tools = patches = 0;
  since = MonotonicNs() - 1'000'000'000;
  // Fewer samples than before: numbers that began anew would all be older ones.
  for (int i = 0; i < 50; ++i) (void)write_and_count();
  EXPECT_GT(tools, 0);
  EXPECT_GT(patches, 0);
}

TEST(Link, NothingLoops) {
  TwoHosts hosts(BitOf(NodeId::kRender));
  const auto cart_health_out = hosts.cart.MakeOutput<Health>();
  const auto cart_health_in = hosts.cart.MakeInput<Health>();
  const auto host_health_out = hosts.host.MakeOutput<Health>();
  const auto host_health_in = hosts.host.MakeInput<Health>();

  Health physics = Sample<Health>(), render = Sample<Health>(), got;
  physics.node = NodeId::kPhysics;
  render.node = NodeId::kRender;
  const std::int64_t epoch = MonotonicNs();
  int physics_there = 0, render_here = 0, sent = 0, physics_here = 0, render_there = 0;
  ASSERT_TRUE(Eventually([&] {
    ++sent;
    Restamp(&physics, static_cast<std::uint64_t>(sent), epoch);
    Restamp(&render, static_cast<std::uint64_t>(sent), epoch + 1);
    cart_health_out->Write(physics);
    host_health_out->Write(render);
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
    while (cart_health_in->TakeNext(&got)) ++(got.node == NodeId::kRender ? render_here : physics_here);
    while (host_health_in->TakeNext(&got)) ++(got.node == NodeId::kPhysics ? physics_there : render_there);
    return physics_there > 20 && render_here > 20;
  }));
  EXPECT_LE(physics_here, sent);
  EXPECT_LE(render_there, sent);
  EXPECT_LE(physics_there, sent);
  EXPECT_EQ(hosts.cart_link.status().refused + hosts.host_link->status().refused, 0u);
}

TEST(Link, AManifestOfATickNamesSamplesAsTheyAreOnEachHost) {
  TwoHosts hosts(BitOf(NodeId::kPhysics));
  const auto tools_out = hosts.cart.MakeOutput<ToolState>();
  const auto tools_in = hosts.host.MakeInput<ToolState>();
  ToolState tool;
  const ToolState sent = Sample<ToolState>();
  ASSERT_TRUE(Crosses(tools_out.get(), tools_in.get(), sent, &tool));
  const auto ticks_out = hosts.host.MakeOutput<TickManifest>();
  const auto ticks_in = hosts.cart.MakeInput<TickManifest>();
  TickManifest tick = Sample<TickManifest>(), got;
  tick.node = NodeId::kPhysics;
  tick.consumed = {{TopicId::kToolState, tool.stamp.epoch, tool.stamp.sequence}};
  ASSERT_TRUE(Crosses(ticks_out.get(), ticks_in.get(), tick, &got));
  ASSERT_EQ(got.consumed.size(), 1u);
  EXPECT_EQ(got.consumed[0].sequence, tool.stamp.sequence);
  // The tools' own epoch, not the one that the link assigned on the host.
  EXPECT_NE(got.consumed[0].epoch, tool.stamp.epoch);
  EXPECT_LT(got.consumed[0].epoch, tool.stamp.epoch);
}

TEST(Link, TheEndOfTheSessionIsHeard) {
  TwoHosts hosts(BitOf(NodeId::kRender));
  EXPECT_FALSE(hosts.host_link->session().over);
  hosts.cart_link.SendBye();
  EXPECT_TRUE(Eventually([&] { return hosts.host_link->session().over; }));
}

TEST(Link, AHostThatIsStartedWhileTheSessionEndsIsNotOfferedItAgain) {
  TwoHosts hosts(BitOf(NodeId::kRender));
  hosts.cart_link.SendBye();
  ASSERT_TRUE(Eventually([&] { return hosts.host_link->session().over; }));
  hosts.host_link.reset();
  hosts.host_link = std::make_unique<Link>(LinkSettings{.far = Far(bus::FarSide::kHost), .offer = {}, .scene = {}});
  ASSERT_TRUE(Eventually([&] { return hosts.host_link->status().known; }));
  std::this_thread::sleep_for(std::chrono::milliseconds(500));  // The time of ten pulses.
  EXPECT_EQ(hosts.host_link->session().number, 0u);
}

TEST(SceneTransfer, ComesWholeWhateverGetsLostAndDamageShows) {
  const fs::path file = fs::temp_directory_path() / ("link-scene-" + std::to_string(::getpid()));
  std::vector<char> bytes(5 * kSceneChunk_B + 123);
  for (std::size_t i = 0; i < bytes.size(); ++i) bytes[i] = static_cast<char>(i * i >> 5);
  std::ofstream(file, std::ios::binary).write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  const FileFacts facts = FactsOf(file);
  fs::remove(file);
  Offer offer = SomeOffer(1);
  offer.scene_B = facts.size_B;
  offer.scene_checksum = facts.checksum;
  for (const bool damaged : {false, true}) {
    SceneFetch fetch(offer);
    std::int64_t now = 1;
    int asked = 0;
    while (!fetch.complete()) {
      for (const SceneAsk& ask : fetch.TakeAsks(now)) {
        if (++asked % 3 == 0) continue;  // Lost.
        const std::size_t size = std::min(kSceneChunk_B, bytes.size() - ask.offset);
        std::vector<std::uint8_t> piece(bytes.begin() + static_cast<std::ptrdiff_t>(ask.offset),
                                        bytes.begin() + static_cast<std::ptrdiff_t>(ask.offset + size));
        EXPECT_FALSE(fetch.Take({ask.scene_hash + 1, ask.offset}, piece));
        EXPECT_FALSE(fetch.Take(ask, std::span(piece).first(size - 1)));
        if (damaged) piece[size / 2] ^= 1;
        EXPECT_TRUE(fetch.Take(ask, piece));
      }
      now += 2'000'000'000;
    }
    EXPECT_EQ(fetch.checksum_ok(), !damaged);
    if (damaged) {
      EXPECT_ANY_THROW(StoreScene(fetch, fs::temp_directory_path()));
    }
  }
}

TEST(SceneTransfer, TheCacheKeepsTheNewestScenesAndNothingElseIsRemoved) {
  const fs::path cache = fs::temp_directory_path() / ("link-cache-" + std::to_string(::getpid()));
  fs::create_directories(cache);
  const auto now = fs::file_time_type::clock::now();
  const auto make = [&](const fs::path& file, int age_s) {
    std::ofstream(file) << "x";
    fs::last_write_time(file, now - std::chrono::seconds(age_s));
  };
  for (int i = 0; i < 12; ++i) make(CachedScene(cache, static_cast<std::uint64_t>(i + 1)), 100 + i);
  const fs::path compiled = cache / "built-in-0123456789abcdef.fulcrum";
  make(compiled, 1000);
  MakeRoomForScene(cache);
  for (int i = 0; i < 12; ++i) {
    EXPECT_EQ(fs::exists(CachedScene(cache, static_cast<std::uint64_t>(i + 1))),
              i + 1 < static_cast<int>(kMostCachedScenes))
        << i;
  }
  EXPECT_TRUE(fs::exists(compiled));
  fs::remove_all(cache);
}

TEST(SceneTransfer, TimesFromAClockThatWasAheadCountAsTheOldest) {
  const fs::path cache = fs::temp_directory_path() / ("link-cache-ahead-" + std::to_string(::getpid()));
  fs::create_directories(cache);
  const fs::path present = CachedScene(cache, 999);
  std::ofstream(present) << "x";
  for (std::uint64_t i = 0; i < kMostCachedScenes; ++i) {
    std::ofstream(CachedScene(cache, i + 1)) << "x";
    fs::last_write_time(CachedScene(cache, i + 1), fs::file_time_type::clock::now() + std::chrono::hours(24));
  }
  MakeRoomForScene(cache);
  EXPECT_TRUE(fs::exists(present));
  fs::remove_all(cache);
}

TEST(SceneTransfer, AReceivedSceneHasTheOfferedNameAndThatIsNoPath) {
  Offer offer = SomeOffer(1);
  SceneView scene;
  const auto accepted = [&](const std::string& name, const std::string& offered) {
    std::snprintf(scene.name, sizeof scene.name, "%s", name.c_str());
    offer.scene_name = offered;
    try {
      CheckReceivedScene(scene, offer);
      return true;
    } catch (const InputError&) {
      return false;
    }
  };
  EXPECT_TRUE(accepted("working scene", "working scene"));
  EXPECT_FALSE(accepted("../../x", "working"));
  EXPECT_FALSE(accepted("../../x", "../../x"));
  EXPECT_FALSE(accepted("other", "working"));
}

}  // namespace
}  // namespace fulcrum::link
