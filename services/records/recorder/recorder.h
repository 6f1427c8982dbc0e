// Samples of all topics into an MCAP file.
//
//   threads of the bus ── Receive ──► batch being filled ─┐ exchanged by Flush
//   writing thread ────── Flush ◄──── batch being written ┘──► chunks ──► file; the last seconds stay for Dump
//
// A thread of the bus copies a sample and returns; it never waits for the disk, since only the exchange of the batches
// is under the lock.
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
#include <string>
#include <string_view>
#include <vector>

#include "services/records/recording/mcap_writer.h"
#include "services/transport/bus/port.h"
#include "services/transport/bus/raw_input.h"

namespace fulcrum::recorder {

struct RecorderSettings {
  std::filesystem::path file;                 ///< Empty: nothing is written but dumps.
  double keep_s = 0;                          ///< For dumps: so much of the newest past is kept in memory [s].
  std::size_t keep_B = std::size_t{1} << 30;  ///< But no more than this.
  std::string library;                        ///< Who writes: "fulcrum 0.1.0".
  /// What a file tells of the session, each a metadata record.
  std::map<std::string, recording::TextMap> metadata;
  /// What a file tells of a writer, beside its guid: called once for each, on the writing thread.
  std::function<recording::TextMap(const bus::WriterGuid&)> describe;
  /// Samples that wait for the writing thread. Twice this is set aside, and costs memory only once it is needed.
  std::size_t queue_B = std::size_t{96} << 20;
};

/// Since the start.
struct RecorderStats {
  std::uint64_t received = 0;   ///< Samples.
  std::uint64_t missed = 0;     ///< Samples that did not arrive: gaps in their writer's sequence.
  std::uint64_t overflow = 0;   ///< Samples for which the queue had no room.
  std::uint64_t unwritten = 0;  ///< Samples that came after writing had failed.
  std::uint64_t file_B = 0;
  double queue_pct = 0;  ///< Fullest that a batch has been.
  std::string error;     ///< Why writing failed; empty: it has not.
  [[nodiscard]] std::uint64_t lost() const { return missed + overflow + unwritten; }
};

class Recorder {
 public:
  /// Throws InputError when the file cannot be made.
  explicit Recorder(const RecorderSettings& settings);
  ~Recorder();
  Recorder(const Recorder&) = delete;
  Recorder& operator=(const Recorder&) = delete;

  /// Any thread.
  void Receive(const bus::RawSample& sample, const std::function<bool()>& is_whole);

  // One thread, the writing one:
  /// Writes what has come once it is ChunkPacker::kChunkBytes or kLongestChunk_ns old.
  void Flush(std::int64_t now_ns);
  /// Writes what has come, and what is kept of the last seconds into a file of its own. Throws InputError when that
  /// cannot be.
  void Dump(const std::filesystem::path& file, std::string_view reason, std::int64_t now_ns);
  /// Writes what has come, what was lost, and the end of the file.
  void Close(std::int64_t now_ns);

  [[nodiscard]] RecorderStats stats() const;
  /// Of one topic, as Health shows it.
  [[nodiscard]] bus::InputStats topic_stats(TopicId topic) const;

  /// With the period of Flush, no sample waits longer than a second for the file.
  static constexpr std::int64_t kLongestChunk_ns = 500'000'000;

 private:
  /// Message records, as they stand in a chunk: a sample is copied once and packed from there.
  struct Batch {
    /// Large topics and small ones apart, and so in chunks of their own: most readers want only the small ones, which
    /// are a thirtieth of the bytes.
    struct Part {
      std::unique_ptr<std::uint8_t[]> bytes;
      std::size_t used = 0;
    };
    Part large, small;
    std::int64_t begin_ns = 0;  ///< When its first sample came.
    [[nodiscard]] std::size_t used() const { return large.used + small.used; }
  };
  struct Writer {
    TopicId topic;
    bus::WriterGuid guid;
    std::uint64_t last_sequence;
    std::int64_t last_ns;
  };
  struct Counts {
    std::uint64_t received = 0, missed = 0, overflow = 0, unwritten = 0;
    std::int64_t newest_ns = 0;
  };
  struct Channel {
    TopicId topic;
    bus::WriterGuid writer;
    recording::TextMap about;
  };

  void AddNewChannels();
  void Pack(Batch::Part* part);
  /// Takes over what has come when that is worth a chunk, or all.
  void Exchange(std::int64_t now_ns, bool all);
  /// The packed chunk into the file.
  void Write();
  /// The packed chunk to those that a dump holds.
  void Keep();
  /// Metadata into a new file.
  void Introduce(recording::McapWriter* file) const;
  /// Channels from number `first` on, with the schemas that the file does not have yet.
  void AddChannels(recording::McapWriter* file, std::size_t first,
                   std::array<std::uint16_t, kTopicCount>* schemas) const;

  const RecorderSettings settings_;
  const std::int64_t wall_minus_monotonic_ns_;  ///< Once: the times of a file never jump with the wall clock.

  mutable std::mutex mutex_;  ///< Guards what follows up to the blank line.
  Batch filling_;
  std::vector<Writer> writers_;
  std::array<Counts, kTopicCount> counts_{};
  std::size_t most_used_ = 0;
  std::string error_;
  std::uint64_t file_B_ = 0;

  Batch writing_;
  std::optional<recording::McapWriter> file_;
  std::array<std::uint16_t, kTopicCount> schemas_{};  ///< In `file_`; 0: not yet.
  std::vector<Channel> channels_;                     ///< By writer.
  recording::ChunkPacker packer_;
  recording::PackedChunk packed_;
  std::deque<recording::PackedChunk> kept_;
  std::size_t kept_B_ = 0;
};

}  // namespace fulcrum::recorder
