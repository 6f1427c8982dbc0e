#include <algorithm>
#include <optional>
#include <ostream>
#include <tuple>

#include "services/base/core/error.h"
#include "services/base/core/hash.h"
#include "services/base/core/message_difference.h"
#include "services/records/log_tools/tools.h"

namespace fulcrum::log_tools {
namespace {

/// Hash of the bits of a message in the order of its fields, without the fields of this name at any depth.
template <class T>
void AddTo(Hash64* hash, const T& value, std::string_view without) {
  if constexpr (HasFields<T>) {
    ForEachField<T>([&](const char* name, auto member) {
      if (without.empty() || without != name) AddTo(hash, value.*member, without);
    });
  } else if constexpr (std::is_arithmetic_v<T>) {
    hash->AddValue(value);
  } else if constexpr (std::is_enum_v<T>) {
    hash->AddValue(static_cast<std::underlying_type_t<T>>(value));
  } else if constexpr (std::is_same_v<T, std::string>) {
    hash->Add(std::string_view(value));
  } else if constexpr (std::is_same_v<T, Quatf>) {
    AddTo(hash, value.coeffs(), without);
  } else {
    hash->AddValue(static_cast<std::uint64_t>(value.size()));
    for (Eigen::Index i = 0; i < static_cast<Eigen::Index>(value.size()); ++i) AddTo(hash, value[i], without);
  }
}

/// One topic of one node in one process: the n-th process, since a restarted node numbers its samples again from 1.
struct Stream {
  std::string topic, node;
  int process = 1;
  auto operator<=>(const Stream&) const = default;  // NOLINT(modernize-use-nullptr): a check older than the operator
};

std::ostream& operator<<(std::ostream& out, const Stream& stream) {
  out << stream.topic << " of " << (stream.node.empty() ? "?" : stream.node);
  return stream.process == 1 ? out : out << " (start " << stream.process << ")";
}

/// Reads a file and passes on each message with its stream. Messages of unknown topics are skipped.
template <class Use>
void ForEachMessage(const std::filesystem::path& file, const Filter& filter, const Use& use) {
  Recording recording(file, filter);
  std::map<std::pair<std::string, std::string>, int> processes;
  std::map<std::uint16_t, Stream> streams;
  Entry entry;
  while (recording.Next(&entry)) {
    if (!entry.source->topic) continue;
    auto stream = streams.find(entry.message.channel);
    if (stream == streams.end()) {
      const Source& source = *entry.source;
      stream =
          streams
              .emplace(entry.message.channel, Stream{source.name, source.node, ++processes[{source.name, source.node}]})
              .first;
    }
    use(stream->second, entry);
  }
}

/// Hash of each message, by stream and sequence: recordings can be larger than memory.
using Digest = std::map<Stream, std::map<std::uint32_t, std::uint64_t>>;

Digest MakeDigest(const std::filesystem::path& file, const Filter& filter, const std::string& without) {
  Digest digest;
  ForEachMessage(file, filter, [&](const Stream& stream, const Entry& entry) {
    Hash64 hash;
    const bool decoded = WithDecoded(*entry.source->topic, entry.message.data,
                                     [&](const auto& message) { AddTo(&hash, message, without); });
    if (!decoded) hash.Add(std::as_bytes(entry.message.data));
    digest[stream].try_emplace(entry.message.sequence, hash.value());
  });
  return digest;
}

/// None: it cannot be decoded.
template <class T>
std::optional<T> Fetch(const std::filesystem::path& file, const Filter& filter, const Stream& wanted,
                       std::uint32_t sequence) {
  T message;
  bool decoded = false;
  ForEachMessage(file, filter, [&](const Stream& stream, const Entry& entry) {
    if (stream == wanted && entry.message.sequence == sequence) decoded = bus::DecodeCdr(entry.message.data, &message);
  });
  return decoded ? std::optional(std::move(message)) : std::nullopt;
}

/// "" unless there are such messages.
std::string UndecodedText(const char* which, bool undecoded, const std::filesystem::path& file) {
  if (!undecoded) return {};
  recording::McapReader reader(file, recording::McapReader::Depth::kChunkHeads);
  for (recording::McapMessage none{}; reader.Next(&none);) {
  }
  return std::string(", in the ") + which + " it cannot be decoded (" + SchemasText(reader) + ")";
}

struct Count {
  std::uint64_t common = 0, only_first = 0, only_second = 0, different = 0;
  std::optional<std::uint32_t> first_different;
};

Count Compare(const std::map<std::uint32_t, std::uint64_t>& first,
              const std::map<std::uint32_t, std::uint64_t>& second) {
  Count count;
  for (const auto& [sequence, hash] : first) {
    const auto other = second.find(sequence);
    if (other == second.end()) {
      ++count.only_first;
      continue;
    }
    ++count.common;
    if (hash == other->second) continue;
    ++count.different;
    if (!count.first_different) count.first_different = sequence;
  }
  count.only_second = second.size() - count.common;
  return count;
}

bool HasNode(const Digest& digest, const std::string& node) {
  return std::ranges::any_of(digest, [&](const auto& known) { return known.first.node == node; });
}

/// Streams of `other` that `own` lacks, although the same node has sent others there. A node that is not in `own` at
/// all was not part of that session.
bool LacksStream(const Digest& own, const Digest& other) {
  return std::ranges::any_of(
      other, [&](const auto& known) { return !own.contains(known.first) && HasNode(own, known.first.node); });
}

}  // namespace

ExitCode Diff(const std::filesystem::path& first, const std::filesystem::path& second, const Filter& filter,
              const std::string& without, std::ostream* out) {
  CheckTopics(filter);
  const Digest a = MakeDigest(first, filter, without);
  Digest b = MakeDigest(second, filter, without);
  bool same = !LacksStream(a, b) && !LacksStream(b, a);
  std::uint64_t compared = 0;
  for (const auto& known : a) {
    const Stream& stream = known.first;
    const Count count = Compare(known.second, b[stream]);
    compared += count.common;
    *out << stream << ": " << count.common << " in both, " << count.different << " different, " << count.only_first
         << " only in the first, " << count.only_second << " only in the second\n";
    b.erase(stream);
    if (!count.first_different) continue;
    same = false;
    Filter only = filter;
    only.topics = {stream.topic};
    for (const bus::TopicRole& role : bus::kTopicRoles) {
      if (bus::TopicLabel(role.id) != stream.topic) continue;
      bus::WithMessageOf(role.id, [&]<class T>(std::type_identity<T>) {
        const std::optional<T> one = Fetch<T>(first, only, stream, *count.first_different);
        const std::optional<T> two = Fetch<T>(second, only, stream, *count.first_different);
        if (!one || !two) {
          *out << "  first at sequence " << *count.first_different << UndecodedText("first", !one, first)
               << UndecodedText("second", !two, second) << '\n';
          return;
        }
        const auto difference = FirstDifference(*one, *two, without);
        if (!difference) return;
        *out << "  first at sequence " << *count.first_different << ": " << difference->field << " = "
             << difference->first << " | " << difference->second << '\n';
      });
    }
  }
  for (const auto& [stream, samples] : b) *out << stream << ": only in the second, " << samples.size() << '\n';
  if (compared == 0) {
    throw InputError(
        "nothing to compare: " + first.string() + " and " + second.string() +
        " have no message of the same topic, node and sequence; give other times or topics, or two recordings "
        "of the same session or script");
  }
  *out << (same ? "no difference in the messages of both\n" : "");
  return same ? ExitCode::kDone : ExitCode::kFailure;
}

}  // namespace fulcrum::log_tools
