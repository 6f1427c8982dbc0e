#include <algorithm>
#include <ostream>

#include "services/records/log_tools/sequence_gaps.h"
#include "services/records/log_tools/tools.h"
#include "services/records/recording/mcap_index.h"
#include "services/transport/bus/gate.h"

namespace fulcrum::log_tools {
namespace {

struct Tally {
  std::uint64_t undecoded = 0, refused = 0, lost = 0;
};

}  // namespace

ExitCode Verify(const std::filesystem::path& file, std::ostream* out) {
  Recording recording(file);
  std::map<std::string, Tally> tallies;
  SequenceGaps gaps;
  std::uint64_t messages = 0, problems = 0, newest_ns = 0, late = 0;
  const auto problem = [&](const std::string& what) {
    *out << "! " << what << '\n';
    ++problems;
  };
  Entry entry;
  while (recording.Next(&entry)) {
    ++messages;
    late += entry.message.log_time_ns < newest_ns ? 1 : 0;
    newest_ns = std::max(newest_ns, entry.message.log_time_ns);
    Tally& tally = tallies[entry.source->name];
    tally.lost += gaps.Before(entry.message);
    bool passes = false;
    const bool decoded =
        entry.source->topic && WithDecoded(*entry.source->topic, entry.message.data,
                                           [&](const auto& message) { passes = bus::PassesGate(message); });
    tally.undecoded += decoded ? 0 : 1;
    tally.refused += decoded && !passes ? 1 : 0;
  }
  for (const recording::McapFault& fault : recording.reader().faults()) {
    problem("at byte " + std::to_string(fault.offset) + ": " + fault.what);
  }
  std::uint64_t indexed = 0;
  for (const std::string& what : recording::CheckIndex(file, &indexed)) problem(what);
  if (recording.reader().closed() && indexed != messages) {
    problem("the indexes refer to " + std::to_string(indexed) + " messages, the chunks contain " +
            std::to_string(messages));
  }
  if (late > 0) {
    problem(std::to_string(late) +
            " messages were written so late that they are read after later ones: pictures and "
            "maps of that time mix states");
  }
  for (const auto& known : tallies) {
    const std::string& topic = known.first;
    const Tally& tally = known.second;
    const auto tell = [&](std::uint64_t count, const char* what) {
      if (count > 0) problem(topic + ": " + std::to_string(count) + what);
    };
    tell(tally.undecoded, " messages cannot be decoded");
    tell(tally.refused, " messages do not pass the gate: no node would have used them");
    tell(tally.lost, " messages are missing in the sequence of their writer");
  }
  *out << file.string() << ": " << messages << " messages, "
       << (problems == 0 ? "all well" : std::to_string(problems) + " problems") << '\n';
  return problems == 0 ? ExitCode::kDone : ExitCode::kFailure;
}

}  // namespace fulcrum::log_tools
