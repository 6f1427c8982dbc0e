// Conversion of messages to wire bytes and back.
#include "services/transport/bus/convert/convert.h"

#include <gtest/gtest.h>

#include <cstring>
#include <limits>
#include <regex>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "services/base/core/message_fields.h"
#include "services/base/core/tissue_blocks.h"
#include "services/transport/bus/convert/generated_types.h"
#include "services/transport/bus/gate.h"
#include "services/transport/bus/schema.h"
#include "services/transport/bus/topics.h"
#include "tests/unit/bus/message_types.h"
#include "tests/unit/bus/same.h"
#include "tests/unit/bus/samples.h"

namespace fulcrum::bus {
namespace {

using Payload = eprosima::fastrtps::rtps::SerializedPayload_t;

/// Through the generated type and its serialised bytes, as over UDP.
template <class T>
bool OverTheWire(const T& from, T* to) {
  typename TypeSupportOf<T>::type type;
  WireOf<T> sent, received;
  if (!ToWire(from, &sent)) return false;
  Payload payload(type.m_typeSize);
  if (!type.serialize(&sent, &payload) || !type.deserialize(&payload, &received)) return false;
  FromWire(received, to);
  return true;
}

/// Through a loan at the worst alignment that the library allows.
template <Loanable T>
bool OverTheWire(const T& from, T* to) {
  std::size_t vertices = 0;
  if constexpr (std::is_same_v<T, TissueFrame>) vertices = from.header.vertex_count;
  const std::size_t loan_B = LoanBytes(&from, vertices);
  std::vector<std::uint64_t> memory(loan_B / 8 + 2);
  const std::span loan(reinterpret_cast<std::byte*>(memory.data()) + 4, loan_B);
  return ToLoan(from, loan) && NeededBytes(kTopicOf<T>, loan) == loan_B && FromLoan(loan, to);
}

template <class T>
class Convert : public testing::Test {};
using Types = test::MessageTypes;
TYPED_TEST_SUITE(Convert, Types);

TYPED_TEST(Convert, RoundTripKeepsEveryField) {
  const auto sent = test::Sample<TypeParam>();
  TypeParam got;
  ASSERT_TRUE(OverTheWire(sent, &got));
  EXPECT_TRUE(Same(sent, got));
}

/// Members of a struct according to its IDL file.
std::set<std::string> MembersInIdl(const std::string& type) {
  const std::string text = std::regex_replace(SchemaText(type), std::regex("//[^\n]*"), "");
  const std::string head = "struct " + type + " {";
  const std::size_t begin = text.find(head) + head.size();
  const std::string body = text.substr(begin, text.find('}', begin) - begin);
  const std::regex member(R"((\w+)(\[[^\]]*\])*\s*;)");
  std::set<std::string> names;
  for (std::sregex_iterator at(body.begin(), body.end(), member), end; at != end; ++at) names.insert((*at)[1]);
  return names;
}

template <class T>
void ExpectTheSameMembers(const std::string& type) {
  std::set<std::string> names;
  ForEachField<T>([&](const char* name, auto) { names.insert(name); });
  EXPECT_EQ(names, MembersInIdl(type)) << type;
}

TEST(ConvertFields, ListsNameEveryMemberThatIdlDeclares) {
#define FULCRUM_EXPECT(T) ExpectTheSameMembers<T>(#T);
  FULCRUM_STRUCTS_ALIKE_IN_IDL(FULCRUM_EXPECT)
#undef FULCRUM_EXPECT
}

/// A writer reuses its wire object.
TEST(ConvertHealth, ShorterErrorLeavesNothingOfTheLongerOneBefore) {
  TypeSupportOf<Health>::type type;
  WireOf<Health> wire, received;
  Health sent = test::Sample<Health>();
  for (const char* error : {"handle 0: unplugged", "handle", ""}) {
    sent.last_error = error;
    ASSERT_TRUE(ToWire(sent, &wire));
    Payload payload(type.m_typeSize);
    ASSERT_TRUE(type.serialize(&wire, &payload) && type.deserialize(&payload, &received));
    Health got;
    FromWire(received, &got);
    EXPECT_EQ(got.last_error, error);
  }
}

TYPED_TEST(Convert, ReusedTargetHoldsNothingOfThePreviousMessage) {
  TypeParam got = test::Sample<TypeParam>();
  TypeParam empty;
  if constexpr (std::is_same_v<TypeParam, TemperaturePatch>) empty.texels.assign(4 * 256 * 256, 9);
  ASSERT_TRUE(OverTheWire(empty, &got));
  EXPECT_TRUE(Same(empty, got));
}

TYPED_TEST(Convert, FitsTheSizeThatPoolsAreMadeFor) {
  typename TypeSupportOf<TypeParam>::type type;
  EXPECT_TRUE(type.is_bounded());
  // 64 KB is the largest datagram; only states of the membrane may be sent in fragments, only loans may be larger.
  constexpr bool kInFragments = std::is_same_v<TypeParam, TopologyState> || std::is_same_v<TypeParam, TearState>;
  if constexpr (!Loanable<TypeParam> && !kInFragments) {
    EXPECT_LT(type.m_typeSize, 60'000u);
  }
}

TEST(ConvertLoan, ALoanIsAsLargeAsItsGeneratedType) {
  EXPECT_EQ(idl::TissueFramePubSubType().m_typeSize,
            LoanBytes(static_cast<const TissueFrame*>(nullptr), kMaxTissueVertices) + 4);
  idl::TemperaturePatchPubSubType patch;
  EXPECT_TRUE(patch.is_plain());
  EXPECT_EQ(patch.m_typeSize, sizeof(idl::TemperaturePatch) + 4);
  idl::PicturePubSubType picture;
  EXPECT_TRUE(picture.is_plain());
  EXPECT_EQ(picture.m_typeSize, sizeof(idl::Picture) + 4);
}

/// A loan of so many vertices.
struct FrameLoan {
  explicit FrameLoan(std::size_t vertices)
      : memory(LoanBytes(static_cast<const TissueFrame*>(nullptr), vertices) / 4),
        bytes(reinterpret_cast<std::byte*>(memory.data()), 4 * memory.size()) {}
  std::vector<std::uint32_t> memory;
  std::span<std::byte> bytes;
};

TEST(ConvertLoan, LoanHasTheLayoutOfTheGeneratedType) {
  const auto frame = test::Sample<TissueFrame>();
  FrameLoan loan(frame.header.vertex_count);
  ASSERT_TRUE(ToLoan(frame, loan.bytes));
  Payload payload(static_cast<std::uint32_t>(4 + loan.bytes.size()));
  payload.data[1] = 1;
  std::memcpy(payload.data + 4, loan.bytes.data(), loan.bytes.size());
  payload.length = payload.max_size;
  idl::TissueFrame wire;
  ASSERT_TRUE(idl::TissueFramePubSubType().deserialize(&payload, &wire));
  EXPECT_EQ(wire.header().vertex_count(), frame.header.vertex_count);
  EXPECT_EQ(wire.header().scene_hash(), frame.header.scene_hash);
  ASSERT_EQ(wire.blocks().size(), BlocksFor(frame.header.vertex_count));
  const idl::TissueBlock& block = wire.blocks()[4711 / 192];
  ASSERT_EQ(block.shift(), 0u);
  EXPECT_EQ(PositionOf(block.origin()[4711 % 3] + block.offset()[4711 % 192]), frame.xyz[4711]);

  const auto patch = test::Sample<TemperaturePatch>();
  auto wire_patch = std::make_unique<idl::TemperaturePatch>();
  ASSERT_TRUE(ToLoan(patch, std::as_writable_bytes(std::span(wire_patch.get(), 1))));
  EXPECT_EQ(wire_patch->header().origin_y(), patch.header.origin_y);
  EXPECT_EQ(wire_patch->texels()[4711], patch.texels[4711]);

  const auto picture = test::Sample<Picture>();
  auto wire_picture = std::make_unique<idl::Picture>();
  ASSERT_TRUE(ToLoan(picture, std::as_writable_bytes(std::span(wire_picture.get(), 1))));
  EXPECT_EQ(wire_picture->header().scale(), picture.header.scale);
  EXPECT_EQ(wire_picture->jpeg()[4], picture.jpeg[4]);
}

TEST(ConvertLoan, CountBeyondTheLoanIsRefusedBothWays) {
  TissueFrame frame = test::Sample<TissueFrame>();
  const std::size_t count = frame.header.vertex_count;
  FrameLoan loan(count), small(count - kBlockVertices);
  ASSERT_TRUE(ToLoan(frame, loan.bytes));
  EXPECT_FALSE(ToLoan(frame, small.bytes));
  EXPECT_FALSE(CloseLoan(frame, small.bytes));
  TissueFrame got;
  EXPECT_FALSE(FromLoan(loan.bytes.first(loan.bytes.size() - 1), &got));
  EXPECT_FALSE(FromLoan(loan.bytes.first(40), &got));
  // Its last 4 bytes of the header but one; behind the header is the number of blocks.
  const std::size_t count_at = sizeof(idl::TissueFrameHeader) - 8, blocks_at = sizeof(idl::TissueFrameHeader);
  for (const std::size_t at : {count_at, blocks_at}) {
    for (const std::uint32_t wrong : {0U, 0xffffffffU}) {
      FrameLoan bad = loan;
      bad.bytes = std::as_writable_bytes(std::span(bad.memory));
      std::memcpy(bad.bytes.data() + at, &wrong, sizeof wrong);
      EXPECT_FALSE(FromLoan(bad.bytes, &got)) << at << " " << wrong;
    }
  }
  ++frame.header.vertex_count;
  EXPECT_FALSE(ToLoan(frame, loan.bytes)) << "fewer positions than it counts";
  frame.xyz.assign(3 * (kMaxTissueVertices + 1), 0);
  frame.header.vertex_count = kMaxTissueVertices + 1;
  EXPECT_FALSE(ToLoan(frame, FrameLoan(kMaxTissueVertices + 64).bytes));
}

TEST(ConvertLoan, APositionThatIsNotFiniteIsNotSent) {
  for (const float bad : {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity(), -2e6F}) {
    FrameLoan loan(2);
    TissueFrame draft;
    TissueFrame::View view = OpenLoan(loan.bytes.data(), &draft);
    view.header.vertex_count = 2;
    view.xyz = {0, 0, 0, 0, 0, 1};
    EXPECT_TRUE(CloseLoan(draft, loan.bytes));
    view.xyz[5] = bad;
    EXPECT_FALSE(CloseLoan(draft, loan.bytes));
  }
}

TEST(ConvertLoan, ASpoiltLoanPassesNoGate) {
  FrameLoan loan(2);
  SpoilLoan(loan.bytes);
  TissueFrame frame;
  EXPECT_TRUE(FromLoan(loan.bytes, &frame));
  EXPECT_FALSE(PassesGate(frame));
}

TEST(ConvertBounds, WhatDoesNotFitIsNotSent) {
  TickManifest manifest = test::Sample<TickManifest>();
  manifest.consumed.resize(kMaxConsumedInputs + 1);
  idl::TickManifest wire_manifest;
  EXPECT_FALSE(ToWire(manifest, &wire_manifest));

  TopologyState topology = test::Sample<TopologyState>();
  topology.shrink.push_back(0);
  idl::TopologyState wire_topology;
  EXPECT_FALSE(ToWire(topology, &wire_topology));

  Health health = test::Sample<Health>();
  health.metrics.resize(kMaxMetrics + 1);
  idl::Health wire_health;
  EXPECT_FALSE(ToWire(health, &wire_health));
}

TEST(ConvertBounds, TextsForPeopleAreCutAtACharacter) {
  Health health = test::Sample<Health>();
  health.last_error = std::string(254, 'x') + "°C";  // the degree sign straddles the limit of 255 bytes
  Health got;
  ASSERT_TRUE(OverTheWire(health, &got));
  EXPECT_EQ(got.last_error, std::string(254, 'x'));
}

TEST(ConvertBytes, UnknownEnumeratorsReachTheGateAndStopThere) {
  idl::ToolState wire;
  ASSERT_TRUE(ToWire(test::Sample<ToolState>(), &wire));
  wire.tools()[0].kind(77);
  ToolState got;
  FromWire(wire, &got);
  EXPECT_FALSE(PassesGate(got));
}

TEST(ConvertBytes, TruncatedPayloadIsRefused) {
  idl::ToolStatePubSubType type;
  idl::ToolState sent, received;
  ASSERT_TRUE(ToWire(test::Sample<ToolState>(), &sent));
  Payload payload(type.m_typeSize);
  ASSERT_TRUE(type.serialize(&sent, &payload));
  payload.length /= 2;
  EXPECT_FALSE(type.deserialize(&payload, &received));
}

}  // namespace
}  // namespace fulcrum::bus
