// Conversion of messages to wire bytes and back.
#include "services/transport/bus/convert/convert.h"

#include <gtest/gtest.h>

#include <limits>
#include <regex>
#include <set>
#include <string>
#include <vector>

#include "services/base/core/message_fields.h"
#include "services/transport/bus/convert/generated_types.h"
#include "services/transport/bus/gate.h"
#include "services/transport/bus/schema.h"
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
  std::vector<std::uint64_t> memory(sizeof(WireOf<T>) / 8 + 2);
  std::byte* loan = reinterpret_cast<std::byte*>(memory.data()) + 4;
  return ToLoan(from, loan) && FromLoan(loan, to);
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
  // 64 KB is the largest datagram; only TopologyState may be sent in fragments, only loans may be larger.
  if constexpr (!Loanable<TypeParam> && !std::is_same_v<TypeParam, TopologyState>) {
    EXPECT_LT(type.m_typeSize, 60'000u);
  }
}

TEST(ConvertLoan, LargeTypesArePlain) {
  idl::TissueFramePubSubType frame;
  EXPECT_TRUE(frame.is_plain());
  EXPECT_EQ(frame.m_typeSize, sizeof(idl::TissueFrame) + 4);
  idl::TemperaturePatchPubSubType patch;
  EXPECT_TRUE(patch.is_plain());
  EXPECT_EQ(patch.m_typeSize, sizeof(idl::TemperaturePatch) + 4);
  idl::PicturePubSubType picture;
  EXPECT_TRUE(picture.is_plain());
  EXPECT_EQ(picture.m_typeSize, sizeof(idl::Picture) + 4);
}

TEST(ConvertLoan, LoanHasTheLayoutOfTheGeneratedType) {
  const auto frame = test::Sample<TissueFrame>();
  auto wire = std::make_unique<idl::TissueFrame>();
  ASSERT_TRUE(ToLoan(frame, reinterpret_cast<std::byte*>(wire.get())));
  EXPECT_EQ(wire->header().vertex_count(), frame.header.vertex_count);
  EXPECT_EQ(wire->header().scene_hash(), frame.header.scene_hash);
  EXPECT_EQ(wire->xyz()[4711], frame.xyz[4711]);

  const auto patch = test::Sample<TemperaturePatch>();
  auto wire_patch = std::make_unique<idl::TemperaturePatch>();
  ASSERT_TRUE(ToLoan(patch, reinterpret_cast<std::byte*>(wire_patch.get())));
  EXPECT_EQ(wire_patch->header().origin_y(), patch.header.origin_y);
  EXPECT_EQ(wire_patch->texels()[4711], patch.texels[4711]);

  const auto picture = test::Sample<Picture>();
  auto wire_picture = std::make_unique<idl::Picture>();
  ASSERT_TRUE(ToLoan(picture, reinterpret_cast<std::byte*>(wire_picture.get())));
  EXPECT_EQ(wire_picture->header().scale(), picture.header.scale);
  EXPECT_EQ(wire_picture->jpeg()[4], picture.jpeg[4]);
}

TEST(ConvertLoan, CountBeyondTheArrayIsRefusedBothWays) {
  std::vector<std::uint64_t> memory(sizeof(idl::TissueFrame) / 8 + 1);
  auto* loan = reinterpret_cast<std::byte*>(memory.data());
  TissueFrame frame = test::Sample<TissueFrame>();
  ASSERT_TRUE(ToLoan(frame, loan));
  frame.header.vertex_count = kMaxTissueVertices + 1;
  EXPECT_FALSE(CloseLoan(frame.header, loan));
  EXPECT_FALSE(ToLoan(frame, loan));
  reinterpret_cast<idl::TissueFrame*>(loan)->header().vertex_count(0xffffffffu);
  TissueFrame got;
  EXPECT_FALSE(FromLoan(loan, &got));
}

TEST(ConvertLoan, NaNInTheLoanIsRefusedAtTheGate) {
  std::vector<std::uint64_t> memory(sizeof(idl::TissueFrame) / 8 + 1);
  auto* loan = reinterpret_cast<std::byte*>(memory.data());
  TissueFrameHeader header;
  TissueFrame::View view = OpenLoan(loan, &header);
  view.header.vertex_count = 2;
  view.xyz[5] = std::numeric_limits<float>::quiet_NaN();
  ASSERT_TRUE(CloseLoan(header, loan));
  TissueFrame got;
  ASSERT_TRUE(FromLoan(loan, &got));
  EXPECT_FALSE(PassesGate(got));
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
