// DDS backend of the ports: one participant per process, with the transports and QoS of services/transport/bus/topics.
// No DDS type is visible here.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "services/transport/bus/port.h"
#include "services/transport/bus/raw_input.h"
#include "services/transport/bus/schema.h"
#include "services/transport/bus/security.h"

namespace fulcrum::bus {

struct DdsSettings {
  int domain = 7;                     ///< 1 … 100: one per cart, one per test.
  std::string node_name = "fulcrum";  ///< Seen by peers in USER_DATA.
  std::filesystem::path shared_memory =
      {};  ///< Private 0700 directory on /dev/shm for data-sharing; empty: one per domain.
  std::uint64_t schema_hash = SchemaHash();  ///< What peers must speak too; a test gives another one.
  Security security = {};                    ///< Off unless keys are named.
  /// Silence after which the others forget this participant [s]. Longer than the 5 s after which the supervisor starts
  /// a silent node again: who is forgotten by a peer, having merely stood still, and has not forgotten that peer is
  /// heard by it again only after long, with keys never.
  int lease_s = 8;
  /// Its raw inputs let small samples gather for 8 ms: a thread that was woken for each would take twice the processor.
  bool gathers = false;
};

/// What a participant asks the kernel for, each way: the stream of a second or two, for a reader that is kept waiting.
inline constexpr std::uint32_t kSocketBuffer_B = 4u << 20;

/// To join the session that runs in a domain as one who asks and looks: `fulcrum status` and the like.
[[nodiscard]] DdsSettings ToolSettings(int domain);

/// Name of the participant that records: nodes wait for it before they begin.
inline constexpr const char* kRecorderPeer = "recording";

struct ReadPeer {
  std::string address;        ///< DdsParticipant::address() there.
  int writers = 0;            ///< Matched now.
  std::int64_t since_ns = 0;  ///< CLOCK_MONOTONIC of the first match.
};

class DdsParticipant {
 public:
  /// Throws InputError when the domain is out of range, shared memory is short or the participant cannot be made.
  explicit DdsParticipant(const DdsSettings& settings);
  ~DdsParticipant();
  DdsParticipant(const DdsParticipant&) = delete;
  DdsParticipant& operator=(const DdsParticipant&) = delete;

  /// Ports live at most as long as the participant. T is a message of services/base/core/messages.h.
  /// `notify`, if given, is called on a thread of the bus whenever a sample has come: it may wake somebody or take from
  /// this input (then nobody else may), must be short and must not throw.
  template <class T>
  [[nodiscard]] std::unique_ptr<Input<T>> MakeInput(std::function<void()> notify = {});
  template <class T>
  [[nodiscard]] std::unique_ptr<typename OutputOf<T>::type> MakeOutput();

  /// Receives a topic undecoded. The type stands for any here, so this participant can have no other port of the topic.
  [[nodiscard]] std::unique_ptr<RawInput> MakeRawInput(TopicId id, RawSink sink);
  /// Whose a writer is or was.
  [[nodiscard]] Peer PeerOf(const WriterGuid& writer) const;

  /// Whether a participant of that name is there.
  [[nodiscard]] bool Knows(const std::string& name) const;
  /// Whether all outputs of this participant are matched with readers of one of that name. These match later than this
  /// side does, or sooner: see PeersRead.
  [[nodiscard]] bool IsReadBy(const std::string& name) const;
  /// Unlike that of any other participant, on any host: 24 hexadecimal digits.
  [[nodiscard]] std::string address() const;
  /// Outputs made so far.
  [[nodiscard]] int writer_count() const;
  /// Participants whose writers are matched with raw inputs of this one. A sample is received that is written after its
  /// writer is listed here and IsReadBy() holds there.
  [[nodiscard]] std::vector<ReadPeer> PeersRead() const;

  /// Empty, or one line: a peer whose schema hash differs (both hashes, both names), or a supervisor that has other
  /// keys than this participant, or keys where this one has none.
  [[nodiscard]] std::string schema_mismatch() const;
  /// Locks in shared memory that this process took over from dead ones, since its start.
  [[nodiscard]] static std::uint64_t inherited_locks();
  /// Who was refused on a secured cart, since the start.
  [[nodiscard]] Refusals refusals() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace fulcrum::bus
