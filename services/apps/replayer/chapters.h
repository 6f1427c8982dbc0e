// What a viewer of a session looks for: when the generator was used, and when heat came near a ureter or a nerve.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "services/base/core/messages.h"

namespace fulcrum::replay {

struct Chapter {
  double begin_s = 0;  ///< Session time [s].
  std::string title;
};

class Chapters {
 public:
  /// Call after each message of a session, in the order of time, with the newest message of each topic.
  void Follow(double time_s, const HandleState& handles, const GeneratorSetting& generator, const ThermalEvent& event);

  /// In the order of time. The first, "start", begins at 0.
  [[nodiscard]] const std::vector<Chapter>& list() const { return list_; }

 private:
  /// Begins a chapter, unless the last one of this title went on until shortly before.
  void Note(double time_s, const std::string& title);

  std::vector<Chapter> list_{{0, "start"}};
  std::map<std::string, double> last_s_;  ///< When each title was noted last [s].
  std::uint64_t event_sequence_ = 0, event_epoch_ = 0;
};

}  // namespace fulcrum::replay
