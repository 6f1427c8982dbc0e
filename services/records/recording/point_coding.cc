#include "services/records/recording/point_coding.h"

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cstring>
#include <tuple>

#include "services/base/core/byte_stream.h"
#include "services/base/core/tissue_blocks.h"
#include "services/base/core/zigzag.h"

namespace fulcrum::recording {
namespace {

enum Kind : std::uint32_t { kKey, kDifference, kNeighbour, kAsSent };

constexpr const char* kHeadKey = "blocks_head_B";

constexpr std::size_t kPoint = 3;  ///< Words of a point.
constexpr std::size_t kBlockWords = std::tuple_size_v<BlockSteps>;

/// Of a difference modulo 2^32.
std::uint32_t ZigzagOf(std::uint32_t difference) { return Zigzag(static_cast<std::int32_t>(difference)); }

template <class T>
bool Parse(const std::map<std::string, std::string>& metadata, const char* key, T* value) {
  const auto found = metadata.find(key);
  if (found == metadata.end()) return false;
  const char* const end = found->second.data() + found->second.size();
  const auto [at, error] = std::from_chars(found->second.data(), end, *value);
  return error == std::errc() && at == end;
}

}  // namespace

void PutPointCoding(const PointCoding& coding, std::map<std::string, std::string>* metadata) {
  (*metadata)[kHeadKey] = std::to_string(coding.head_B);
}

std::optional<PointCoding> FindPointCoding(const std::map<std::string, std::string>& metadata) {
  PointCoding coding;
  const bool good = Parse(metadata, kHeadKey, &coding.head_B) && coding.head_B <= PointCoding::kMostHead_B;
  return good ? std::optional(coding) : std::nullopt;
}

bool PointCoder::TakeWords(std::span<const std::uint8_t> message) {
  std::uint32_t blocks = 0;
  if (message.size() < coding_.head_B + sizeof blocks) return false;
  const std::uint8_t* from = message.data() + coding_.head_B;
  std::memcpy(&blocks, from, sizeof blocks);
  if (blocks > PointCoding::kMostBlocks ||
      message.size() != coding_.head_B + sizeof blocks + blocks * sizeof(TissueBlock)) {
    return false;
  }
  words_.resize(blocks * kBlockWords);
  from += sizeof blocks;
  TissueBlock block;
  BlockSteps steps;
  for (std::size_t b = 0; b < blocks; ++b) {
    std::memcpy(&block, from + b * sizeof block, sizeof block);
    if (!IsCanonical(block)) return false;
    Unpack(block, &steps);
    std::memcpy(words_.data() + b * kBlockWords, steps.data(), sizeof steps);
  }
  return true;
}

std::uint32_t PointCoder::Choose() const {
  const std::size_t count = words_.size();
  if (last_.empty() || last_.size() != count) return kKey;
  // Every eighth point tells as much as all of them.
  std::uint64_t sum = 0, neighbour_sum = 0;
  for (std::size_t i = kPoint; i + kPoint <= count; i += 8 * kPoint) {
    for (std::size_t k = i; k < i + kPoint; ++k) {
      const std::uint32_t moved = words_[k] - last_[k];
      sum += ZigzagOf(moved);
      neighbour_sum += ZigzagOf(moved - (words_[k - kPoint] - last_[k - kPoint]));
    }
  }
  return sum <= neighbour_sum ? kDifference : kNeighbour;
}

std::uint32_t PointCoder::Predict(std::uint32_t kind) {
  const std::size_t count = words_.size();
  residuals_.resize(count);
  if (kind == kKey) last_.assign(count, 0);
  std::uint32_t all = 0;
  const std::size_t first = kind == kDifference ? count : std::min(kPoint, count);
  for (std::size_t i = 0; i < first; ++i) {
    residuals_[i] = ZigzagOf(words_[i] - last_[i]);
    all |= residuals_[i];
  }
  for (std::size_t i = first; i < count; ++i) {
    residuals_[i] = ZigzagOf(words_[i] - last_[i] - (words_[i - kPoint] - last_[i - kPoint]));
    all |= residuals_[i];
  }
  return all;
}

void PointCoder::Encode(std::span<const std::uint8_t> message, std::vector<std::uint8_t>* coded) {
  ByteWriter to(coded);
  const auto put_head = [&](std::uint32_t kind, std::size_t blocks, std::size_t B) {
    const std::size_t head_B = std::min(coding_.head_B, message.size());
    to.Bytes(message.data(), head_B);
    coded->resize(coded->size() + coding_.head_B - head_B);
    to.Number(kind);
    to.Number(static_cast<std::uint32_t>(blocks));
    to.Number(static_cast<std::uint32_t>(B));
  };
  if (!TakeWords(message)) {
    put_head(kAsSent, 0, message.size());
    to.Bytes(message.data(), message.size());
    return;
  }
  const std::uint32_t kind = Choose();
  const auto planes = static_cast<std::size_t>((std::bit_width(Predict(kind)) + 7) / 8);
  const std::size_t count = words_.size();
  put_head(kind, count / kBlockWords, planes * count);
  const std::size_t at = coded->size();
  coded->resize(at + planes * count);
  for (std::size_t plane = 0; plane < planes; ++plane) {
    std::uint8_t* const bytes = coded->data() + at + plane * count;
    for (std::size_t i = 0; i < count; ++i) bytes[i] = static_cast<std::uint8_t>(residuals_[i] >> (8 * plane));
  }
  last_.swap(words_);
}

bool PointCoder::Decode(std::span<const std::uint8_t> coded, std::vector<std::uint8_t>* message) {
  ByteReader from(coded);
  const std::span<const std::uint8_t> head = from.Take(coding_.head_B);
  const auto kind = from.Number<std::uint32_t>();
  const std::size_t blocks = from.Number<std::uint32_t>();
  const std::span<const std::uint8_t> bytes = from.Take(from.Number<std::uint32_t>());
  if (from.good() && kind == kAsSent) {
    message->assign(bytes.begin(), bytes.end());
    return true;
  }
  const bool fits = blocks <= PointCoding::kMostBlocks;
  const std::size_t count = fits ? blocks * kBlockWords : 0;
  const std::size_t planes = count == 0 ? 0 : bytes.size() / count;
  const bool refers = kind != kKey;
  const bool is_complete =
      from.good() && fits && kind < kAsSent && planes <= sizeof(std::uint32_t) && planes * count == bytes.size();
  if (!is_complete || (refers && (last_.empty() || last_.size() != count))) {
    Restart();  // So that nothing after it is decoded from the message before it.
    return false;
  }
  residuals_.assign(count, 0);
  for (std::size_t plane = 0; plane < planes; ++plane) {
    const std::uint8_t* const from_plane = bytes.data() + plane * count;
    for (std::size_t i = 0; i < count; ++i) {
      residuals_[i] |= static_cast<std::uint32_t>(from_plane[i]) << (8 * plane);
    }
  }
  if (!refers) last_.assign(count, 0);
  words_.resize(count);
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint32_t moved = kind == kDifference || i < kPoint ? 0 : words_[i - kPoint] - last_[i - kPoint];
    words_[i] = last_[i] + moved + static_cast<std::uint32_t>(Unzigzag(residuals_[i]));
  }
  const bool near = std::ranges::all_of(words_, [](std::uint32_t word) {
    const auto steps = static_cast<std::int32_t>(word);
    return steps >= -kMostSteps && steps <= kMostSteps;
  });
  if (!near) {
    Restart();
    return false;
  }
  PutBlocks(head, message);
  last_.swap(words_);
  return true;
}

void PointCoder::PutBlocks(std::span<const std::uint8_t> head, std::vector<std::uint8_t>* message) const {
  const auto blocks = static_cast<std::uint32_t>(words_.size() / kBlockWords);
  message->assign(head.begin(), head.end());
  ByteWriter to(message);
  to.Number(blocks);
  BlockSteps steps;
  for (std::size_t b = 0; b < blocks; ++b) {
    std::memcpy(steps.data(), words_.data() + b * kBlockWords, sizeof steps);
    const TissueBlock block = Pack(steps);
    to.Bytes(&block, sizeof block);
  }
}

void PointCoders::BeginChunk() {
  std::erase_if(coders_, [](const auto& entry) { return !entry.second.used; });
  for (auto& [channel, entry] : coders_) {
    entry.coder.Restart();
    entry.used = false;
  }
}

PointCoder& PointCoders::Of(std::uint16_t channel) {
  Entry& entry = coders_.try_emplace(channel, Entry{PointCoder(codings_.at(channel))}).first->second;
  entry.used = true;
  return entry.coder;
}

}  // namespace fulcrum::recording
