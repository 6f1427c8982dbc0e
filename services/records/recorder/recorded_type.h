// Types of the messages in a file: those of the bus, but for TissueFrame.
#pragma once

#include <string>

#include "services/base/core/messages.h"
#include "services/records/recording/point_coding.h"

namespace fulcrum::recorder {

struct RecordedType {
  std::string name;  ///< Without module.
  std::string idl;   ///< With all types that it uses.
};
[[nodiscard]] RecordedType RecordedTypeOf(TopicId topic);

[[nodiscard]] recording::PointCoding TissueCoding();

}  // namespace fulcrum::recorder
