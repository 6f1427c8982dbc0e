#include "services/transport/link/codec/tissue_codec.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

#include "services/transport/link/codec/bits.h"

namespace fulcrum::link {
namespace {

/// Largest coordinate, 10 m as in the gate [steps].
constexpr std::int32_t kFarthest = 2'000'000;
constexpr double kStepsPerMetre = 1 / kTissueStep_m;
/// Largest width of a difference between neighbours, or of two such differences, for coordinates up to kFarthest
/// [bits].
constexpr int kWidest = 25;
constexpr std::uint8_t kSecondDifferences = 0x80;
/// Unmoved blocks that are sent with each frame, so that a block whose repetition was lost too is restored within about
/// 10 s.
constexpr std::uint32_t kTissueRefresh = 2;

std::uint32_t BlocksOf(std::uint32_t vertices) { return (vertices + kTissueBlock - 1) / kTissueBlock; }
std::uint32_t SizeOf(std::uint32_t block, std::uint32_t vertices) {
  return std::min(kTissueBlock, vertices - block * kTissueBlock);
}

void PutHeader(std::uint32_t chunk, std::uint32_t frame, const TissueFrameHeader& header,
               std::vector<std::uint8_t>* out) {
  ByteWriter w(out);
  w.Number(chunk);
  w.Number(frame);
  w.Number(std::uint8_t{0});
  w.Number(header.stamp.sequence);
  w.Number(header.stamp.epoch);
  w.Number(header.stamp.stamp_ns);
  w.Number(header.scene_hash);
  w.Number(header.topology_revision);
  w.Number(header.tool_sequence);
  w.Number(header.handle_sequence);
  w.Number(std::bit_cast<std::uint64_t>(header.session_time_s));
  w.Number(std::bit_cast<std::uint64_t>(header.simulated_time_s));
  w.Number(std::bit_cast<std::uint64_t>(header.next_within_s));
  w.Number(header.vertex_count);
  w.Number(static_cast<std::uint8_t>(header.grasping_tools));
}
constexpr std::size_t kTissueLastAt = 8;  ///< Position of `last` in a chunk [B].

TissueFrameHeader TakeHeader(ByteReader* r) {
  TissueFrameHeader header;
  header.stamp.sequence = r->Number<std::uint64_t>();
  header.stamp.epoch = r->Number<std::uint64_t>();
  header.stamp.stamp_ns = r->Number<std::int64_t>();
  header.scene_hash = r->Number<std::uint64_t>();
  header.topology_revision = r->Number<std::uint64_t>();
  header.tool_sequence = r->Number<std::uint64_t>();
  header.handle_sequence = r->Number<std::uint64_t>();
  header.session_time_s = std::bit_cast<double>(r->Number<std::uint64_t>());
  header.simulated_time_s = std::bit_cast<double>(r->Number<std::uint64_t>());
  header.next_within_s = std::bit_cast<double>(r->Number<std::uint64_t>());
  header.vertex_count = r->Number<std::uint32_t>();
  header.grasping_tools = r->Number<std::uint8_t>();
  return header;
}

/// Encodes one axis of one block: the first value, then first or second differences, whichever need fewer bits.
void PutAxis(std::span<const std::int32_t> values, std::vector<std::uint8_t>* out) {
  std::array<std::uint32_t, kTissueBlock> first{}, second{};
  const std::size_t n = values.size() - 1;
  std::int32_t before = 0;
  for (std::size_t i = 0; i < n; ++i) {
    const std::int32_t difference = values[i + 1] - values[i];
    first[i] = Zigzag(difference);
    second[i] = Zigzag(difference - before);
    before = difference;
  }
  const int one = WidthOf(std::span(first).first(n)), two = WidthOf(std::span(second).first(n));
  PutVarint(Zigzag(values[0]), out);
  out->push_back(static_cast<std::uint8_t>(two < one ? two | kSecondDifferences : one));
  PutBits(std::span(two < one ? second : first).first(n), std::min(one, two), out);
}

bool TakeAxis(ByteReader* in, std::span<std::int32_t> values) {
  std::array<std::uint32_t, kTissueBlock> raw{};
  const std::size_t n = values.size() - 1;
  std::int64_t value = Unzigzag(TakeVarint(in)), difference = 0;
  const auto code = in->Number<std::uint8_t>();
  const bool second = (code & kSecondDifferences) != 0;
  const int width = code & ~kSecondDifferences;
  if (!in->good() || width > kWidest || !TakeBits(in, width, std::span(raw).first(n))) return false;
  for (std::size_t i = 0;; ++i) {
    if (std::abs(value) > kFarthest) return false;
    values[i] = static_cast<std::int32_t>(value);
    if (i == n) return true;
    difference = Unzigzag(raw[i]) + (second ? difference : 0);
    value += difference;
  }
}

}  // namespace

void TissueSender::FindDirty(std::span<const float> xyz) {
  for (std::uint32_t block = 0; block < dirty_.size(); ++block) {
    const std::size_t begin = std::size_t{3} * kTissueBlock * block;
    const std::size_t end = begin + std::size_t{3} * SizeOf(block, count_);
    bool moved = dirty_[block];
    for (std::size_t i = begin; i < end && !moved; ++i) {
      moved = std::abs(kStepsPerMetre * static_cast<double>(xyz[i]) - sent_steps_[i]) > kTissueSlack;
    }
    dirty_[block] = moved;
    if (!moved) continue;
    for (std::size_t i = begin; i < end; ++i) {
      sent_steps_[i] = std::clamp(static_cast<std::int32_t>(std::lround(kStepsPerMetre * static_cast<double>(xyz[i]))),
                                  -kFarthest, kFarthest);
    }
  }
}

void TissueSender::PutBlock(std::uint32_t block) {
  std::array<std::int32_t, kTissueBlock> axis{};
  const std::uint32_t size = SizeOf(block, count_);
  ByteWriter(&block_).Number(static_cast<std::uint16_t>(block));
  for (std::size_t k = 0; k < 3; ++k) {
    for (std::size_t i = 0; i < size; ++i) axis[i] = sent_steps_[3 * (std::size_t{block} * kTissueBlock + i) + k];
    PutAxis(std::span(axis).first(size), &block_);
  }
}

void TissueSender::Encode(const TissueFrame& frame, const SendChunk& send) {
  const std::uint32_t count = frame.header.vertex_count;
  if (count > kMaxTissueVertices || frame.xyz.size() < std::size_t{3} * count) return;
  if (count != count_) {
    count_ = count;
    sent_steps_.assign(std::size_t{3} * count, 0);
    dirty_.assign(BlocksOf(count), true);
  }
  for (std::uint32_t i = 0; i < kTissueRefresh && !dirty_.empty(); ++i) {
    next_refresh_ = (next_refresh_ + 1) % static_cast<std::uint32_t>(dirty_.size());
    dirty_[next_refresh_] = true;
  }
  FindDirty(frame.xyz);
  header_ = frame.header;
  Emit(send);
}

void TissueSender::Flush(const SendChunk& send) {
  if (std::find(dirty_.begin(), dirty_.end(), true) != dirty_.end()) Emit(send);
}

void TissueSender::Emit(const SendChunk& send) {
  ++frame_;
  const auto begin = [&] {
    chunk_.clear();
    PutHeader(sent_.Begin(), frame_, header_, &chunk_);
  };
  begin();
  for (std::uint32_t block = 0; block < dirty_.size(); ++block) {
    if (!dirty_[block]) continue;
    dirty_[block] = false;
    block_.clear();
    PutBlock(block);
    if (chunk_.size() + block_.size() > kChunk_B) {
      send(chunk_);
      begin();
    }
    sent_.Tell(block);
    chunk_.insert(chunk_.end(), block_.begin(), block_.end());
  }
  chunk_[kTissueLastAt] = 1;
  send(chunk_);
}

void TissueSender::Repeat(std::uint32_t chunk) {
  const std::vector<BlockId>* blocks = sent_.Find(chunk);
  if (blocks == nullptr) return RepeatAll();
  for (const BlockId block : *blocks) {
    if (block < dirty_.size()) dirty_[block] = true;
  }
}

bool TissueReceiver::Decode(std::span<const std::uint8_t> chunk) {
  ByteReader in(chunk);
  number_ = in.Number<std::uint32_t>();
  number_of_frame_ = in.Number<std::uint32_t>();
  const auto last = in.Number<std::uint8_t>();
  header_ = TakeHeader(&in);
  last_ = last != 0;
  blocks_.clear();
  values_.clear();
  if (!in.good() || number_ == 0 || number_of_frame_ == 0 || last > 1 || header_.vertex_count == 0 ||
      header_.vertex_count > kMaxTissueVertices || !std::isfinite(header_.session_time_s) ||
      !std::isfinite(header_.simulated_time_s) || !std::isfinite(header_.next_within_s)) {
    return false;
  }
  while (!in.empty()) {
    const std::uint32_t block = in.Number<std::uint16_t>();
    if (!in.good() || block >= BlocksOf(header_.vertex_count)) return false;
    const std::uint32_t size = SizeOf(block, header_.vertex_count);
    const std::size_t at = values_.size();
    values_.resize(at + std::size_t{3} * kTissueBlock);
    for (std::size_t k = 0; k < 3; ++k) {
      if (!TakeAxis(&in, std::span(values_).subspan(at + k * kTissueBlock, size))) return false;
    }
    blocks_.push_back(block);
  }
  return true;
}

void TissueReceiver::Apply() {
  if (header_.vertex_count != frame_.header.vertex_count || header_.scene_hash != frame_.header.scene_hash) {
    frame_.header = header_;
    frame_.xyz.assign(std::size_t{3} * header_.vertex_count, 0.0f);
    newest_.assign(BlocksOf(header_.vertex_count), 0);
    known_ = 0;
    passed_on_ = 0;
    missing_.AskForAll();
  }
  for (std::size_t b = 0; b < blocks_.size(); ++b) {
    const std::uint32_t block = blocks_[b];
    if (number_of_frame_ < newest_[block]) continue;  // A newer frame arrived first.
    known_ += newest_[block] == 0 ? 1 : 0;
    newest_[block] = number_of_frame_;
    const std::uint32_t size = SizeOf(block, header_.vertex_count);
    const std::int32_t* value = values_.data() + b * 3 * kTissueBlock;
    for (std::size_t k = 0; k < 3; ++k) {
      for (std::size_t i = 0; i < size; ++i) {
        frame_.xyz[3 * (std::size_t{block} * kTissueBlock + i) + k] =
            static_cast<float>(kTissueStep_m * value[k * kTissueBlock + i]);
      }
    }
  }
}

TissueReceiver::Result TissueReceiver::Take(std::span<const std::uint8_t> chunk) {
  if (!Decode(chunk)) {
    ++bad_;
    return Result::kBad;
  }
  missing_.Note(number_);
  Apply();
  if (!last_ || known_ < newest_.size() || number_of_frame_ <= passed_on_) return Result::kPart;
  passed_on_ = number_of_frame_;
  frame_.header = header_;
  return Result::kFrame;
}

}  // namespace fulcrum::link
