#include "services/records/log_tools/merge.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <limits>
#include <map>
#include <memory>
#include <system_error>

#include "services/base/core/error.h"
#include "services/records/log_tools/copier.h"
#include "services/records/recording/time_order.h"

namespace fulcrum::log_tools {
namespace fs = std::filesystem;
namespace {

/// Larger recordings are not joined at the end of a session, which would take more than about ten seconds.
constexpr std::uintmax_t kLongestJoin_B = 200'000'000;

std::string ValueOf(const recording::McapReader& reader, const char* record, const char* key) {
  const auto found = reader.metadata().find(record);
  if (found == reader.metadata().end()) return {};
  const auto value = found->second.find(key);
  return value == found->second.end() ? std::string() : value->second;
}

/// One of the files, with its next message.
struct Segment {
  explicit Segment(const fs::path& path) : file(path), messages(path) { Step(); }
  void Step() {
    has_next = messages.Next(&next);
    if (has_next && first_ns == 0) first_ns = next.log_time_ns;
  }
  [[nodiscard]] const recording::McapReader& reader() const { return messages.reader(); }
  /// Log time on the clock of the first file: each recorder has its own offset to the wall clock.
  [[nodiscard]] std::uint64_t time_ns() const { return next.log_time_ns + static_cast<std::uint64_t>(shift_ns); }

  fs::path file;
  recording::TimeOrder messages;
  recording::McapMessage next{};
  bool has_next = false;
  std::int64_t shift_ns = 0;
  std::uint64_t first_ns = 0;  ///< On the file's own clock.
};

std::int64_t ClockOf(const Segment& source) {
  const std::string text = ValueOf(source.reader(), "clock", "log_time_minus_monotonic_ns");
  if (text.empty()) {
    throw InputError(source.file.string() + ": has no metadata \"clock\"; only recordings of a session can be merged");
  }
  return std::stoll(text);
}

void RefuseOther(const Segment& first, const Segment& other) {
  constexpr std::array<std::array<const char*, 2>, 3> kSame{
      {{"session", "id"}, {"session", "scene_hash"}, {"versions", "schema_hash"}}};
  for (const auto& [record, key] : kSame) {
    const std::string one = ValueOf(first.reader(), record, key), two = ValueOf(other.reader(), record, key);
    if (one == two && !one.empty()) continue;
    std::string message = other.file.string();
    message.append(": ").append(record).append(".").append(key).append(" is \"").append(two).append("\", that of ");
    message.append(first.file.string()).append(" is \"").append(one);
    throw InputError(message.append("\"; give files of one session, which have the same"));
  }
}

Segment* Earliest(std::vector<std::unique_ptr<Segment>>* sources) {
  Segment* earliest = nullptr;
  for (const auto& source : *sources) {
    if (source->has_next && (earliest == nullptr || source->time_ns() < earliest->time_ns())) earliest = source.get();
  }
  return earliest;
}

/// The last message of a writer, by which the next one is judged.
struct Newest {
  std::uint32_t sequence;
  const Segment* segment;
  std::uint64_t time_ns;
};

/// Where messages are missing between two files: what the recorder had not written when it was killed, and what was
/// sent until the next one read.
struct Break {
  std::uint64_t from_ns = std::numeric_limits<std::uint64_t>::max(), to_ns = 0, missing = 0;

  void Add(std::uint64_t gap, std::uint64_t before_ns, std::uint64_t after_ns) {
    from_ns = std::min(from_ns, before_ns);
    to_ns = std::max(to_ns, after_ns);
    missing += gap;
  }
  [[nodiscard]] std::string Text(std::uint64_t begin_ns) const {
    std::array<char, 160> text{};
    std::snprintf(text.data(), text.size(), "%llu messages are missing from %.3f to %.3f s",
                  static_cast<unsigned long long>(missing), 1e-9 * static_cast<double>(from_ns - begin_ns),
                  1e-9 * static_cast<double>(to_ns - begin_ns));
    return text.data();
  }
};

using Metadata = std::map<std::string, std::map<std::string, std::string>>;

/// That of the first file; losses are added up, and an end or a dump of any file is kept.
Metadata JoinedMetadata(const std::vector<std::unique_ptr<Segment>>& sources) {
  Metadata joined;
  for (const auto& source : sources) {
    for (const auto& [name, values] : source->reader().metadata()) {
      if (!name.starts_with("lost ")) {
        joined.try_emplace(name, values);
        continue;
      }
      for (const auto& [what, count] : values) {
        std::string& sum = joined[name][what];
        sum = std::to_string(std::stoull(count) + (sum.empty() ? 0 : std::stoull(sum)));
      }
    }
  }
  return joined;
}

/// In the order of their beginning.
std::vector<std::unique_ptr<Segment>> Open(const std::vector<fs::path>& files) {
  std::vector<std::unique_ptr<Segment>> sources;
  sources.reserve(files.size());
  for (const fs::path& file : files) sources.push_back(std::make_unique<Segment>(file));
  for (const auto& source : sources) RefuseOther(*sources.front(), *source);
  const auto begin_ns = [](const auto& source) {
    return static_cast<std::int64_t>(source->first_ns) - ClockOf(*source);
  };
  std::ranges::stable_sort(sources, {}, begin_ns);
  for (const auto& source : sources) {
    source->shift_ns = ClockOf(*sources.front()) - ClockOf(*source);
  }
  return sources;
}

std::string SessionOf(const fs::path& file) {
  recording::McapReader reader(file);
  recording::McapMessage message;
  (void)reader.Next(&message);
  return ValueOf(reader, "session", "id");
}

}  // namespace

MergeResult Merge(const std::vector<fs::path>& files, const fs::path& out) {
  if (fs::exists(out)) throw InputError(out.string() + ": exists; choose another name");
  std::vector<std::unique_ptr<Segment>> sources = Open(files);
  MergeResult result;
  recording::McapWriter writer(out, sources.front()->reader().profile(), sources.front()->reader().library());
  Copier copier(&writer);
  std::map<std::uint16_t, Newest> newest;  // By channel of the copy.
  std::map<const Segment*, Break> breaks;  // By the file after it.
  std::uint64_t missing = 0;
  while (Segment* segment = Earliest(&sources)) {
    const recording::McapMessage& message = segment->next;
    const Newest now{message.sequence, segment, segment->time_ns()};
    const auto [before, is_first] = newest.try_emplace(copier.ChannelOf(segment->reader(), message.channel), now);
    // Modulo 2^32. Not positive: a recorder that has just begun receives again what late joiners get.
    const auto step = static_cast<std::int32_t>(now.sequence - before->second.sequence);
    if (is_first || step > 0) {
      copier.Copy(segment->reader(), message, segment->shift_ns);
      ++result.messages;
      const std::uint64_t gap = is_first ? 0 : static_cast<std::uint64_t>(step) - 1;
      missing += gap;
      if (gap > 0 && before->second.segment != segment) {
        breaks[segment].Add(gap, before->second.time_ns, now.time_ns);
      }
      before->second = now;
    }
    segment->Step();
  }
  copier.Finish();
  for (const auto& [name, values] : JoinedMetadata(sources)) writer.AddMetadata(name, values);
  std::string names, spans;
  for (const auto& source : sources) names += (names.empty() ? "" : " ") + source->file.filename().string();
  for (const auto& source : sources) {
    const auto at = breaks.find(source.get());
    if (at == breaks.end()) continue;
    result.notes.push_back(at->second.Text(sources.front()->first_ns));
    spans += (spans.empty() ? "" : "; ") + result.notes.back();
  }
  writer.AddMetadata("merged", {{"files", names}, {"breaks", spans}, {"missing", std::to_string(missing)}});
  writer.Close();
  if (!writer.error().empty()) {
    std::error_code ignored;
    fs::remove(out, ignored);
    throw InputError(out.string() + ": " + writer.error());
  }
  for (const auto& source : sources) {
    for (const recording::McapFault& fault : source->reader().faults()) {
      result.notes.push_back(source->file.string() + ": at byte " + std::to_string(fault.offset) + ": " + fault.what);
    }
    if (!source->reader().closed()) result.notes.push_back(source->file.string() + ": its recorder did not close it");
  }
  return result;
}

JoinResult JoinSegments(const fs::path& recording, std::uint64_t keep_free_B) {
  std::error_code none;
  if (!fs::exists(recording, none)) return {};
  std::vector<fs::path> files{recording};
  const auto name_of = [&recording](std::size_t number) {
    fs::path file = recording;
    file.replace_filename(recording.stem().string() + "-" + std::to_string(number) + recording.extension().string());
    return file;
  };
  // Files of earlier sessions may have such names too; what is no recording belongs to none.
  const auto session_of = [](const fs::path& file) {
    try {
      return SessionOf(file);
    } catch (const InputError&) {
      return std::string();
    }
  };
  const std::string session = session_of(recording);
  for (std::size_t number = 2; fs::exists(name_of(number), none); ++number) {
    if (session_of(name_of(number)) == session) files.push_back(name_of(number));
  }
  if (files.size() == 1) return {};
  const std::string kept = std::to_string(files.size()) + " files of the recording were not joined: ";
  const std::string how = "; join them with fulcrum log merge";
  std::uintmax_t size_B = 0;
  for (const fs::path& file : files) size_B += fs::file_size(file, none);
  if (size_B > kLongestJoin_B) return {kept + "they are large" + how, false};
  const fs::space_info space = fs::space(fs::absolute(recording).parent_path(), none);
  if (none || space.available < size_B + keep_free_B) return {kept + "the disk has too little room" + how, false};
  fs::path joined = recording;
  joined += ".joining";
  try {
    fs::remove(joined, none);
    const MergeResult result = Merge(files, joined);
    fs::rename(joined, recording);
    for (std::size_t i = 1; i < files.size(); ++i) fs::remove(files[i], none);
    std::string text = std::to_string(files.size()) + " files of the recording were joined";
    for (const std::string& note : result.notes) text += "; " + note;
    return {text};
  } catch (const std::exception& error) {
    fs::remove(joined, none);
    return {kept + error.what(), false};
  }
}

}  // namespace fulcrum::log_tools
