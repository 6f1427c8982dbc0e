#include "services/records/recording/point_coding.h"

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstring>

#include "services/base/core/byte_stream.h"
#include "services/base/core/zigzag.h"

namespace fulcrum::recording {
namespace {

enum Kind : std::uint32_t { kKey, kDifference, kNeighbour, kAsSent };

constexpr const char* kHeadKey = "points_head_B";
constexpr const char* kValuesKey = "points_values";
constexpr const char* kStepKey = "points_step";

constexpr std::size_t kPoint = 3;  ///< Values of a point.
constexpr std::uint32_t kSign = 0x80000000u;
/// Largest number of steps: differences of differences stay within 32 bits.
constexpr float kMostSteps = 1 << 28;

/// Of a difference modulo 2^32.
std::uint32_t ZigzagOf(std::uint32_t difference) { return Zigzag(static_cast<std::int32_t>(difference)); }

/// Bits of a float such that neighbouring values have neighbouring numbers, and back.
std::uint32_t Ordered(std::uint32_t bits) { return (bits & kSign) != 0 ? kSign - (bits & ~kSign) - 1 : bits | kSign; }
std::uint32_t Bits(std::uint32_t ordered) {
  return (ordered & kSign) != 0 ? ordered & ~kSign : (kSign - 1 - ordered) | kSign;
}

/// The largest value that is rounded to steps.
float LargestOf(float step) { return kMostSteps * step; }
/// The nearest whole number: the low bits of a sum so large that nothing behind the point remains.
std::int32_t Whole(double steps) {
  constexpr double kLarge = 0x1.8p52;
  return static_cast<std::int32_t>(std::bit_cast<std::uint64_t>(steps + kLarge));
}
float ValueOf(std::int32_t steps, double step) { return static_cast<float>(step * static_cast<double>(steps)); }

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
  std::array<char, 32> step{};
  const auto written = std::to_chars(step.data(), step.data() + step.size(), coding.step);
  (*metadata)[kHeadKey] = std::to_string(coding.head_B);
  (*metadata)[kValuesKey] = std::to_string(coding.values);
  (*metadata)[kStepKey] = std::string(step.data(), written.ptr);
}

std::optional<PointCoding> FindPointCoding(const std::map<std::string, std::string>& metadata) {
  PointCoding coding;
  if (!Parse(metadata, kHeadKey, &coding.head_B) || !Parse(metadata, kValuesKey, &coding.values) ||
      !Parse(metadata, kStepKey, &coding.step)) {
    return std::nullopt;
  }
  const bool good = coding.head_B <= PointCoding::kMostHead_B && coding.values <= PointCoding::kMostValues &&
                    coding.step >= 0 && coding.step <= PointCoding::kMostStep;
  return good ? std::optional(coding) : std::nullopt;
}

float RoundedTo(float step, float value) {
  if (!(step > 0 && std::abs(value) <= LargestOf(step))) return value;
  return ValueOf(Whole(1 / static_cast<double>(step) * static_cast<double>(value)), static_cast<double>(step));
}

float PointCoder::TakeWords(std::span<const std::uint8_t> array) {
  const auto bits_of = [&array](std::size_t i) {
    std::uint32_t bits = 0;
    std::memcpy(&bits, array.data() + sizeof bits * i, sizeof bits);
    return bits;
  };
  std::size_t count = coding_.values;
  while (count > 0 && bits_of(count - 1) == 0) --count;
  words_.resize(count);
  // Compared as bits, which are larger for a NaN than for any number.
  std::uint32_t largest = 0;
  for (std::size_t i = 0; i < count; ++i) largest = std::max(largest, bits_of(i) & ~kSign);
  if (coding_.step > 0 && largest <= std::bit_cast<std::uint32_t>(LargestOf(coding_.step))) {
    const double per_step = 1 / static_cast<double>(coding_.step);
    for (std::size_t i = 0; i < count; ++i) {
      words_[i] = static_cast<std::uint32_t>(Whole(per_step * static_cast<double>(std::bit_cast<float>(bits_of(i)))));
    }
    return coding_.step;
  }
  for (std::size_t i = 0; i < count; ++i) words_[i] = Ordered(bits_of(i));
  return 0;
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
  const auto put_head = [&](float step, std::uint32_t kind, std::size_t count, std::size_t B) {
    const std::size_t head_B = std::min(coding_.head_B, message.size());
    to.Bytes(message.data(), head_B);
    coded->resize(coded->size() + coding_.head_B - head_B);
    to.Bytes(&step, sizeof step);
    to.Number(kind);
    to.Number(static_cast<std::uint32_t>(count));
    to.Number(static_cast<std::uint32_t>(B));
  };
  if (message.size() != coding_.message_B()) {
    put_head(0, kAsSent, 0, message.size());
    to.Bytes(message.data(), message.size());
    return;
  }
  const float step = TakeWords(message.subspan(coding_.head_B));
  if (step != last_step_) Restart();
  const std::uint32_t kind = Choose();
  const auto planes = static_cast<std::size_t>((std::bit_width(Predict(kind)) + 7) / 8);
  const std::size_t count = words_.size();
  put_head(step, kind, count, planes * count);
  const std::size_t at = coded->size();
  coded->resize(at + planes * count);
  for (std::size_t plane = 0; plane < planes; ++plane) {
    std::uint8_t* const bytes = coded->data() + at + plane * count;
    for (std::size_t i = 0; i < count; ++i) bytes[i] = static_cast<std::uint8_t>(residuals_[i] >> (8 * plane));
  }
  last_.swap(words_);
  last_step_ = step;
}

bool PointCoder::Decode(std::span<const std::uint8_t> coded, std::vector<std::uint8_t>* message) {
  ByteReader from(coded);
  const std::span<const std::uint8_t> head = from.Take(coding_.head_B);
  const auto step = std::bit_cast<float>(from.Number<std::uint32_t>());
  const auto kind = from.Number<std::uint32_t>();
  const std::size_t count = from.Number<std::uint32_t>();
  const std::span<const std::uint8_t> bytes = from.Take(from.Number<std::uint32_t>());
  if (from.good() && kind == kAsSent) {
    message->assign(bytes.begin(), bytes.end());
    return true;
  }
  const std::size_t planes = count == 0 ? 0 : bytes.size() / count;
  const bool refers = kind != kKey;
  const bool is_complete = from.good() && kind < kAsSent && count <= coding_.values &&
                           planes <= sizeof(std::uint32_t) && planes * count == bytes.size();
  const bool has_base = !refers || (!last_.empty() && last_.size() == count && last_step_ == step);
  if (!is_complete || !has_base || !(step == 0 || step == coding_.step)) {
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
  message->assign(coding_.message_B(), 0);
  std::copy(head.begin(), head.end(), message->begin());
  for (std::size_t i = 0; i < count; ++i) {
    const float value = step > 0 ? ValueOf(static_cast<std::int32_t>(words_[i]), static_cast<double>(step))
                                 : std::bit_cast<float>(Bits(words_[i]));
    std::memcpy(message->data() + coding_.head_B + sizeof value * i, &value, sizeof value);
  }
  last_.swap(words_);
  last_step_ = step;
  return true;
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
