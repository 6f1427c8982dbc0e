// Reader of a recording as ticks of nodes, each with the inputs that it consumed.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "services/apps/replayer/recorded_tick.h"
#include "services/records/recording/mcap_reader.h"

namespace fulcrum::replay {

/// Sequence of one writer's sample: (epoch, sequence).
using SampleKey = std::pair<std::uint64_t, std::uint64_t>;

/// The newest samples of a topic by epoch and sequence.
template <class T>
class SampleShelf {
 public:
  explicit SampleShelf(std::size_t limit) : limit_(limit) {}
  void Put(const T& sample) {
    samples_.insert_or_assign(SampleKey{sample.stamp.epoch, sample.stamp.sequence}, sample);
    if (samples_.size() > limit_) samples_.erase(samples_.begin());
  }
  [[nodiscard]] const T* Find(const SampleKey& key) const {
    const auto found = samples_.find(key);
    return found == samples_.end() ? nullptr : &found->second;
  }
  /// True when the sample before `key` is the last one of its writer.
  [[nodiscard]] bool EndsBefore(const SampleKey& key) const {
    const auto next = samples_.lower_bound(key);
    const bool nothing_after = next == samples_.end() || next->first.first != key.first;
    return nothing_after && Find({key.first, key.second - 1}) != nullptr;
  }

 private:
  std::size_t limit_;
  std::map<SampleKey, T> samples_;
};

/// Reads the recording once, from its beginning, and delays each tick until its inputs have been read: a sample may
/// follow the manifest of the tick that consumed it, because the order between topics in a recording is arbitrary.
///
/// Physics and thermal send a TickManifest for each tick, haptics one for several ticks, of which only the last one has
/// consumed inputs.
class TickSource {
 public:
  /// @param nodes the requested ones of physics, thermal and haptics.
  /// @param period_s nominal period by node.
  /// Throws InputError when the file cannot be read.
  TickSource(const std::filesystem::path& file, const std::vector<NodeId>& nodes,
             const std::array<double, kNodeCount>& period_s);

  /// The next tick in the order of their times; false at the end of the recording.
  bool Next(RecordedTick* tick);

  /// See McapReader::Reopen().
  void Reopen() { reader_.Reopen(); }

  /// The SceneManifest, once it was read.
  [[nodiscard]] const std::optional<SceneManifest>& session() const { return session_; }
  /// What of the part read so far is damaged, cut off or cannot be decoded; empty: nothing.
  [[nodiscard]] std::vector<std::string> Faults() const;

  /// A tick is complete when messages that are later by this time have been read [ns].
  static constexpr std::int64_t kSettle_ns = 2'000'000'000;

 private:
  void Take(const recording::McapMessage& message);
  template <class T>
  bool Decode(const recording::McapMessage& message, T* sample);
  void TakeManifest(const TickManifest& manifest);
  /// Index and session time of a tick without a manifest of its own.
  void Complete(RecordedTick* tick);
  template <class T>
  void Fetch(const RecordedTick& tick, const ConsumedInput& consumed, const SampleShelf<T>& shelf,
             std::vector<T>* samples, std::string* missing);
  [[nodiscard]] bool wanted(NodeId node) const { return wanted_[static_cast<std::size_t>(node)]; }

  struct Pending {
    RecordedTick tick;
    std::vector<ConsumedInput> consumed;
    std::uint64_t sequence = 0;  ///< Sequence of its manifest: a gap is a tick that the recording lacks.
    bool has_manifest = true;    ///< False: one of haptics before that of its manifest.
  };
  struct Progress {
    std::uint64_t epoch = 0, sequence = 0, index = 0;
    std::map<TopicId, SampleKey> consumed;
  };

  recording::McapReader reader_;
  std::array<bool, kNodeCount> wanted_{};
  std::array<double, kNodeCount> period_s_{};
  std::map<std::uint16_t, TopicId> topic_of_;
  std::optional<SceneManifest> session_;
  SampleShelf<ToolState> tools_{4096};
  SampleShelf<HandleState> handles_{4096};
  SampleShelf<GeneratorSetting> generator_{512};
  SampleShelf<TopologyState> topology_{128};
  SampleShelf<OpenCells> open_cells_{512};
  SampleShelf<TearState> tears_{128};
  SampleShelf<CauteryContact> cautery_{1024};
  SampleShelf<ContactModel> models_{1024};
  SampleShelf<OperatorInput> operators_{4096};
  std::multimap<std::int64_t, Pending> pending_;  ///< By the stamp of the tick [ns].
  std::array<Progress, kNodeCount> progress_;
  std::int64_t newest_ns_ = 0;
  std::uint64_t undecodable_ = 0;
  bool ended_ = false;
};

}  // namespace fulcrum::replay
