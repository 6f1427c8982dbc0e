// What two links say to each other, as bytes. Numbers are little-endian; all decoding is bounded and says false to what
// is no such packet.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "services/base/core/messages.h"
#include "services/transport/link/codec/clock_filter.h"

namespace fulcrum::link {

/// Grows with any change of what follows and of the codecs.
inline constexpr std::uint8_t kWireVersion = 1;

enum class PacketKind : std::uint8_t {
  kPulse,       ///< Both ways, 20 Hz: clock, wishes, questions.
  kSample,      ///< A message of the bus.
  kTissue,      ///< A chunk of TissueSender.
  kPatch,       ///< A chunk of PatchSender.
  kOffer,       ///< Cart to host: the session and where its nodes run.
  kSceneAsk,    ///< Host to cart.
  kSceneChunk,  ///< Cart to host.
  kBye,         ///< The session is over.
};
inline constexpr int kPacketKinds = 8;

/// In front of each packet.
struct Envelope {
  PacketKind kind = PacketKind::kPulse;
  std::uint64_t epoch = 0;  ///< CLOCK_MONOTONIC of its host when the sending link began: grows with each restart [ns].
};
/// A packet begins with this; its body is put behind.
void PutEnvelope(const Envelope& envelope, std::vector<std::uint8_t>* out);
/// `body`: what is behind. `version`: what the sender speaks; with another one there is no body.
[[nodiscard]] bool TakeEnvelope(std::span<const std::uint8_t> packet, Envelope* envelope,
                                std::span<const std::uint8_t>* body, std::uint8_t* version);

inline constexpr std::size_t kMostQuestions = 64;

struct Pulse {
  std::uint64_t schema_hash = 0;
  std::int64_t sent_ns = 0;        ///< By the sender's clock.
  std::uint64_t heard_epoch = 0;   ///< Of the link that it heard last; 0: none.
  std::int64_t heard_sent_ns = 0;  ///< `sent_ns` of its newest pulse.
  std::int64_t heard_ns = 0;       ///< When that came, by the sender's clock.
  std::uint32_t wanted = 0;        ///< Bit per TopicId: somebody reads it there.
  bool wants_offer = false;
  bool wants_all_tissue = false, wants_all_patches = false, wants_all_topology = false;
  std::vector<std::uint32_t> missing_tissue, missing_patches;  ///< Chunks; at most kMostQuestions.
};
void PutPulse(const Pulse& pulse, std::vector<std::uint8_t>* out);
[[nodiscard]] bool TakePulse(std::span<const std::uint8_t> body, Pulse* pulse);

/// A message as CDR, told from `base`: for TopologyState the one sent before, for all others nothing.
struct SampleHead {
  TopicId topic = TopicId::kHealth;
  std::uint32_t number = 0;  ///< Of this topic, from 1.
  std::uint32_t base = 0;    ///< Number of the sample that it is told from; 0: none.
};
void PutSample(const SampleHead& head, std::span<const std::uint8_t> base, std::span<const std::uint8_t> cdr,
               std::vector<std::uint8_t>* out);
/// `delta`: for TakeDelta.
[[nodiscard]] bool TakeSample(std::span<const std::uint8_t> body, SampleHead* head,
                              std::span<const std::uint8_t>* delta);

inline constexpr std::uint64_t kLargestScene_B = std::uint64_t{256} << 20;
inline constexpr std::size_t kLargestCart_B = 48 * 1024;
inline constexpr std::size_t kSceneChunk_B = 32 * 1024;

struct Offer {
  std::string session_id, scene_name;
  std::uint64_t scene_hash = 0;
  std::uint64_t scene_B = 0;         ///< Size of the compiled file.
  std::uint64_t scene_checksum = 0;  ///< Hash64 of its bytes.
  std::uint32_t nodes = 0;           ///< Bit per NodeId: they run on the host.
  std::string cart_yaml;
};
void PutOffer(const Offer& offer, std::vector<std::uint8_t>* out);
[[nodiscard]] bool TakeOffer(std::span<const std::uint8_t> body, Offer* offer);

struct SceneAsk {
  std::uint64_t scene_hash = 0, offset = 0;
};
void PutSceneAsk(const SceneAsk& ask, std::vector<std::uint8_t>* out);
[[nodiscard]] bool TakeSceneAsk(std::span<const std::uint8_t> body, SceneAsk* ask);
void PutSceneChunk(const SceneAsk& where, std::span<const std::uint8_t> bytes, std::vector<std::uint8_t>* out);
[[nodiscard]] bool TakeSceneChunk(std::span<const std::uint8_t> body, SceneAsk* where,
                                  std::span<const std::uint8_t>* bytes);

}  // namespace fulcrum::link
