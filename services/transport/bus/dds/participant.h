// DDS backend of the ports: one participant per process, with the transports and QoS of services/transport/bus/topics.
// No DDS type is visible here.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "services/transport/bus/access.h"
#include "services/transport/bus/port.h"
#include "services/transport/bus/raw_input.h"
#include "services/transport/bus/schema.h"
#include "services/transport/bus/security.h"

namespace fulcrum::bus {

struct DdsSettings {
  int domain = 7;                     ///< 1 to 100: one per cart, one per test.
  std::string node_name = "fulcrum";  ///< Name that peers read in USER_DATA.
  std::filesystem::path shared_memory =
      {};  ///< Private 0700 directory on /dev/shm for data-sharing; empty: one per domain.
  std::uint64_t schema_hash = SchemaHash();  ///< Schema that peers must use too; a test sets another one.
  Security security = {};                    ///< Off unless keys are named.
  /// Number of the session, for the stamps of all samples; without a value, the one that was handed over
  /// with a guest's keys, else the one that is announced in `shared_memory` (0 if there is none). Samples of other
  /// sessions are dropped and counted.
  std::optional<std::uint64_t> session = {};
  /// Silence after which peers remove this participant [s]. Longer than the 5 s after which the supervisor restarts a
  /// silent node. A process that merely stood still for longer than its lease is removed by a peer without removing
  /// that peer itself; the peer then receives it again only after long, with keys never.
  int lease_s = 8;
  /// Largest TissueFrame of this participant's ports: a writer's memory is made for it.
  int tissue_vertices = kMaxTissueVertices;
  /// Raw inputs let small samples gather for 8 ms: a thread that wakes for each sample would need twice the processor
  /// time.
  bool gathers = false;
};

/// Socket buffer that a participant requests, each way [B]: the stream of a second or two, for a delayed reader.
inline constexpr std::uint32_t kSocketBuffer_B = 4u << 20;

/// Settings for joining the session of a domain as an observer: `fulcrum status` and similar commands.
/// @param identity in access.h, whose rights the observer needs.
[[nodiscard]] DdsSettings ToolSettings(int domain, std::string_view identity = kToolIdentity);

/// Name of the recorder's participant: nodes wait for it before they begin.
inline constexpr const char* kRecorderPeer = "recording";

struct ReadPeer {
  std::string address;        ///< DdsParticipant::address() there.
  int writers = 0;            ///< Matched now.
  std::int64_t since_ns = 0;  ///< CLOCK_MONOTONIC of the first match.
};

/// Name of the metric with foreign_samples() in a node's Health.
inline constexpr const char* kForeignMetric = "foreign_samples";

class DdsParticipant {
 public:
  /// Throws InputError when the domain is out of range, shared memory is short or the participant cannot be made.
  explicit DdsParticipant(const DdsSettings& settings);
  ~DdsParticipant();
  DdsParticipant(const DdsParticipant&) = delete;
  DdsParticipant& operator=(const DdsParticipant&) = delete;

  /// Ports must be destroyed before the participant. T is a message of services/base/core/messages.h.
  /// `notify`, if given, is called on a thread of the bus whenever a sample has arrived. It may wake a thread or take
  /// from this input (then no other thread may), must be short and must not throw.
  template <class T>
  [[nodiscard]] std::unique_ptr<Input<T>> MakeInput(std::function<void()> notify = {});
  template <class T>
  [[nodiscard]] std::unique_ptr<typename OutputOf<T>::type> MakeOutput();

  /// Receives a topic undecoded. This registers its own type for the topic, so the participant can have no other port
  /// of it.
  [[nodiscard]] std::unique_ptr<RawInput> MakeRawInput(TopicId id, RawSink sink);
  /// The process behind a writer, also after the writer has left.
  [[nodiscard]] Peer PeerOf(const WriterGuid& writer) const;

  /// Whether a participant of that name is on the bus.
  [[nodiscard]] bool HasParticipant(const std::string& name) const;
  /// Whether all outputs of this participant are matched with readers of a participant of that name. Those readers
  /// match sooner or later than this side does: see PeersRead.
  [[nodiscard]] bool IsReadBy(const std::string& name) const;
  /// Address of this participant, unique over all hosts: 24 hexadecimal digits.
  [[nodiscard]] std::string address() const;
  /// Number of outputs made so far.
  [[nodiscard]] int writer_count() const;
  /// Participants whose writers are matched with raw inputs of this one. A sample is received that is written after its
  /// writer is listed here and IsReadBy() holds there.
  [[nodiscard]] std::vector<ReadPeer> PeersRead() const;

  /// Empty, or one line: a peer with another schema hash (both hashes, both names), or a supervisor that has other keys
  /// than this participant, or keys where this participant has none.
  [[nodiscard]] std::string schema_mismatch() const;
  /// Locks in shared memory that this process has taken over from dead processes since its start.
  [[nodiscard]] static std::uint64_t inherited_locks();
  /// Samples of other sessions that the inputs of this participant have dropped.
  [[nodiscard]] std::uint64_t foreign_samples() const;
  /// Participants of other sessions, and on a secured cart those that it refused, since the start.
  [[nodiscard]] Refusals refusals() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace fulcrum::bus
