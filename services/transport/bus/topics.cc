#include "services/transport/bus/topics.h"

#include <algorithm>

namespace fulcrum::bus {
namespace {

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
