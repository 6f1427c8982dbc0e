#include "services/records/recorder/recorder.h"

#include <time.h>

#include <algorithm>
#include <cstring>
#include <span>

#include "services/base/core/error.h"
#include "services/base/runtime/cyclic_thread.h"
#include "services/base/runtime/realtime.h"
#include "services/records/recorder/priorities.h"
#include "services/records/recorder/recorded_type.h"
#include "services/transport/bus/topics.h"

namespace fulcrum::recorder {
namespace {

constexpr std::string_view kProfile = "fulcrum";
/// More than a chunk takes in the summary of a file [B].
constexpr std::uint64_t kPerChunk_B = 1000;

std::int64_t WallMinusMonotonic() {
  timespec wall{};
  ::clock_gettime(CLOCK_REALTIME, &wall);
  return std::int64_t{1'000'000'000} * wall.tv_sec + wall.tv_nsec - runtime::MonotonicNs();
}

std::string Hex(const bus::WriterGuid& guid) {
  constexpr const char* kDigits = "0123456789abcdef";
  std::string text;
  for (const std::uint8_t byte : guid) {
    text += kDigits[byte >> 4];
    text += kDigits[byte & 15];
  }
  return text;
}

}  // namespace

Recorder::Recorder(const RecorderSettings& settings)
    : settings_(settings), wall_minus_monotonic_ns_(WallMinusMonotonic()) {
  for (Batch* batch : {&filling_, &writing_}) {
    batch->large.bytes = std::make_unique_for_overwrite<std::uint8_t[]>(settings.large_queue_B);
    batch->small.bytes = std::make_unique_for_overwrite<std::uint8_t[]>(settings.small_queue_B);
  }
  if (settings.file.empty()) return;
  file_.emplace(settings.file, kProfile, settings.library);
  room_.emplace(settings.file, settings.keep_free_B);
  Introduce(&*file_);
}

Recorder::~Recorder() { Close(runtime::MonotonicNs()); }

void Recorder::Introduce(recording::McapWriter* file) const {
  for (const auto& [name, values] : settings_.metadata) file->AddMetadata(name, values);
  // Log times are CLOCK_MONOTONIC, like all stamps of the topics, shifted by one offset to the wall clock.
  file->AddMetadata("clock", {{"log_time_minus_monotonic_ns", std::to_string(wall_minus_monotonic_ns_)}});
}

void Recorder::Receive(const bus::RawSample& sample) {
  const std::size_t size = sample.head.size() + sample.body.size();
  const std::lock_guard lock(mutex_);
  Counts& counts = counts_[static_cast<std::size_t>(sample.topic)];
  auto writer = std::find_if(writers_.begin(), writers_.end(), [&](const Writer& known) {
    return known.topic == sample.topic && known.guid == sample.writer;
  });
  if (writer == writers_.end()) {
    // Samples that were sent before the first received one are not losses.
    writer = writers_.insert(writers_.end(), {sample.topic, sample.writer, sample.sequence - 1, sample.written_ns});
  }
  if (sample.sequence <= writer->last_sequence) return;
  // Readers sort by this time: samples of one writer stay in order even if a clock was set in between.
  const std::int64_t written_ns = std::max(sample.written_ns, writer->last_ns);
  const std::uint64_t gap = sample.sequence - writer->last_sequence - 1;
  std::uint8_t* at =
      ended_.empty() || settings_.keep_s > 0 ? PlaceFor(sample.topic, recording::kMessageHead + size) : nullptr;
  if (at != nullptr) {
    recording::PutMessageHead(static_cast<std::uint16_t>(writer - writers_.begin()),
                              static_cast<std::uint32_t>(sample.sequence),
                              static_cast<std::uint64_t>(written_ns + wall_minus_monotonic_ns_),
                              static_cast<std::uint64_t>(sample.source_ns), size, at);
    at += recording::kMessageHead;
    std::memcpy(at, sample.head.data(), sample.head.size());
    if (!sample.body.empty()) std::memcpy(at + sample.head.size(), sample.body.data(), sample.body.size());
    if (filling_.used() == 0) filling_.Begin(written_ns);
    filling_.CutIfDue(written_ns);
    (IsLarge(sample.topic) ? filling_.large : filling_.small).used += recording::kMessageHead + size;
  }
  writer->last_sequence = sample.sequence;
  writer->last_ns = written_ns;
  counts.newest_ns = written_ns;
  if (!ended_.empty()) {
    counts.not_recorded += gap + 1;
    return;
  }
  counts.missed += gap;
  ++(at != nullptr ? counts.received : counts.overflow);
}

std::uint8_t* Recorder::PlaceFor(TopicId topic, std::size_t record_B) {
  const bool is_large = IsLarge(topic);
  const std::size_t queue_B = is_large ? settings_.large_queue_B : settings_.small_queue_B;
  const Batch::Part& part = is_large ? filling_.large : filling_.small;
  const std::size_t filled_B = part.used + record_B;
  if (filled_B > (IsDroppedFirst(topic) && !is_large ? queue_B / 2 : queue_B)) return nullptr;
  most_used_ = std::max(most_used_, static_cast<double>(filled_B) / static_cast<double>(queue_B));
  return part.bytes.get() + part.used;
}

void Recorder::AddNewChannels() {
  const std::size_t first = channels_.size();
  {
    const std::lock_guard lock(mutex_);
    for (std::size_t i = first; i < writers_.size(); ++i) {
      channels_.push_back({writers_[i].topic, writers_[i].guid, {}});
    }
  }
  for (std::size_t i = first; i < channels_.size(); ++i) {
    Channel& channel = channels_[i];
    if (settings_.describe) channel.about = settings_.describe(channel.writer);
    channel.about["writer"] = Hex(channel.writer);
    if (channel.topic != TopicId::kTissueFrame) continue;
    const recording::PointCoding coding = TissueCoding();
    recording::PutPointCoding(coding, &channel.about);
    packer_.Code(static_cast<std::uint16_t>(i), coding);
  }
  if (file_) AddChannels(&*file_, first, &schemas_);
}

void Recorder::AddChannels(recording::McapWriter* file, std::size_t first,
                           std::array<std::uint16_t, kTopicCount>* schemas) const {
  for (std::size_t i = first; i < channels_.size(); ++i) {
    const TopicId topic = channels_[i].topic;
    const RecordedType type = RecordedTypeOf(topic);
    std::uint16_t& schema = (*schemas)[static_cast<std::size_t>(topic)];
    if (schema == 0) schema = file->AddSchema("fulcrum::idl::" + type.name, "omgidl", type.idl);
    file->AddChannel(schema, bus::RoleOf(topic).name, "cdr", channels_[i].about);
  }
}

void Recorder::Flush(std::int64_t now_ns) {
  const std::string end = file_ ? ReasonToEnd(now_ns) : std::string();
  Exchange(now_ns, !end.empty(), end);
  if (!file_ || (end.empty() && file_->error().empty())) return;
  FinishFile();
  runtime::Log(runtime::LogLevel::kError, ended_);
}

std::string Recorder::ReasonToEnd(std::int64_t now_ns) {
  room_->Look(*file_, now_ns);
  const std::lock_guard lock(mutex_);
  left_s_ = room_->left_s();
  if (room_->Holds(filling_.used())) return {};
  return "the recording has ended, its file is complete: " + room_->Reason();
}

void Recorder::Exchange(std::int64_t now_ns, bool all, const std::string& end) {
  {
    const std::lock_guard lock(mutex_);
    ended_ = ended_.empty() ? end : ended_;
    const bool due = filling_.small.used >= recording::ChunkPacker::kChunkBytes ||
                     filling_.large.used >= recording::ChunkPacker::kLargeChunkBytes ||
                     now_ns - filling_.begin_ns >= kLongestChunk_ns;
    if (filling_.used() == 0 || !(due || all)) return;
    std::swap(filling_, writing_);
  }
  AddNewChannels();
  PackBatch(now_ns);
}

void Recorder::PackBatch(std::int64_t now_ns) {
  // A short rest belongs to the piece before it, so that a batch of usual age is one piece.
  std::vector<Batch::Cut>& cuts = writing_.cuts;
  if (!cuts.empty() && now_ns - writing_.cut_ns < kLongestChunk_ns / 2) cuts.pop_back();
  cuts.push_back({writing_.large.used, writing_.small.used});
  Batch::Cut from;
  for (const Batch::Cut& to : cuts) {
    Pack({writing_.large.bytes.get() + from.large, to.large - from.large}, recording::ChunkPacker::kLargeChunkBytes);
    Pack({writing_.small.bytes.get() + from.small, to.small - from.small}, recording::ChunkPacker::kChunkBytes);
    from = to;
  }
  cuts.clear();
  writing_.large.used = writing_.small.used = 0;
}

void Recorder::Pack(std::span<const std::uint8_t> records, std::size_t chunk_B) {
  while (!records.empty()) {
    // A remainder of up to twice the size of a chunk is one chunk, so that no small one is left.
    records =
        records.subspan(packer_.Pack(records, records.size() <= 2 * chunk_B ? records.size() : chunk_B, &packed_));
    if (file_) Write();
    if (settings_.keep_s > 0) Keep();
  }
}

void Recorder::Write() {
  file_->Append(packed_);
  const std::lock_guard lock(mutex_);
  file_B_ = file_->bytes_written();
  if (file_->error().empty()) return;
  ended_ = file_->error() + ": the recording has ended; free space, or record elsewhere (--record-to)";
  for (const recording::PackedChunk::Part& part : packed_.parts) {
    counts_[static_cast<std::size_t>(channels_[part.channel].topic)].unwritten += part.messages;
  }
}

void Recorder::Keep() {
  kept_B_ += packed_.bytes.size();
  kept_.push_back(packed_);
  // Large and small topics have separate chunks, so the newest one may end before one that was kept earlier.
  const auto keep_ns = static_cast<std::uint64_t>(1e9 * settings_.keep_s);
  const auto is_old = [&](const recording::PackedChunk& oldest) {
    return kept_B_ > settings_.keep_B || oldest.last_ns + keep_ns < packed_.last_ns;
  };
  while (kept_.size() > 1 && is_old(kept_.front())) {
    kept_B_ -= kept_.front().bytes.size();
    kept_.pop_front();
  }
}

void Recorder::Dump(const std::filesystem::path& path, std::string_view reason, std::int64_t now_ns) {
  Exchange(now_ns, true);
  const std::uint64_t free_B = FreeSpace(std::filesystem::absolute(path).parent_path());
  if (free_B < settings_.keep_free_B + kept_B_) {
    throw InputError(path.string() + ": not written: " + std::to_string(kept_B_ / 1'000'000) + " MB, but only " +
                     std::to_string(free_B / 1'000'000) + " MB are free on its disk and " +
                     std::to_string(settings_.keep_free_B / 1'000'000) +
                     " MB stay free (recorder.keep_free_MB of the cart file); delete old sessions");
  }
  recording::McapWriter file(path, kProfile, settings_.library);
  Introduce(&file);
  file.AddMetadata("dump", {{"reason", std::string(reason)}});
  std::array<std::uint16_t, kTopicCount> schemas{};
  AddChannels(&file, 0, &schemas);
  // Where the size of files is limited, the newest chunks are those that count.
  std::size_t first = kept_.size();
  std::uint64_t B = 0;
  while (first > 0 && B + kept_[first - 1].bytes.size() + kPerChunk_B <= file.BytesToLimit()) {
    B += kept_[--first].bytes.size() + kPerChunk_B;
  }
  for (std::size_t i = first; i < kept_.size(); ++i) file.Append(kept_[i]);
  file.Close();
  if (!file.error().empty()) throw InputError(path.string() + ": " + file.error());
  if (first > 0) {
    runtime::Log(runtime::LogLevel::kWarning, path.string() + ": lacks the oldest " + std::to_string(first) + " of " +
                                                  std::to_string(kept_.size()) +
                                                  " chunks: the size of files is limited for this process (ulimit -f)");
  }
}

void Recorder::Close(std::int64_t now_ns) {
  if (!file_) return;
  Exchange(now_ns, true);
  if (file_) FinishFile();
}

void Recorder::FinishFile() {
  std::array<Counts, kTopicCount> counts;
  {
    const std::lock_guard lock(mutex_);
    counts = counts_;
  }
  for (const auto& role : bus::kTopicRoles) {
    const Counts& of_topic = counts[static_cast<std::size_t>(role.id)];
    if (of_topic.lost() == 0) continue;
    file_->AddMetadata("lost " + std::string(bus::TopicLabel(role.id)),
                       {{"not_received", std::to_string(of_topic.missed)},
                        {"queue_full", std::to_string(of_topic.overflow)},
                        {"not_written", std::to_string(of_topic.unwritten)}});
  }
  // Only this thread changes `ended_`.
  if (!ended_.empty()) file_->AddMetadata("ended", {{"reason", ended_}});
  const bool was_well = file_->error().empty();
  file_->Close();
  const std::lock_guard lock(mutex_);
  if (was_well && !file_->error().empty()) ended_ = file_->error() + ": the file has no index (fulcrum log recover)";
  file_B_ = file_->bytes_written();
  file_.reset();
}

RecorderStats Recorder::stats() const {
  const std::lock_guard lock(mutex_);
  RecorderStats stats;
  for (const auto& role : bus::kTopicRoles) {
    const Counts& counts = counts_[static_cast<std::size_t>(role.id)];
    stats.received += counts.received;
    stats.missed += counts.missed;
    stats.overflow += counts.overflow;
    stats.unwritten += counts.unwritten;
    stats.not_recorded += counts.not_recorded;
    if (!IsDroppedFirst(role.id)) stats.needed_lost += counts.lost();
  }
  stats.file_B = file_B_;
  stats.queue_pct = 100 * most_used_;
  stats.ended = ended_;
  stats.left_s = left_s_;
  return stats;
}

bus::InputStats Recorder::topic_stats(TopicId topic) const {
  const std::lock_guard lock(mutex_);
  const Counts& counts = counts_[static_cast<std::size_t>(topic)];
  bus::InputStats stats;
  stats.received = counts.received;
  stats.lost = counts.lost();
  stats.newest_stamp_ns = counts.newest_ns;
  return stats;
}

}  // namespace fulcrum::recorder
