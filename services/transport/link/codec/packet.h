// Packets that two links exchange, as bytes. Numbers are little-endian. Decoding is bounded and returns false for bytes
// that are no valid packet.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "services/base/core/messages.h"
#include "services/transport/link/codec/clock_filter.h"

namespace fulcrum::link {

/// Increases with any change of the packets below and of the codecs.
inline constexpr std::uint8_t kWireVersion = 3;

enum class PacketKind : std::uint8_t {
  kPulse,       ///< Both ways, 20 Hz: clock stamps, wanted topics, missing chunks.
  kSample,      ///< One message of a topic.
  kTissue,      ///< A chunk of TissueSender.
  kPatch,       ///< A chunk of PatchSender.
  kOffer,       ///< Cart to host: the session and where its nodes run.
  kSceneAsk,    ///< Host to cart: requests one piece of the scene.
  kSceneChunk,  ///< Cart to host: one piece of the scene.
  kBye,         ///< The session has ended.
};
inline constexpr int kPacketKinds = 8;

/// Header of each packet.
struct Envelope {
  PacketKind kind = PacketKind::kPulse;
  /// CLOCK_MONOTONIC of the sending host when its link started [ns]: grows with each restart.
  std::uint64_t epoch = 0;
  std::uint64_t session = 0;  ///< SessionKeyOf the session that the sender has joined; 0: none yet.
};
/// Names a session in each packet.
[[nodiscard]] std::uint64_t SessionKeyOf(const std::string& session_id);
/// Appends the header of a packet; the body is appended after it.
void PutEnvelope(const Envelope& envelope, std::vector<std::uint8_t>* out);
/// `body`: the bytes after the header. `version`: the sender's wire version; if it differs from ours, `body` is empty.
[[nodiscard]] bool TakeEnvelope(std::span<const std::uint8_t> packet, Envelope* envelope,
                                std::span<const std::uint8_t>* body, std::uint8_t* version);

inline constexpr std::size_t kMostQuestions = 64;

struct Pulse {
  std::uint64_t schema_hash = 0;
  std::int64_t sent_ns = 0;        ///< Sending time by the sender's clock.
  std::uint64_t heard_epoch = 0;   ///< Epoch of the link from which the sender last received; 0: none.
  std::int64_t heard_sent_ns = 0;  ///< `sent_ns` of the newest pulse that the sender received.
  std::int64_t heard_ns = 0;       ///< When that pulse arrived, by the sender's clock.
  std::uint32_t wanted = 0;        ///< Bit per TopicId: the sender's host has a reader.
  bool wants_offer = false;
  bool wants_all_tissue = false, wants_all_patches = false, wants_all_topology = false;
  std::vector<std::uint32_t> missing_tissue, missing_patches;  ///< Missing chunks, at most kMostQuestions each.
};
void PutPulse(const Pulse& pulse, std::vector<std::uint8_t>* out);
[[nodiscard]] bool TakePulse(std::span<const std::uint8_t> body, Pulse* pulse);

/// Header of a message that is sent as CDR. A TopologyState is encoded as the difference from the one sent before.
struct SampleHead {
  TopicId topic = TopicId::kHealth;
  std::uint32_t number = 0;  ///< Number of the sample in its topic, from 1.
  std::uint32_t base = 0;    ///< Number of the sample that the difference refers to; 0: the message is complete.
};
void PutSample(const SampleHead& head, std::span<const std::uint8_t> base, std::span<const std::uint8_t> cdr,
               std::vector<std::uint8_t>* out);
/// `delta`: the difference to decode with TakeDelta.
[[nodiscard]] bool TakeSample(std::span<const std::uint8_t> body, SampleHead* head,
                              std::span<const std::uint8_t>* delta);

inline constexpr std::uint64_t kLargestScene_B = std::uint64_t{256} << 20;
inline constexpr std::size_t kLargestCart_B = 48 * 1024;
inline constexpr std::size_t kLongestWithheld_B = 512;
inline constexpr std::size_t kSceneChunk_B = 32 * 1024;

/// Whether the text can be the name of a file or folder, and be printed: 1 to `longest` printable ASCII characters
/// without "/", the first of them no dot. Names that come from another host become parts of paths.
[[nodiscard]] bool IsPlainName(const std::string& text, std::size_t longest);

struct Offer {
  std::string session_id, scene_name;  ///< Plain names.
  std::uint64_t scene_hash = 0;
  std::uint64_t scene_B = 0;         ///< Size of the compiled file.
  std::uint64_t scene_checksum = 0;  ///< Hash64 of the bytes of that file.
  std::uint32_t nodes = 0;           ///< Bit per NodeId: nodes that run on the host.
  std::string cart_yaml;             ///< Without paths and devices of the cart's machine.
  /// Keys of the cart that name a file or device of the cart's machine and concern `nodes`, with commas between: the
  /// host must supply them.
  std::string withheld;
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
