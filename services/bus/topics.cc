#include "services/bus/topics.h"

#include <algorithm>

namespace fulcrum::bus {
namespace {

constexpr bool TableIsInOrder() {
  for (std::size_t i = 0; i < kTopicRoles.size(); ++i) {
    if (static_cast<std::size_t>(kTopicRoles[i].id) != i) return false;
  }
  return true;
}
static_assert(TableIsInOrder(), "kTopicRoles is indexed by TopicId");

constexpr std::string_view kPrefix = "fulcrum/";

}  // namespace

const TopicRole* RoleNamed(std::string_view name) {
  const auto* role = std::find_if(kTopicRoles.begin(), kTopicRoles.end(),
                                  [name](const TopicRole& known) { return name == known.name; });
  return role == kTopicRoles.end() ? nullptr : role;
}

std::string_view TopicLabel(TopicId id) {
  if (static_cast<int>(id) >= kTopicCount) return "unknown";
  return std::string_view(RoleOf(id).name).substr(kPrefix.size());
}

}  // namespace fulcrum::bus
