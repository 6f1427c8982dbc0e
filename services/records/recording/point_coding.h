// Coding of messages that hold an array of points in blocks (services/base/core/tissue_blocks.h), such as a
// TissueFrame: each message as its difference from the one before it in the same chunk.
//
// A coded message:
//
//   head_B bytes   those of the message, unchanged
//   uint32         kind: 0 key, 1 difference, 2 difference relative to the neighbour, 3 as sent
//   uint32         number of blocks
//   uint32         length of what follows [B]
//   bytes          residuals: the low byte of each, then the second byte of each, … as many as the largest needs
//
// A word is a coordinate in steps, 192 a block; the blocks of the message are packed from them. A residual is a
// difference modulo 2^32, as zigzag: 0, -1, 1, -2, … become 0, 1, 2, 3, … w are the words of this message, p those of
// the last message that was not kept as sent. i-3 is the same coordinate of the point before; for the first point
// w[i-3] and p[i-3] are 0.
//
//   key            w[i] - w[i-3]
//   difference     w[i] - p[i]
//   neighbour      (w[i] - p[i]) - (w[i-3] - p[i-3])
//
// As sent: the bytes are the whole message, which is not the head, the number of blocks (uint32) and so many canonical
// blocks.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace fulcrum::recording {

/// How a channel's messages are coded. It is kept in the metadata of the channel.
struct PointCoding {
  std::size_t head_B = 0;  ///< Length of what precedes the number of blocks, with the encapsulation of CDR.

  [[nodiscard]] bool operator==(const PointCoding&) const = default;

  static constexpr std::size_t kMostHead_B = 4096;
  static constexpr std::size_t kMostBlocks = std::size_t{1} << 14;
};

void PutPointCoding(const PointCoding& coding, std::map<std::string, std::string>* metadata);
/// The coding of a channel with this metadata; nothing if it has none, or one that is out of range.
[[nodiscard]] std::optional<PointCoding> FindPointCoding(const std::map<std::string, std::string>& metadata);

/// Codes or decodes the messages of one channel, in their order. Allocates nothing once the buffers have grown.
class PointCoder {
 public:
  explicit PointCoder(const PointCoding& coding) : coding_(coding) {}

  /// The next message begins a chunk: it does not refer to the one before it.
  void Restart() { last_.clear(); }
  /// Appends a message in coded form. Any bytes are accepted: what is not a message of this coding is kept as sent.
  void Encode(std::span<const std::uint8_t> message, std::vector<std::uint8_t>* coded);
  /// The reverse. False if the bytes are no coded message, or refer to a message before that was not decoded.
  [[nodiscard]] bool Decode(std::span<const std::uint8_t> coded, std::vector<std::uint8_t>* message);

 private:
  /// Fills `words_` from the message. False if it is not of this coding.
  [[nodiscard]] bool TakeWords(std::span<const std::uint8_t> message);
  /// Makes the message of `words_`.
  void PutBlocks(std::span<const std::uint8_t> head, std::vector<std::uint8_t>* message) const;
  /// The kind of residuals that takes fewer bytes.
  [[nodiscard]] std::uint32_t Choose() const;
  /// Fills `residuals_`; returns the bits that any of them has.
  std::uint32_t Predict(std::uint32_t kind);

  const PointCoding coding_;
  std::vector<std::uint32_t> words_, last_, residuals_;  ///< `last_`: of the message before; empty: none.
};

/// The coders of a file's channels, of which only those are kept that the present chunk or the one before needs: each
/// restart of a node makes another channel.
class PointCoders {
 public:
  void Add(std::uint16_t channel, const PointCoding& coding) { codings_.emplace(channel, coding); }
  [[nodiscard]] bool empty() const { return codings_.empty(); }
  [[nodiscard]] bool Has(std::uint16_t channel) const { return codings_.contains(channel); }
  void BeginChunk();
  /// Of a channel that Has().
  [[nodiscard]] PointCoder& Of(std::uint16_t channel);

 private:
  struct Entry {
    PointCoder coder;
    bool used = false;  ///< In the present chunk.
  };
  std::map<std::uint16_t, PointCoding> codings_;
  std::map<std::uint16_t, Entry> coders_;
};

}  // namespace fulcrum::recording
