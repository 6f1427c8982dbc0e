// What a link refuses: the test acts as the other side and sends raw bytes, including those that no link sends.
#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <memory>
#include <mutex>
#include <thread>

#include "services/base/core/error.h"
#include "services/base/runtime/cyclic_thread.h"
#include "services/transport/bus/convert/cdr.h"
#include "services/transport/bus/dds/participant.h"
#include "services/transport/bus/schema.h"
#include "services/transport/bus/topics.h"
#include "services/transport/keys/key_folder.h"
#include "services/transport/link/link.h"
#include "services/transport/link/options.h"
#include "tests/integration/bus/support.h"
#include "tests/support/program.h"
#include "tests/unit/bus/samples.h"

namespace fulcrum::link {
namespace {

namespace fs = std::filesystem;
using bus::FarLane;
using bus::FarSide;
using bus::test::Eventually;
using bus::test::Sample;
using runtime::MonotonicNs;

constexpr int kDomain = 45, kBetween = 145;
constexpr std::uint32_t BitOf(NodeId node) { return 1u << static_cast<unsigned>(node); }
constexpr std::uint32_t kRemote = BitOf(NodeId::kRender) | BitOf(NodeId::kThermal);

const auto* const kClean = ::testing::AddGlobalTestEnvironment(new bus::test::CleanDomain(kDomain));

bus::FarSettings Far(FarSide side, const fs::path& keys = {}) {
  return {.domain = kBetween, .address = "127.0.0.1", .peer = "127.0.0.1", .side = side, .keys = keys};
}

Offer SomeOffer() {
  Offer offer;
  offer.session_id = "session-1";
  offer.scene_name = "none";
  offer.scene_hash = 5;
  offer.scene_B = 1 << 20;
  offer.nodes = kRemote;
  return offer;
}

LinkSettings CartSettings(const fs::path& keys = {}, const fs::path& scene = {}) {
  return {.far = Far(FarSide::kCart, keys), .offer = SomeOffer(), .scene = scene};
}
LinkSettings HostSettings(const fs::path& keys = {}) {
  return {.far = Far(FarSide::kHost, keys), .offer = {}, .scene = {}};
}

bool Names(Link* link, const std::string& what) {
  const std::vector<std::string> texts = link->refusals().texts;
  return std::ranges::any_of(texts, [&](const std::string& text) { return text.find(what) != std::string::npos; });
}

/// The other side of a link: answers pulses, so that its clock is known, and sends the test's packets.
class Intruder {
 public:
  explicit Intruder(FarSide side)
      : far_(Far(side), [this](FarLane, std::span<const std::uint8_t> bytes) { OnPacket(bytes); }),
        epoch_(static_cast<std::uint64_t>(MonotonicNs())) {}

  /// Sends a packet of the link's session.
  template <class Put>
  void Send(PacketKind kind, const Put& put) {
    SendAs({kind, epoch_, SessionKeyOf(SomeOffer().session_id)}, put);
  }
  template <class Put>
  void SendAs(const Envelope& envelope, const Put& put) {
    std::vector<std::uint8_t> packet;
    PutEnvelope(envelope, &packet);
    put(&packet);
    (void)far_.Send(FarLane::kOrdered, packet);
  }
  template <class T>
  void SendSample(T message) {
    SendSampleAs({PacketKind::kSample, epoch_, SessionKeyOf(SomeOffer().session_id)}, std::move(message));
  }
  template <class T>
  void SendSampleAs(const Envelope& envelope, T message) {
    const_cast<Stamp&>(bus::StampOf(message)) = {++number_, epoch_, MonotonicNs()};
    std::vector<std::uint8_t> cdr;
    ASSERT_TRUE(bus::EncodeCdr(message, &cdr));
    const SampleHead head{bus::kTopicOf<T>, number_, 0};
    SendAs(envelope, [&](std::vector<std::uint8_t>* out) { PutSample(head, {}, cdr, out); });
  }
  void SendOffer(const Offer& offer) {
    SendAs({PacketKind::kOffer, epoch_, SessionKeyOf(offer.session_id)}, [&](auto* out) { PutOffer(offer, out); });
  }
  [[nodiscard]] int Count(PacketKind kind) {
    const std::lock_guard lock(mutex_);
    return counts_[static_cast<std::size_t>(kind)];
  }
  [[nodiscard]] std::uint64_t epoch() const { return epoch_; }
  std::atomic<std::int64_t> ahead_ns{0};  ///< Its clock minus that of the link.

 private:
  void OnPacket(std::span<const std::uint8_t> bytes) {
    Envelope envelope;
    std::span<const std::uint8_t> body;
    std::uint8_t version = 0;
    if (!TakeEnvelope(bytes, &envelope, &body, &version)) return;
    {
      const std::lock_guard lock(mutex_);
      ++counts_[static_cast<std::size_t>(envelope.kind)];
    }
    Pulse pulse;
    if (envelope.kind != PacketKind::kPulse || !TakePulse(body, &pulse)) return;
    Pulse answer;
    answer.schema_hash = bus::SchemaHash();
    answer.heard_epoch = envelope.epoch;
    answer.heard_sent_ns = pulse.sent_ns;
    answer.heard_ns = answer.sent_ns = MonotonicNs() + ahead_ns;
    Send(PacketKind::kPulse, [&](auto* out) { PutPulse(answer, out); });
  }

  std::mutex mutex_;
  std::array<int, kPacketKinds> counts_{};
  bus::FarParticipant far_;
  const std::uint64_t epoch_;
  std::uint32_t number_ = 0;
};

/// A link under test on the bus of one cart, and an intruder as its other side.
struct Attacked {
  explicit Attacked(FarSide side, const fs::path& scene = {})
      : link(side == FarSide::kCart ? CartSettings({}, scene) : HostSettings()),
        intruder(side == FarSide::kCart ? FarSide::kHost : FarSide::kCart) {
    if (side == FarSide::kHost) {
      EXPECT_TRUE(Eventually([&] {
        intruder.SendOffer(SomeOffer());
        std::this_thread::sleep_for(std::chrono::milliseconds(10));
        return link.session().number != 0;
      }));
    }
    link.Join(&local, side == FarSide::kCart ? kRemote : ~kRemote);
    EXPECT_TRUE(Eventually([&] { return link.status().known; }));
  }
  ~Attacked() { link.Leave(); }

  /// Sends `message` until the link refuses it and names it in a report.
  template <class T>
  void ExpectNamed(const T& message, const std::string& what) {
    const std::uint64_t before = link.status().refused;
    EXPECT_TRUE(Eventually([&] {
      intruder.SendSample(message);
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
      return Names(&link, "sent " + what + ",");
    })) << what;
    EXPECT_GT(link.status().refused, before) << what;
  }
  /// Sends Health of `node` until it is published here.
  [[nodiscard]] bool HealthArrives(NodeId node) {
    Health got;
    return Eventually([&] {
      intruder.SendSample(HealthOf(node));
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
      bool found = false;
      while (healths->TakeNext(&got)) found = found || got.node == node;
      return found;
    });
  }
  [[nodiscard]] static Health HealthOf(NodeId node) {
    Health health = Sample<Health>();
    health.node = node;
    return health;
  }

  bus::DdsParticipant local{{.domain = kDomain, .node_name = "local", .shared_memory = {}}};
  std::unique_ptr<bus::Input<Health>> healths = local.MakeInput<Health>();
  Link link;
  Intruder intruder;
};

TEST(LinkRefusal, FromTheHostTheCartTakesSamplesOfTheHostsNodesOnly) {
  Attacked cart(FarSide::kCart);
  const auto tools = cart.local.MakeInput<ToolState>();
  const auto manifests = cart.local.MakeInput<SceneManifest>();
  ASSERT_TRUE(cart.HealthArrives(NodeId::kRender));
  EXPECT_TRUE(cart.link.refusals().texts.empty());
  cart.ExpectNamed(Sample<ToolState>(), "ToolState");
  cart.ExpectNamed(Sample<SceneManifest>(), "SceneManifest");
  cart.ExpectNamed(Sample<GeneratorSetting>(), "GeneratorSetting");
  cart.ExpectNamed(Attacked::HealthOf(NodeId::kSupervisor), "Health of supervisor");
  cart.ExpectNamed(Attacked::HealthOf(NodeId::kPhysics), "Health of physics_node");
  TickManifest tick = Sample<TickManifest>();
  tick.node = NodeId::kPhysics;
  // The link accepts TickManifest only while it has a reader.
  const auto ticks = cart.local.MakeInput<TickManifest>();
  cart.ExpectNamed(tick, "TickManifest of physics_node");
  tick.node = NodeId::kThermal;
  TickManifest got;
  EXPECT_TRUE(Eventually([&] {
    cart.intruder.SendSample(tick);
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
    return ticks->TakeLatest(&got);
  }));
  EXPECT_EQ(got.node, NodeId::kThermal);

  // None of these samples was published.
  ToolState tool;
  SceneManifest manifest;
  Health health;
  EXPECT_FALSE(tools->TakeLatest(&tool));
  EXPECT_FALSE(manifests->TakeLatest(&manifest));
  while (cart.healths->TakeNext(&health)) EXPECT_EQ(health.node, NodeId::kRender);
  EXPECT_EQ(cart.link.refusals().count(), 6u) << "each is reported once";
}

TEST(LinkRefusal, FromTheCartAHostTakesNothingOfItsOwnNodes) {
  Attacked host(FarSide::kHost);
  const auto topologies = host.local.MakeInput<TopologyState>();
  ASSERT_TRUE(host.HealthArrives(NodeId::kSupervisor));
  ASSERT_TRUE(host.HealthArrives(NodeId::kPhysics));
  host.ExpectNamed(Sample<TopologyState>(), "TopologyState");
  host.ExpectNamed(Attacked::HealthOf(NodeId::kRender), "Health of render_node");
  host.ExpectNamed(Sample<TickManifest>(), "TickManifest");
  TopologyState topology;
  EXPECT_FALSE(topologies->TakeLatest(&topology));
}

// No topic carries a command. The remaining attempts are a sample of a topic that does not exist, and another kind of
// packet.
TEST(LinkRefusal, ACommandIsRefusedOnBothSides) {
  const std::string swap = "swap physics_node command /bin/sh";
  const std::vector<std::uint8_t> bytes(swap.begin(), swap.end());
  for (const FarSide side : {FarSide::kCart, FarSide::kHost}) {
    Attacked attacked(side);
    const std::uint64_t before = attacked.link.status().refused;
    std::uint64_t sent = 0;
    EXPECT_TRUE(Eventually([&] {
      attacked.intruder.Send(PacketKind::kSample, [&](std::vector<std::uint8_t>* out) {
        PutSample({static_cast<TopicId>(kTopicCount), 1, 0}, {}, bytes, out);
      });
      attacked.intruder.Send(static_cast<PacketKind>(kPacketKinds), [&](std::vector<std::uint8_t>* out) {
        out->insert(out->end(), bytes.begin(), bytes.end());
      });
      sent += 2;
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
      return attacked.link.status().refused >= before + 10;
    }));
    EXPECT_LE(attacked.link.status().refused, before + sent);
    EXPECT_TRUE(attacked.HealthArrives(side == FarSide::kCart ? NodeId::kRender : NodeId::kPhysics))
        << "the link still works";
  }
}

TEST(LinkRefusal, PacketsOfAnotherSessionAndOfAnEarlierLinkAreRefused) {
  Attacked cart(FarSide::kCart);
  ASSERT_TRUE(cart.HealthArrives(NodeId::kRender));
  const std::uint64_t key = SessionKeyOf(SomeOffer().session_id);
  for (const Envelope& envelope : {Envelope{PacketKind::kSample, cart.intruder.epoch(), key + 1},
                                   Envelope{PacketKind::kSample, cart.intruder.epoch(), 0},
                                   Envelope{PacketKind::kSample, cart.intruder.epoch() - 1, key}}) {
    const std::uint64_t before = cart.link.status().refused;
    EXPECT_TRUE(Eventually([&] {
      cart.intruder.SendSampleAs(envelope, Attacked::HealthOf(NodeId::kThermal));
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
      return cart.link.status().refused > before + 3;
    }));
  }
  Health health;
  while (cart.healths->TakeNext(&health)) EXPECT_NE(health.node, NodeId::kThermal);
}

TEST(LinkRefusal, OnlyTheCartOffersAndEndsASession) {
  Attacked cart(FarSide::kCart);
  const auto nothing = [](auto*) {};
  EXPECT_TRUE(Eventually([&] {
    cart.intruder.Send(PacketKind::kBye, nothing);
    cart.intruder.SendOffer(SomeOffer());
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
    return Names(&cart.link, "an end of the session") && Names(&cart.link, "an offer of a session");
  }));
  EXPECT_FALSE(cart.link.session().over);
}

TEST(LinkRefusal, AnOfferWithAPathInsteadOfANameIsRefused) {
  Link host(HostSettings());
  Intruder cart(FarSide::kCart);
  for (const char* bad : {"../../x", "/tmp/x", ".hidden", "a\x1b[2J", ""}) {
    for (std::string Offer::*field : {&Offer::session_id, &Offer::scene_name}) {
      Offer offer = SomeOffer();
      offer.*field = bad;
      const std::uint64_t before = host.status().refused;
      EXPECT_TRUE(Eventually([&] {
        cart.SendOffer(offer);
        std::this_thread::sleep_for(std::chrono::milliseconds(5));
        return host.status().refused > before;
      })) << bad;
    }
  }
  EXPECT_EQ(host.session().number, 0u);
  EXPECT_TRUE(Eventually([&] {
    cart.SendOffer(SomeOffer());
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
    return host.session().number == 1;
  }));
}

TEST(LinkRefusal, AReceivedEnumeratorIsNoIndexBeforeItIsChecked) {
  Attacked cart(FarSide::kCart);
  const auto ticks = cart.local.MakeInput<TickManifest>();
  TickManifest tick = Sample<TickManifest>(), got;
  tick.node = NodeId::kThermal;
  tick.consumed = {{static_cast<TopicId>(200), 1, 1}};
  const std::uint64_t before = cart.link.status().refused;
  EXPECT_TRUE(Eventually([&] {
    cart.intruder.SendSample(tick);
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
    return cart.link.status().refused > before + 3;
  }));
  EXPECT_FALSE(ticks->TakeLatest(&got));
}

TEST(LinkRefusal, AnotherVersionOfThePeerIsNamedAndEndsNothing) {
  Attacked cart(FarSide::kCart);
  EXPECT_TRUE(Eventually([&] {
    cart.intruder.Send(PacketKind::kPulse, [](std::vector<std::uint8_t>* out) { (*out)[2] = kWireVersion + 1; });
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
    return Names(&cart.link, "of the link");
  }));
  // Also of another schema, when the peer was started again.
  Pulse pulse;
  pulse.schema_hash = bus::SchemaHash() + 1;
  const Envelope restarted{PacketKind::kPulse, cart.intruder.epoch() + 1, SessionKeyOf(SomeOffer().session_id)};
  EXPECT_TRUE(Eventually([&] {
    cart.intruder.SendAs(restarted, [&](auto* out) { PutPulse(pulse, out); });
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
    return Names(&cart.link, "another schema") || !cart.link.mismatch().empty();
  }));
  EXPECT_TRUE(cart.link.mismatch().empty()) << cart.link.mismatch();
}

// Stamps follow the offset of the clocks, and so must the start of the session, from which session times count.
TEST(LinkClock, TheStartOfTheSessionFollowsTheClockOfTheOtherHost) {
  Attacked host(FarSide::kHost);
  const auto manifests = host.local.MakeInput<SceneManifest>();
  SceneManifest manifest = Sample<SceneManifest>(), got;
  manifest.session_start_ns = MonotonicNs();
  ASSERT_TRUE(Eventually([&] {
    host.intruder.SendSample(manifest);
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    return manifests->TakeLatest(&got);
  }));
  const std::int64_t expected_ns = got.session_start_ns - 100'000'000;
  host.intruder.ahead_ns = 100'000'000;
  EXPECT_TRUE(Eventually(
      [&] { return manifests->TakeLatest(&got) && std::abs(expected_ns - got.session_start_ns) < 20'000'000; }));
}

TEST(LinkRefusal, AFloodOfRequestsIsAnsweredAtABoundedRate) {
  const fs::path scene = fs::temp_directory_path() / ("link-flood-" + std::to_string(::getpid()));
  std::ofstream(scene, std::ios::binary) << std::string(SomeOffer().scene_B, 'x');
  {
    Attacked cart(FarSide::kCart, scene);
    const std::int64_t begin = MonotonicNs();
    for (int i = 0; i < 2000; ++i) {
      cart.intruder.Send(PacketKind::kSceneAsk, [](auto* out) { PutSceneAsk({SomeOffer().scene_hash, 0}, out); });
      if (i % 100 == 0) std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    EXPECT_TRUE(Eventually([&] { return cart.intruder.Count(PacketKind::kSceneChunk) > 0; }));
    std::this_thread::sleep_for(std::chrono::milliseconds(200));
    const auto periods = static_cast<int>((MonotonicNs() - begin) / 50'000'000);
    EXPECT_LE(cart.intruder.Count(PacketKind::kSceneChunk), 16 * (periods + 2));
  }
  fs::remove(scene);
}

// ------------------------------------------------------------------------------------------------------- addresses

TEST(LinkAddress, ADatagramFromAThirdAddressIsDroppedAndNamed) {
  Link cart(CartSettings());
  const int fd = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  sockaddr_in from{}, to{};
  from.sin_family = to.sin_family = AF_INET;
  inet_pton(AF_INET, "127.0.0.5", &from.sin_addr);
  inet_pton(AF_INET, "127.0.0.1", &to.sin_addr);
  // RTPS 2.3, 9.6.1.1: discovery of participant 100, the cart's side.
  to.sin_port = htons(static_cast<std::uint16_t>(7400 + 250 * kBetween + 10 + 2 * 100));
  ASSERT_EQ(bind(fd, reinterpret_cast<const sockaddr*>(&from), sizeof from), 0);
  const std::string text = "RTPS, or so it claims";
  EXPECT_TRUE(Eventually([&] {
    (void)sendto(fd, text.data(), text.size(), 0, reinterpret_cast<const sockaddr*>(&to), sizeof to);
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
    return cart.status().refused > 3;
  }));
  close(fd);
  EXPECT_TRUE(Names(&cart, "from 127.0.0.5, which is not its peer"));
}

TEST(LinkAddress, AHostAtAnotherAddressThanThePeerNeverConnects) {
  LinkSettings settings = CartSettings();
  settings.far.peer = "127.0.0.9";
  Link cart(settings);
  Link host(HostSettings());  // It sends from 127.0.0.1.
  EXPECT_TRUE(Eventually([&] { return Names(&cart, "from 127.0.0.1, which is not its peer"); }));
  // The time of ten announcements; two sides that accept each other need one.
  std::this_thread::sleep_for(std::chrono::seconds(2));
  EXPECT_EQ(host.session().number, 0u);
  EXPECT_FALSE(cart.status().connected);
}

// ------------------------------------------------------------------------------------------------------- keys

struct KeyFolders {
  KeyFolders() {
    const std::time_t now = std::time(nullptr);
    for (const fs::path& keys : {ours, others}) keys::MakeKeyFolder(keys, {now, now + 3600}, false);
  }
  ~KeyFolders() { fs::remove_all(folder); }
  const fs::path folder = fs::temp_directory_path() / ("link-keys-" + std::to_string(::getpid()));
  const fs::path ours = folder / "ours", others = folder / "others";
};

TEST(LinkKeys, AreNeededAndMustBeTheSame) {
  const KeyFolders keys;
  for (const fs::path& theirs : {keys.others, fs::path()}) {
    Link cart(CartSettings(keys.ours));
    Link host(HostSettings(theirs));
    EXPECT_TRUE(Eventually([&] { return !host.mismatch().empty(); })) << theirs;
    EXPECT_TRUE(Eventually([&] { return Names(&cart, theirs.empty() ? "no keys" : "another authority"); })) << theirs;
    EXPECT_EQ(host.session().number, 0u);
  }
  Link cart(CartSettings(keys.ours));
  Link host(HostSettings(keys.ours));
  EXPECT_TRUE(Eventually([&] { return host.session().number == 1; }));
  EXPECT_FALSE(cart.status().insecure);
}

TEST(LinkKeys, ABurstOfSmallEncryptedPacketsArrivesWhole) {
  const KeyFolders keys;
  std::atomic<int> arrived{0};
  bus::FarParticipant host(Far(FarSide::kHost, keys.ours), [&](FarLane, std::span<const std::uint8_t>) { ++arrived; });
  bus::FarParticipant cart(Far(FarSide::kCart, keys.ours), [](FarLane, std::span<const std::uint8_t>) {});
  ASSERT_TRUE(Eventually([&] { return cart.matched() && host.matched(); }));
  // Fewer than kOrderedBacklog, so that none is replaced; more than fit into one datagram.
  constexpr int kBursts = 20, kBurst = 200;
  std::vector<std::uint8_t> packet(60);
  for (int burst = 1; burst <= kBursts; ++burst) {
    packet.push_back(1);  // Datagrams are filled to different sizes.
    for (int i = 0; i < kBurst; ++i) ASSERT_TRUE(cart.Send(FarLane::kOrdered, packet));
    ASSERT_TRUE(Eventually([&] { return arrived == burst * kBurst; })) << arrived;
  }
}

TEST(LinkKeys, ComeFromTheOptionTheCartFileOrTheDefaultFolderOrTheLinkIsNamedInsecure) {
  const KeyFolders keys;
  ASSERT_EQ(setenv("HOME", keys.folder.c_str(), 1), 0);
  ASSERT_EQ(unsetenv("XDG_CONFIG_HOME"), 0);
  EXPECT_EQ(KeysOfLink(keys.ours, keys.others, false), keys.ours);
  EXPECT_EQ(KeysOfLink({}, keys.others, false), keys.others);
  EXPECT_TRUE(KeysOfLink({}, keys.others, true).empty());
  EXPECT_THROW((void)KeysOfLink(keys.ours, {}, true), InputError);
  EXPECT_THROW((void)KeysOfLink(keys.folder / "none", {}, false), InputError);
  try {
    (void)KeysOfLink({}, {}, false);
    ADD_FAILURE() << "a link was made without keys";
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("run `fulcrum keys init`"), std::string::npos) << error.what();
  }
  fs::create_directories(keys::DefaultKeyFolder().parent_path());
  fs::copy(keys.ours, keys::DefaultKeyFolder(), fs::copy_options::recursive);
  fs::permissions(keys::DefaultKeyFolder(), fs::perms::owner_all);
  EXPECT_EQ(KeysOfLink({}, {}, false), keys::DefaultKeyFolder());
}

TEST(LinkKeys, TheCommandsEndWithoutThem) {
  const KeyFolders keys;
  ASSERT_EQ(setenv("HOME", keys.folder.c_str(), 1), 0);
  const std::string fulcrum = std::string(FULCRUM_BIN_DIR) + "/fulcrum";
  const std::vector<std::vector<std::string>> commands{
      {"host", "--peer", "127.0.0.1"},
      {"up", "built-in", "--peer", "127.0.0.1", "--remote", "render_node"},
  };
  for (const auto& words : commands) {
    fulcrum::testing::Program program(fulcrum, words);
    EXPECT_EQ(program.End(0), 2) << program.Said();
    EXPECT_NE(program.Said().find("fulcrum keys init"), std::string::npos) << program.Said();
  }
}

}  // namespace
}  // namespace fulcrum::link
