// Comparison of the recorded and the replayed messages of a tick.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "services/apps/replayer/replayed_node.h"

namespace fulcrum::replay {

/// Reads from the recording the messages that the process of that epoch published in the tick of that stamp, and
/// returns the first field in which `now` differs: topic, field, index, both values.
[[nodiscard]] std::string DescribeDifference(const std::filesystem::path& recording, std::uint64_t epoch,
                                             std::int64_t stamp_ns, const std::vector<Published>& now);

}  // namespace fulcrum::replay
