// Writes the samples of all topics into an MCAP file.
//
//   threads of the bus ── Receive ──► batch being filled ─┐ exchanged by Flush
//   writing thread ────── Flush ◄──── batch being written ┘──► chunks ──► file; the last seconds are kept for Dump
//
// A thread of the bus copies a sample and returns; it never waits for the disk, since only the exchange of the batches
// holds the lock.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "services/records/recorder/room.h"
#include "services/records/recording/mcap_writer.h"
#include "services/transport/bus/port.h"
#include "services/transport/bus/raw_input.h"

namespace fulcrum::recorder {

struct RecorderSettings {
  std::filesystem::path file;                 ///< Empty: only dumps are written.
  double keep_s = 0;                          ///< For dumps: span of the newest samples that is kept in memory [s].
  std::size_t keep_B = std::size_t{1} << 30;  ///< Upper limit of that memory.
  /// Space that a recording leaves free on its disk [B]: it ends in order before.
  std::uint64_t keep_free_B = 500'000'000;
  std::string library;  ///< Name of the writing program: "fulcrum 0.1.0".
  /// Metadata of the session in the file, one record per entry.
  std::map<std::string, recording::TextMap> metadata;
  /// Metadata of a writer in the file, beside its guid: called once for each writer, on the writing thread.
  std::function<recording::TextMap(const bus::WriterGuid&)> describe;
  /// Largest size of the samples that wait for the writing thread: of large topics, four seconds of the built-in scene,
  /// and of small ones, four minutes of it. Health may fill half of the latter, so that what a replay needs always has
  /// room of its own. Twice this is reserved; memory is used only when needed.
  std::size_t large_queue_B = std::size_t{96} << 20;
  std::size_t small_queue_B = std::size_t{256} << 20;
};

/// Figures since the start.
struct RecorderStats {
  std::uint64_t received = 0;   ///< Samples.
  std::uint64_t missed = 0;     ///< Samples that did not arrive: gaps in their writer's sequence.
  std::uint64_t overflow = 0;   ///< Samples for which the queue had no room.
  std::uint64_t unwritten = 0;  ///< Samples that could not be written.
  /// Samples that came after the end of the recording. They are not losses: Health has told of the end.
  std::uint64_t not_recorded = 0;
  std::uint64_t file_B = 0;
  double queue_pct = 0;           ///< Highest filling level of the queue of large or of small topics.
  std::uint64_t needed_lost = 0;  ///< Of the lost samples, those that a replay needs.
  std::string ended;   ///< Why the recording has ended before the session, in order or not; empty: it has not.
  double left_s = -1;  ///< Time until the recording will end for lack of room [s]; negative: not known.
  [[nodiscard]] std::uint64_t lost() const { return missed + overflow + unwritten; }
};

class Recorder {
 public:
  /// Throws InputError if the file cannot be created.
  explicit Recorder(const RecorderSettings& settings);
  ~Recorder();
  Recorder(const Recorder&) = delete;
  Recorder& operator=(const Recorder&) = delete;

  /// Takes over a sample. May be called on any thread.
  void Receive(const bus::RawSample& sample);

  // The following functions are for the writing thread only.
  /// Writes the received samples once they fill a chunk or are kLongestChunk_ns old. Ends the recording when its room
  /// is used up.
  void Flush(std::int64_t now_ns);
  /// Writes all received samples, and writes the last seconds that were kept into a file of its own. Throws InputError
  /// if that is not possible.
  void Dump(const std::filesystem::path& file, std::string_view reason, std::int64_t now_ns);
  /// Writes all received samples, the losses and the end of the file.
  void Close(std::int64_t now_ns);

  [[nodiscard]] RecorderStats stats() const;
  /// Figures of one topic for Health.
  [[nodiscard]] bus::InputStats topic_stats(TopicId topic) const;

  /// Together with the period of Flush this bounds the time until a sample is in the file to one second.
  static constexpr std::int64_t kLongestChunk_ns = 500'000'000;

 private:
  /// Message records, in the format of a chunk: a sample is copied once and packed from there.
  struct Batch {
    /// Large and small topics are separated, so that they are in different chunks: most readers need only the small
    /// ones, which are a thirtieth of the bytes. Each part has room of its own.
    struct Part {
      std::unique_ptr<std::uint8_t[]> bytes;
      std::size_t used = 0;
    };
    /// Lengths of both parts at a moment while they were filled.
    struct Cut {
      std::size_t large = 0, small = 0;
    };
    Part large, small;
    std::int64_t begin_ns = 0;  ///< Arrival of its first sample.
    /// A cut each kLongestChunk_ns of arrivals: what has waited longer, because the disk stood still, is packed in
    /// pieces, large and small topics of one time side by side. Readers sort within a bounded time (TimeOrder).
    std::vector<Cut> cuts;
    std::int64_t cut_ns = 0;  ///< Arrival at the last cut, or begin_ns.
    [[nodiscard]] std::size_t used() const { return large.used + small.used; }
    void Begin(std::int64_t now_ns) { begin_ns = cut_ns = now_ns; }
    /// Call before a sample that arrived at `now_ns` is added.
    void CutIfDue(std::int64_t now_ns) {
      if (now_ns - cut_ns < kLongestChunk_ns) return;
      cuts.push_back({large.used, small.used});
      cut_ns = now_ns;
    }
  };
  /// Place for a message record in the batch that is being filled; nullptr: its queue is full.
  [[nodiscard]] std::uint8_t* PlaceFor(TopicId topic, std::size_t record_B);
  struct Writer {
    TopicId topic;
    bus::WriterGuid guid;
    std::uint64_t last_sequence;
    std::int64_t last_ns;
  };
  struct Counts {
    std::uint64_t received = 0, missed = 0, overflow = 0, unwritten = 0, not_recorded = 0;
    std::int64_t newest_ns = 0;
    [[nodiscard]] std::uint64_t lost() const { return missed + overflow + unwritten; }
  };
  struct Channel {
    TopicId topic;
    bus::WriterGuid writer;
    recording::TextMap about;
  };

  void AddNewChannels();
  /// Packs the batch that is being written and empties it.
  void PackBatch(std::int64_t now_ns);
  void Pack(std::span<const std::uint8_t> records, std::size_t chunk_B);
  /// Why the recording must end now; empty: it has room.
  [[nodiscard]] std::string ReasonToEnd(std::int64_t now_ns);
  /// Exchanges the batches if the filled one is large or old enough for a chunk, or if `all`, and writes the filled
  /// one.
  /// @param end not empty: no sample after these is recorded, and why.
  void Exchange(std::int64_t now_ns, bool all, const std::string& end = {});
  /// Writes the packed chunk into the file.
  void Write();
  /// Writes the losses and the end of the file.
  void FinishFile();
  /// Adds the packed chunk to those kept for a dump.
  void Keep();
  /// Writes the metadata into a new file.
  void Introduce(recording::McapWriter* file) const;
  /// Adds the channels from number `first` on, with the schemas that the file does not contain yet.
  void AddChannels(recording::McapWriter* file, std::size_t first,
                   std::array<std::uint16_t, kTopicCount>* schemas) const;

  const RecorderSettings settings_;
  /// Determined once, so that the times of a file never jump with the wall clock.
  const std::int64_t wall_minus_monotonic_ns_;

  mutable std::mutex mutex_;  ///< Guards the members up to the blank line.
  Batch filling_;
  std::vector<Writer> writers_;
  std::array<Counts, kTopicCount> counts_{};
  double most_used_ = 0;  ///< Share of a queue.
  std::string ended_;     ///< Not empty: the recording has ended, and why.
  std::uint64_t file_B_ = 0;
  double left_s_ = -1;

  Batch writing_;
  std::optional<recording::McapWriter> file_;
  std::optional<Room> room_;
  std::array<std::uint16_t, kTopicCount> schemas_{};  ///< Numbers in `file_`; 0: not added yet.
  std::vector<Channel> channels_;                     ///< By writer.
  recording::ChunkPacker packer_;
  recording::PackedChunk packed_;
  std::deque<recording::PackedChunk> kept_;
  std::size_t kept_B_ = 0;
};

}  // namespace fulcrum::recorder
