// Any bytes as the CDR of a topic, which the first byte selects: refused, or decoded to a message that, if it passes
// the gate, is encoded and decoded again unchanged. Topics that are sent as their memory are padded with zeros;
// otherwise inputs would have to be hundreds of kilobytes long.
#include "services/base/core/message_difference.h"
#include "services/transport/bus/convert/cdr.h"
#include "services/transport/bus/gate.h"
#include "services/transport/bus/topics.h"
#include "tests/fuzz/target.h"
#include "tests/unit/bus/samples.h"

namespace fulcrum::fuzz {
namespace {

template <class T>
constexpr bool kAsMemory = requires {
  typename T::View;
};

/// A sample with short lists: long ones make effective mutations rare.
template <class T>
T ShortSample() {
  T message = bus::test::Sample<T>();
  if constexpr (std::is_same_v<T, TopologyState>) {
    message.rows = 8;
    message.cols = 8;
    message.dead_nodes.resize(8);
    message.dead_edges.resize(24);
    message.shrink.resize(192);
  } else if constexpr (std::is_same_v<T, TearState>) {
    message.rows = 8;
    message.cols = 8;
    message.torn_edges.resize(24);
  } else if constexpr (std::is_same_v<T, TissueFrame>) {
    message.header.vertex_count = 20;
    message.xyz.resize(60);
  }
  return message;
}

template <class T>
Outcome OfferAs(Input cdr) {
  Bytes filled(cdr.begin(), cdr.end());
  if constexpr (kAsMemory<T>) {
    static const std::size_t whole = [] {
      Bytes bytes;
      (void)bus::EncodeCdr(bus::test::Sample<T>(), &bytes);
      return bytes.size();
    }();
    filled.resize(whole);
  }
  T message, again;
  if (!bus::DecodeCdr(filled, &message) || !bus::PassesGate(message)) return Outcome::kRefused;
  Bytes bytes;
  Promise(bus::EncodeCdr(message, &bytes), "a message that was read cannot be sent");
  Promise(bus::DecodeCdr(bytes, &again), "a message that was sent cannot be read");
  const auto difference = FirstDifference(message, again);
  Promise(!difference, "another message was read than was sent");
  return Outcome::kAccepted;
}

class Cdr final : public Target {
 public:
  Outcome Offer(Input input) override {
    if (input.empty()) return Outcome::kRefused;
    return bus::WithMessageOf(static_cast<TopicId>(input[0] % kTopicCount),
                              [&]<class T>(std::type_identity<T>) { return OfferAs<T>(input.subspan(1)); });
  }
  std::vector<Seed> Seeds() override {
    std::vector<Seed> seeds;
    for (const bus::TopicRole& role : bus::kTopicRoles) {
      bus::WithMessageOf(role.id, [&]<class T>(std::type_identity<T>) {
        Bytes cdr;
        (void)bus::EncodeCdr(ShortSample<T>(), &cdr);
        constexpr std::size_t kMost_B = 2000;
        if (kAsMemory<T>) cdr.resize(std::min(cdr.size(), kMost_B));
        cdr.insert(cdr.begin(), static_cast<std::uint8_t>(role.id));
        seeds.push_back({std::string(bus::TopicLabel(role.id)), std::move(cdr)});
      });
    }
    return seeds;
  }
};

}  // namespace

std::unique_ptr<Target> MakeCdr() { return std::make_unique<Cdr>(); }

}  // namespace fulcrum::fuzz
