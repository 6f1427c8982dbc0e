// Every topic through the real bus between two participants of one process.
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <limits>
#include <string>
#include <thread>

#include "services/base/core/error.h"
#include "services/transport/bus/dds/abandoned_mutex.h"
#include "services/transport/bus/gate.h"
#include "tests/integration/bus/count_new.h"
#include "tests/integration/bus/support.h"
#include "tests/support/rogue.h"
#include "tests/unit/bus/message_types.h"
#include "tests/unit/bus/same.h"
#include "tests/unit/bus/samples.h"

namespace fulcrum::bus {
namespace {

using test::Eventually;

constexpr int kDomain = 11;
const auto* const kClean = ::testing::AddGlobalTestEnvironment(new test::CleanDomain(kDomain));

/// An output and a matched input of the same topic on two participants.
template <class T>
struct Pair {
  DdsParticipant writer_side{{.domain = kDomain, .node_name = "writer", .shared_memory = {}}};
  DdsParticipant reader_side{{.domain = kDomain, .node_name = "reader", .shared_memory = {}}};
  std::unique_ptr<typename OutputOf<T>::type> out = writer_side.MakeOutput<T>();
  std::unique_ptr<Input<T>> in = reader_side.MakeInput<T>();
  Pair() {
    EXPECT_TRUE(Eventually([&] { return out->has_readers() && in->stats().matched; }));
  }
};

template <class T>
class EveryTopic : public ::testing::Test {};
using Types = test::MessageTypes;
TYPED_TEST_SUITE(EveryTopic, Types);

TYPED_TEST(EveryTopic, ArrivesUnchanged) {
  Pair<TypeParam> bus;
  const auto sent = test::Sample<TypeParam>();
  ASSERT_TRUE(bus.out->Write(sent));
  TypeParam got;
  ASSERT_TRUE(Eventually([&] { return bus.in->TakeLatest(&got); }));
  EXPECT_TRUE(Same(sent, got));
  EXPECT_FALSE(bus.in->TakeLatest(&got));
  EXPECT_EQ(bus.in->stats().received, 1u);
  EXPECT_EQ(bus.in->stats().rejected, 0u);
  EXPECT_EQ(bus.out->stats().written, 1u);
  EXPECT_EQ(bus.out->stats().failed, 0u);
}

TYPED_TEST(EveryTopic, BadStampIsStoppedAtTheGate) {
  Pair<TypeParam> bus;
  auto bad = test::Sample<TypeParam>();
  if constexpr (requires { bad.header; }) {
    bad.header.stamp.stamp_ns = -1;
  } else {
    bad.stamp.stamp_ns = -1;
  }
  ASSERT_TRUE(bus.out->Write(bad));
  TypeParam got;
  EXPECT_TRUE(Eventually([&] {
    EXPECT_FALSE(bus.in->TakeLatest(&got));
    return bus.in->stats().rejected == 1;
  }));
  EXPECT_EQ(bus.in->stats().received, 0u);
}

TEST(DdsInput, NaNIsStoppedAndTheNextGoodOnePasses) {
  Pair<ToolState> bus;
  ToolState tool = test::Sample<ToolState>(1);
  tool.tools[0].p_WT.x() = std::numeric_limits<float>::quiet_NaN();
  ASSERT_TRUE(bus.out->Write(tool));
  ToolState got;
  EXPECT_TRUE(Eventually([&] { return !bus.in->TakeNext(&got) && bus.in->stats().rejected == 1; }));
  ASSERT_TRUE(bus.out->Write(test::Sample<ToolState>(2)));
  ASSERT_TRUE(Eventually([&] { return bus.in->TakeNext(&got); }));
  EXPECT_EQ(got.stamp.sequence, 2u);
}

TEST(DdsInput, APositionOutsideTheRoomIsStoppedAndNaNIsNotSent) {
  Pair<TissueFrame> bus;
  TissueFrame frame = test::Sample<TissueFrame>(1);
  frame.xyz[100] = std::numeric_limits<float>::quiet_NaN();
  EXPECT_FALSE(bus.out->Write(frame));
  EXPECT_EQ(bus.out->stats().failed, 1u);
  frame.xyz[100] = 11;
  ASSERT_TRUE(bus.out->Write(frame));
  TissueFrame got;
  EXPECT_TRUE(Eventually([&] { return !bus.in->TakeNext(&got) && bus.in->stats().rejected == 1; }));
  ASSERT_TRUE(bus.out->Write(test::Sample<TissueFrame>(2)));
  ASSERT_TRUE(Eventually([&] { return bus.in->TakeNext(&got); }));
  EXPECT_EQ(got.header.stamp.sequence, 2u);
}

TEST(DdsInput, WhatWritersAndReadersShareIsLockedByUs) {
  const std::uint64_t before = dds::SharedLocks().locked;
  Pair<TissueFrame> bus;
  ASSERT_TRUE(bus.out->Write(test::Sample<TissueFrame>(1)));
  TissueFrame got;
  ASSERT_TRUE(Eventually([&] { return bus.in->TakeNext(&got); }));
  EXPECT_GT(dds::SharedLocks().locked, before) << "see services/transport/bus/dds/abandoned_mutex.h";
}

TEST(DdsInput, BytesThatAreNoMessageAreRefusedAndHoldNothingUp) {
  Pair<ContactModel> models;
  Pair<Health> healths;
  fulcrum::testing::Rogue rogue({.domain = kDomain, .node_name = "rogue", .shared_memory = {}});
  EXPECT_GT(rogue.PourBytes(30, 1), 0u);
  ASSERT_TRUE(models.out->Write(test::Sample<ContactModel>()));
  ASSERT_TRUE(healths.out->Write(test::Sample<Health>()));
  ContactModel model;
  Health health;
  ASSERT_TRUE(Eventually([&] { return models.in->TakeNext(&model); }));
  // Bytes with many zeros may decode to a valid Health of a node that has not started its work.
  ASSERT_TRUE(Eventually([&] { return healths.in->TakeNext(&health) && Same(health, test::Sample<Health>()); }));
  EXPECT_TRUE(Same(model, test::Sample<ContactModel>()));
  const std::uint64_t refused = models.in->stats().rejected;
  EXPECT_GT(refused, 5u) << "some are longer than any message and are dropped earlier";
  EXPECT_GT(healths.in->stats().rejected, 5u);
  EXPECT_FALSE(models.in->TakeNext(&model));
  EXPECT_EQ(models.in->stats().rejected, refused) << "each is counted once";
  EXPECT_EQ(models.in->stats().received, 1u);
}

TEST(DdsInput, TakeLatestPassesOverOlderFramesAndKeepsTheBooks) {
  Pair<TissueFrame> bus;
  for (std::uint64_t i = 1; i <= 3; ++i) ASSERT_TRUE(bus.out->Write(test::Sample<TissueFrame>(i)));
  TissueFrame got;
  ASSERT_TRUE(Eventually([&] { return bus.in->TakeLatest(&got) && got.header.stamp.sequence == 3; }));
  EXPECT_EQ(bus.in->stats().received, 3u);
  EXPECT_FALSE(bus.in->TakeLatest(&got));
}

TEST(DdsInput, TakeNextGivesEveryPatchInOrder) {
  Pair<TemperaturePatch> bus;
  for (std::uint64_t i = 1; i <= 10; ++i) ASSERT_TRUE(bus.out->Write(test::Sample<TemperaturePatch>(i)));
  TemperaturePatch got;
  for (std::uint64_t i = 1; i <= 10; ++i) {
    ASSERT_TRUE(Eventually([&] { return bus.in->TakeNext(&got); }));
    EXPECT_EQ(got.header.stamp.sequence, i);
  }
  EXPECT_EQ(bus.in->stats().lost, 0u);
}

TEST(DdsInput, BurstOfReliableEventsArrivesWhole) {
  Pair<ThermalEvent> bus;
  for (std::uint64_t i = 1; i <= 200; ++i) ASSERT_TRUE(bus.out->Write(test::Sample<ThermalEvent>(i)));
  ThermalEvent got;
  for (std::uint64_t i = 1; i <= 200; ++i) {
    ASSERT_TRUE(Eventually([&] { return bus.in->TakeNext(&got); }));
    ASSERT_EQ(got.stamp.sequence, i);
  }
}

/// Voluntary changes of threads in this process since its start.
std::int64_t ThreadChanges() {
  std::int64_t sum = 0;
  for (const auto& task : std::filesystem::directory_iterator("/proc/self/task")) {
    std::ifstream status(task.path() / "status");
    for (std::string word; status >> word;) {
      std::int64_t count = 0;
      if (word == "voluntary_ctxt_switches:" && status >> count) sum += count;
    }
  }
  return sum;
}

/// Changes of threads for each of many samples that are sent one by one.
template <class T>
double ThreadChangesPerSample() {
  Pair<T> bus;
  T got;
  std::uint64_t sent = 0, received = 0;
  const auto stream = [&](int samples) {
    for (int i = 0; i < samples; ++i) {
      EXPECT_TRUE(bus.out->Write(test::Sample<T>(++sent)));
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
      while (bus.in->TakeNext(&got)) ++received;
    }
  };
  stream(100);  // More than a history: a full one makes the library ask with each sample.
  const std::int64_t before = ThreadChanges();
  constexpr int kSamples = 300;
  stream(kSamples);
  const double changes = static_cast<double>(ThreadChanges() - before) / kSamples;
  EXPECT_TRUE(Eventually([&] {
    while (bus.in->TakeNext(&got)) ++received;
    return received == sent;
  }));
  EXPECT_EQ(bus.in->stats().lost, 0u);
  return changes;
}

// Each answer wakes two threads of the reader's side and one of the writer's.
TEST(DdsOutput, AReliableStreamIsNotAnsweredSampleBySample) {
  const double stream = ThreadChangesPerSample<CauteryContact>();
  const double one_by_one = ThreadChangesPerSample<GeneratorSetting>();  // Rare: each sample is answered.
  RecordProperty("stream", std::to_string(stream));
  EXPECT_LT(stream, 0.88 * one_by_one) << "changes of threads a sample; " << one_by_one << " if each one is answered";
}

TEST(RawInput, HearsAllThatAWriterSaidBeforeItLeft) {
  DdsParticipant listener({.domain = kDomain, .node_name = "listener", .shared_memory = {}, .gathers = true});
  std::atomic<int> heard{0};
  const auto input = listener.MakeRawInput(TopicId::kToolState, [&](const RawSample&) { ++heard; });
  constexpr int kSamples = 40;
  for (int writer = 1; writer <= 5; ++writer) {
    ASSERT_TRUE(Eventually([&] { return !input->matched(); })) << "the previous writer has left";
    DdsParticipant teller({.domain = kDomain, .node_name = "teller", .shared_memory = {}});
    auto output = teller.MakeOutput<ToolState>();
    ASSERT_TRUE(Eventually([&] { return output->has_readers() && input->matched(); }));
    for (std::uint64_t i = 1; i <= kSamples; ++i) {
      ASSERT_TRUE(output->Write(test::Sample<ToolState>(i)));
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    output.reset();
    EXPECT_TRUE(Eventually([&] { return heard == writer * kSamples; })) << heard << " by " << writer << " writers";
  }
}

TEST(RawInput, ReadsTheFirstSampleOfAWriterThatBothSidesHaveMatched) {
  DdsParticipant recorder({.domain = kDomain, .node_name = kRecorderPeer, .shared_memory = {}});
  std::atomic<int> received{0};
  const auto take = [&](const RawSample&) { ++received; };
  const auto tools = recorder.MakeRawInput(TopicId::kToolState, take);
  const auto contacts = recorder.MakeRawInput(TopicId::kContactModel, take);
  for (int run = 1; run <= 20; ++run) {
    DdsParticipant node({.domain = kDomain, .node_name = "node", .shared_memory = {}});
    const auto tool_out = node.MakeOutput<ToolState>();
    const auto contact_out = node.MakeOutput<ContactModel>();
    ASSERT_EQ(node.writer_count(), 2);
    ASSERT_TRUE(Eventually([&] {
      const std::vector<ReadPeer> peers = recorder.PeersRead();
      return node.IsReadBy(kRecorderPeer) && std::any_of(peers.begin(), peers.end(), [&](const ReadPeer& peer) {
               return peer.address == node.address() && peer.writers == node.writer_count();
             });
    }));
    ASSERT_TRUE(tool_out->Write(test::Sample<ToolState>(1)));
    ASSERT_TRUE(contact_out->Write(test::Sample<ContactModel>(1)));
    ASSERT_TRUE(Eventually([&] { return received == 2 * run; })) << received << " of " << 2 * run;
  }
}

TEST(DdsInput, GapsAreLosses) {
  Pair<ToolState> bus;
  ToolState got;
  for (const std::uint64_t sequence : {1u, 2u, 5u}) {
    ASSERT_TRUE(bus.out->Write(test::Sample<ToolState>(sequence)));
    ASSERT_TRUE(Eventually([&] { return bus.in->TakeLatest(&got); }));
  }
  EXPECT_EQ(bus.in->stats().lost, 2u);
}

TEST(DdsOutput, SteadyStreamDoesNotAllocateInTheCallersThread) {
  Pair<ToolState> bus;
  const ToolState sent = test::Sample<ToolState>();
  ToolState got;
  const auto pass_one = [&] {
    ASSERT_TRUE(bus.out->Write(sent));
    ASSERT_TRUE(Eventually([&] { return bus.in->TakeLatest(&got); }));
  };
  for (int i = 0; i < 200; ++i) pass_one();
  // On a busy machine a sample waits for its reader longer than a period: pools grow to what then waits.
  for (int i = 0; i < 20; ++i) {
    for (int n = 0; n < 8; ++n) (void)bus.out->Write(sent);
    pass_one();
  }
  for (int i = 0; i < 20; ++i) pass_one();
  long taking = 0, writing = 0;
  for (int i = 0; i < 200; ++i) {
    const long before_write = test::NewCalls();
    ASSERT_TRUE(bus.out->Write(sent));
    const long before_take = test::NewCalls();
    ASSERT_TRUE(Eventually([&] { return bus.in->TakeLatest(&got); }));
    writing += before_take - before_write;
    taking += test::NewCalls() - before_take;
  }
  RecordProperty("allocations_writing", static_cast<int>(writing));
  EXPECT_EQ(taking, 0);
  EXPECT_EQ(writing, 0);
}

TEST(DdsOutput, PayloadIsWrittenInTheSharedMemoryOfTheCart) {
  Pair<TemperaturePatch> bus;
  const std::string directory = SharedMemoryDirectory(kDomain).string();
  bool in_shared_memory = false;
  ASSERT_TRUE(bus.out->WriteInPlace([&](TemperaturePatch::View view) {
    view.header.stamp.sequence = 1;
    const auto address = reinterpret_cast<std::uintptr_t>(view.texels.data());
    std::ifstream maps("/proc/self/maps");
    for (std::string line; std::getline(maps, line);) {
      unsigned long first = 0, last = 0;
      if (std::sscanf(line.c_str(), "%lx-%lx", &first, &last) == 2 && address >= first && address < last) {
        in_shared_memory = line.find(directory) != std::string::npos;
      }
    }
  }));
  EXPECT_TRUE(in_shared_memory);
  TemperaturePatch got;
  ASSERT_TRUE(Eventually([&] { return bus.in->TakeLatest(&got); }));
}

/// Writer and reader need not know the same largest frame: each frame is as long as its content.
TEST(DdsOutput, AFrameLargerThanItsWritersMemoryIsNotSent) {
  DdsParticipant small({.domain = kDomain, .node_name = "small", .shared_memory = {}, .tissue_vertices = 100});
  DdsParticipant large({.domain = kDomain, .node_name = "large", .shared_memory = {}});
  const auto out = small.MakeOutput<TissueFrame>();
  const auto in = large.MakeInput<TissueFrame>();
  TissueFrame frame = test::Sample<TissueFrame>();
  EXPECT_FALSE(out->Write(frame));
  EXPECT_EQ(out->stats().failed, 1u);
  frame.header.vertex_count = 100;
  frame.xyz.resize(300);
  TissueFrame got;
  ASSERT_TRUE(Eventually([&] {
    ++frame.header.stamp.sequence;
    return out->Write(frame) && in->TakeLatest(&got);
  }));
  EXPECT_EQ(got.xyz, frame.xyz);
}

/// When the library learns that a writer has left it unmaps its pool, also beneath a sample that is being read.
TEST(DdsInput, AWriterMayLeaveWhileItsFramesAreRead) {
  DdsParticipant reader({.domain = kDomain, .node_name = "reader", .shared_memory = {}});
  const auto in = reader.MakeInput<TissueFrame>();
  TissueFrame frame = test::Sample<TissueFrame>();
  frame.header.vertex_count = kMaxTissueVertices;
  frame.xyz.assign(std::size_t{3} * kMaxTissueVertices, 0.01f);
  for (int writer = 0; writer < 30; ++writer) {
    DdsParticipant node({.domain = kDomain, .node_name = "writer", .shared_memory = {}});
    auto out = node.MakeOutput<TissueFrame>();
    TissueFrame got;
    ASSERT_TRUE(Eventually([&] {
      ++frame.header.stamp.sequence;
      return out->Write(frame) && in->TakeLatest(&got);
    }));
    for (int i = 0; i < 4; ++i) {
      ++frame.header.stamp.sequence;
      EXPECT_TRUE(out->Write(frame));
    }
    std::thread reading([&] {
      const auto end = std::chrono::steady_clock::now() + std::chrono::milliseconds(30);
      while (std::chrono::steady_clock::now() < end) (void)in->TakeNext(&got);
    });
    std::this_thread::sleep_for(std::chrono::microseconds(200 * (writer % 8)));
    out.reset();
    reading.join();
  }
}

TEST(DdsOutput, FillThatThrowsIsCountedAndItsLoanComesBack) {
  Pair<TissueFrame> bus;
  for (int i = 0; i < 20; ++i) {  // More often than the pool has places.
    EXPECT_FALSE(bus.out->WriteInPlace([](TissueFrame::View) { throw 1; }));
    EXPECT_FALSE(bus.out->WriteInPlace([](TissueFrame::View v) { v.header.vertex_count = kMaxTissueVertices + 1; }));
  }
  EXPECT_EQ(bus.out->stats().failed, 40u);
  ASSERT_TRUE(bus.out->Write(test::Sample<TissueFrame>()));
  TissueFrame got;
  ASSERT_TRUE(Eventually([&] { return bus.in->TakeLatest(&got); }));
}

TEST(DdsOutput, WhatDoesNotFitIsCounted) {
  Pair<TickManifest> bus;
  TickManifest tick = test::Sample<TickManifest>();
  tick.consumed.resize(kMaxConsumedInputs + 1);
  EXPECT_FALSE(bus.out->Write(tick));
  EXPECT_EQ(bus.out->stats().failed, 1u);
}

TEST(DdsInput, SamplesOfAnotherSessionAreDroppedAndCounted) {
  DdsParticipant ours({.domain = kDomain, .node_name = "ours", .shared_memory = {}, .session = 11});
  DdsParticipant theirs({.domain = kDomain, .node_name = "theirs", .shared_memory = {}, .session = 12});
  const auto small_in = ours.MakeInput<ToolState>();
  const auto large_in = ours.MakeInput<TissueFrame>();
  const auto small_ours = ours.MakeOutput<ToolState>();
  const auto small_theirs = theirs.MakeOutput<ToolState>();
  const auto large_theirs = theirs.MakeOutput<TissueFrame>();
  std::uint64_t sequence = 0;
  ToolState small, got;
  TissueFrame large;
  bool heard = false;
  ASSERT_TRUE(Eventually([&] {
    ToolState mine = test::Sample<ToolState>(++sequence);
    small_ours->Write(mine);
    mine.tools[0].p_WT.x() = 0.5f;
    small_theirs->Write(mine);
    large_theirs->Write(test::Sample<TissueFrame>(sequence));
    while (small_in->TakeNext(&got)) {
      heard = true;
      EXPECT_NE(got.tools[0].p_WT.x(), 0.5f);
    }
    EXPECT_FALSE(large_in->TakeLatest(&large));
    return heard && ours.foreign_samples() > 20;
  }));
  EXPECT_EQ(small_in->stats().rejected, 0u) << "a foreign sample is not an invalid one";
  EXPECT_EQ(ours.refusals().participants, 1u);
  ASSERT_EQ(ours.refusals().texts.size(), 1u);
  EXPECT_NE(ours.refusals().texts[0].find("is of another session"), std::string::npos) << ours.refusals().texts[0];
  EXPECT_NE(ours.refusals().texts[0].find("uid "), std::string::npos) << ours.refusals().texts[0];
}

TEST(DdsParticipant, OnlyAPeerOfThisSessionCanBeAMismatch) {
  DdsParticipant ours({.domain = kDomain, .node_name = "ours", .shared_memory = {}, .session = 11});
  const DdsParticipant stranger(
      {.domain = kDomain, .node_name = "supervisor", .shared_memory = {}, .schema_hash = 1, .session = 12});
  ASSERT_TRUE(Eventually([&] { return ours.refusals().participants == 1; }));
  EXPECT_EQ(ours.schema_mismatch(), "");
  const DdsParticipant peer(
      {.domain = kDomain, .node_name = "peer", .shared_memory = {}, .schema_hash = 1, .session = 11});
  EXPECT_TRUE(Eventually([&] { return ours.schema_mismatch().find("schema mismatch: peer peer") == 0; }));
}

TEST(DdsParticipant, DomainOutOfRangeIsRefused) {
  for (const int domain : {-1, 0, 101}) {
    EXPECT_THROW(DdsParticipant({.domain = domain, .node_name = "x", .shared_memory = {}}), InputError);
  }
}

TEST(DdsParticipant, OutsideSettingsAreForgotten) {
  setenv("FASTDDS_STATISTICS", "HISTORY_LATENCY_TOPIC", 1);
  setenv("FASTRTPS_DEFAULT_PROFILES_FILE", "profiles.xml", 1);
  DdsParticipant bus({.domain = kDomain, .node_name = "x", .shared_memory = {}});
  EXPECT_EQ(std::getenv("FASTDDS_STATISTICS"), nullptr);
  EXPECT_EQ(std::getenv("FASTRTPS_DEFAULT_PROFILES_FILE"), nullptr);
}

}  // namespace
}  // namespace fulcrum::bus
