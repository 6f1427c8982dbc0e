#include "services/apps/replayer/published_difference.h"

#include <algorithm>
#include <optional>
#include <span>
#include <type_traits>

#include "services/base/core/message_difference.h"
#include "services/records/recording/mcap_reader.h"
#include "services/transport/bus/convert/cdr.h"
#include "services/transport/bus/topics.h"

namespace fulcrum::replay {
namespace {

/// Difference in one topic; `bytes` is the recorded message.
template <class T>
std::optional<std::string> Compare(std::span<const std::uint8_t> bytes, std::uint64_t epoch, std::int64_t stamp_ns,
                                   const std::vector<Published>& now) {
  T recorded;
  if (!bus::DecodeCdr(bytes, &recorded)) return std::nullopt;
  const Stamp& stamp = bus::StampOf(recorded);
  if (stamp.epoch != epoch || stamp.stamp_ns != stamp_ns) return std::nullopt;
  T replayed;
  const auto found = std::find_if(now.begin(), now.end(), [&](const Published& p) {
    if (p.topic != bus::kTopicOf<T>) return false;
    if constexpr (std::is_same_v<T, ToolState>) {
      // A tick may publish the sample of the one before, too.
      return bus::DecodeCdr(p.bytes, &replayed) && replayed.stamp.stamp_ns == stamp_ns;
    }
    return true;
  });
  const std::string label(bus::TopicLabel(bus::kTopicOf<T>));
  if (found == now.end()) return label + " is recorded, but the replay does not publish it";
  if (!bus::DecodeCdr(found->bytes, &replayed)) return std::nullopt;
  // Sequence numbers begin with the first reader, which a replay has from the start.
  const auto difference = FirstDifference(recorded, replayed, "stamp");
  if (!difference) return std::nullopt;
  return label + "." + difference->field + ": recorded " + difference->first + ", replayed " + difference->second;
}

}  // namespace

std::string DescribeDifference(const std::filesystem::path& recording, std::uint64_t epoch, std::int64_t stamp_ns,
                               const std::vector<Published>& now) {
  recording::McapReader reader(recording);
  recording::McapMessage message{};
  while (reader.Next(&message)) {
    const recording::McapChannel& channel = reader.channels().at(message.channel);
    const bus::TopicRole* role = bus::RoleNamed(channel.topic);
    // Topics without a single owner, such as Health, describe the process and are no result.
    if (role == nullptr || !role->one_owner()) continue;
    const auto found = bus::WithMessageOf(
        role->id, [&]<class T>(std::type_identity<T>) { return Compare<T>(message.data, epoch, stamp_ns, now); });
    if (found) return *found;
  }
  return "no published message of this tick differs, so the difference is in the internal state";
}

}  // namespace fulcrum::replay
