#include "render_node/geometry/temporal_filter.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <thread>
#include <utility>

#include "render_node/geometry/texel.h"

namespace fulcrum::render {
namespace {

constexpr float kSamplesInPixel = 8;           // In a pixel of the mean, of a period.
constexpr int kLongestPeriod = 64;             // At a scale of 0.35; of coarser pictures the mean has fewer samples.
constexpr std::uint32_t kMoved = 0xf8f8f8f8u;  // A channel that differs by 8 or more has one of these bits.
enum Change : std::uint8_t { kSame, kSlight, kMovedOn };  // Slight: less than that; no edge has passed.
constexpr int kSpan = 32;  // Pixels of a row that are skipped together where nothing has changed.

}  // namespace

Vec2f JitterOf(int n, int period) {
  // Roberts' sequence R2, without the mean of a period, by which the picture would be shifted.
  const auto place = [](int k) {
    const Vec2d at = (k + 1.0) * Vec2d(0.7548776662466927, 0.5698402909980532);
    return Vec2d(at.x() - std::floor(at.x()), at.y() - std::floor(at.y()));
  };
  Vec2d mean = Vec2d::Zero();
  for (int k = 0; k < period; ++k) mean += place(k) / period;
  return (place(n % period) - mean).cast<float>();
}

int JitterPeriod(float scale) {
  const float pictures = kSamplesInPixel / std::max(1e-3f, scale * scale);
  return std::clamp(static_cast<int>(std::lround(std::min(pictures, 1e3f))), static_cast<int>(kSamplesInPixel),
                    kLongestPeriod);
}

TemporalFilter::Axis TemporalFilter::MakeAxis(int count, int samples, float jitter) {
  const float scale = static_cast<float>(samples) / static_cast<float>(count);
  Axis axis;
  for (int k = 0; k < count; ++k) {
    // What lies at the middle of the pixel is at this place of the picture.
    const float at = (static_cast<float>(k) + 0.5f) * scale + jitter;
    const int nearest = std::clamp(static_cast<int>(std::floor(at)), 0, samples - 1);
    const float off = std::abs(static_cast<float>(nearest) + 0.5f - at) / scale;  // [pixels of the mean]
    axis.nearest.push_back(nearest);
    // Whole within the pixel, a tenth of it where the nearest sample is farther away.
    const auto weight = static_cast<std::uint16_t>(std::lround(10 * std::clamp((0.8f - off) / 0.3f, 0.1f, 1.0f)));
    axis.weight.insert(axis.weight.end(), 4, weight);
    const float between = at - 0.5f;
    const int first = static_cast<int>(std::floor(between));
    axis.first.push_back(std::clamp(first, 0, samples - 1));
    axis.second.push_back(std::clamp(first + 1, 0, samples - 1));
    axis.share.insert(axis.share.end(), 4,
                      static_cast<std::uint16_t>(std::lround(256 * (between - std::floor(between)))));
  }
  return axis;
}

void TemporalFilter::SetSize(int width, int height, int picture_width, int picture_height) {
  width_ = width;
  height_ = height;
  picture_width_ = picture_width;
  picture_height_ = picture_height;
  period_ = JitterPeriod(static_cast<float>(picture_height) / static_cast<float>(height));
  const std::size_t pixels = TexelIndex(0, height, width), of_picture = TexelIndex(0, picture_height, picture_width);
  next_.assign(of_picture, 0);
  for (std::vector<std::uint8_t>* each : {&changes_, &since_, &own_, &across_}) each->assign(of_picture, kSame);
  shown_.assign(pixels, 0);
  sums_.assign(4 * pixels, 0);
  was_alone_.assign(TexelIndex(0, height, (width + kSpan - 1) / kSpan), 1);
  std::vector<int> weights(pixels, 0);
  phases_.clear();
  for (int n = 0; n < period_; ++n) {
    const Vec2f jitter = JitterOf(n, period_);
    Phase phase{MakeAxis(width, picture_width, jitter.x()), MakeAxis(height, picture_height, jitter.y()),
                std::vector<std::uint32_t>(of_picture, 0)};
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        weights[TexelIndex(x, y, width)] +=
            phase.x.weight[4 * static_cast<std::size_t>(x)] * phase.y.weight[4 * static_cast<std::size_t>(y)];
      }
    }
    phases_.push_back(std::move(phase));
  }
  per_weight_.clear();
  for (const int weight : weights) per_weight_.push_back(1 / static_cast<float>(weight));
  Forget();
}

void TemporalFilter::Forget() {
  known_ = 0;
  std::ranges::fill(since_, std::uint8_t{0});
}

// For each pixel of the picture the largest change from `before` among it and its neighbours. One that has moved within
// the last period counts as moving, though it may show the same as a period before: the mean still has what it showed.
void TemporalFilter::FindChanges(const std::vector<std::uint32_t>& before) {
  const auto width = static_cast<std::size_t>(picture_width_);
  for (std::size_t k = 0; k < next_.size(); ++k) {
    const std::uint32_t a = next_[k], b = before[k];
    std::uint32_t most = 0;
    for (int shift = 0; shift < 24; shift += 8) {
      const auto d = static_cast<int>(a >> shift & 0xff) - static_cast<int>(b >> shift & 0xff);
      most |= static_cast<std::uint32_t>(d < 0 ? -d : d);
    }
    const int same = (most & kMoved) != 0 ? 0 : std::min(since_[k] + 1, period_);
    since_[k] = static_cast<std::uint8_t>(same);
    own_[k] = same < period_ ? kMovedOn : most != 0 ? kSlight : kSame;
  }
  across_ = own_;
  for (std::size_t k = 1; k + 1 < own_.size(); ++k) across_[k] = std::max(std::max(own_[k - 1], own_[k]), own_[k + 1]);
  changes_ = across_;
  for (std::size_t k = width; k + width < own_.size(); ++k) {
    changes_[k] = std::max(std::max(across_[k - width], across_[k]), across_[k + width]);
  }
}

void TemporalFilter::Add(bool still) {
  Phase& phase = phases_[static_cast<std::size_t>(known_ % period_)];
  if (known_ == 0) {
    for (Phase& each : phases_) std::ranges::fill(each.picture, 0);
    std::ranges::fill(sums_, 0);
  }
  if (still || known_ < period_) {
    // The mean is complete, or not.
    const bool complete = still && known_ + 1 >= period_;
    std::ranges::fill(changes_, static_cast<std::uint8_t>(complete ? kSlight : kMovedOn));
    if (complete) std::ranges::fill(since_, static_cast<std::uint8_t>(period_));
  } else {
    FindChanges(phase.picture);
  }
  {
    // The rasteriser's threads are idle now.
    const std::jthread lower([&] { AddRows(0, height_ / 2, phase); });
    AddRows(height_ / 2, height_, phase);
  }
  std::swap(phase.picture, next_);
  ++known_;
  if (known_ == 2 * period_) known_ = period_;  // The same place, and the number stays small.
}

void TemporalFilter::AddRows(int from_y, int to_y, const Phase& phase) {
  std::vector<std::uint8_t> row(4 * static_cast<std::size_t>(picture_width_));  // Between two of the picture.
  const int blocks = (width_ + kSpan - 1) / kSpan;
  for (int y = from_y; y < to_y; ++y) {
    const auto line = static_cast<std::size_t>(y);
    const std::uint8_t* change = changes_.data() + TexelIndex(0, phase.y.nearest[line], picture_width_);
    bool interpolated = false;
    for (int block = 0; block < blocks; ++block) {
      const int from = kSpan * block, count = std::min(kSpan, width_ - from);
      const auto first = static_cast<std::size_t>(phase.x.nearest[static_cast<std::size_t>(from)]);
      const auto last = static_cast<std::size_t>(phase.x.nearest[static_cast<std::size_t>(from + count - 1)]);
      const auto [least, most] = std::minmax_element(change + first, change + last + 1);
      std::uint8_t& was_alone = was_alone_[TexelIndex(block, y, blocks)];
      if (*most == kSame && was_alone == 0) continue;
      was_alone = *most == kMovedOn ? 1 : 0;
      AddWeighted(y, from, count, phase);
      if (*least != kMovedOn) ShowMean(y, from, count);
      if (*most != kMovedOn) continue;
      if (!std::exchange(interpolated, true)) Interpolate(line, phase, row);
      ShowAlone(y, from, count, phase, row);
    }
  }
}

// Pixels are copied to their places in the row first, so that what follows runs on vectors.
void TemporalFilter::AddWeighted(int y, int x, int count, const Phase& phase) {
  const auto line = static_cast<std::size_t>(y), column = static_cast<std::size_t>(x);
  const std::size_t row = TexelIndex(0, phase.y.nearest[line], picture_width_);
  const int* nearest = phase.x.nearest.data() + column;
  std::array<std::uint32_t, kSpan> now{}, before{};
  for (std::size_t k = 0; k < static_cast<std::size_t>(count); ++k) {
    now[k] = next_[row + static_cast<std::size_t>(nearest[k])];
    before[k] = phase.picture[row + static_cast<std::size_t>(nearest[k])];
  }
  std::array<std::uint8_t, 4 * kSpan> a, b;
  std::memcpy(a.data(), now.data(), sizeof now);
  std::memcpy(b.data(), before.data(), sizeof before);
  const std::uint16_t weight_y = phase.y.weight[4 * line];
  const std::uint16_t* weight = phase.x.weight.data() + 4 * column;
  std::int32_t* sum = sums_.data() + 4 * TexelIndex(x, y, width_);
  for (std::size_t k = 0; k < 4 * static_cast<std::size_t>(count); ++k) {
    // At most 100 * 255.
    sum[k] += static_cast<std::int16_t>((a[k] - b[k]) * static_cast<std::int16_t>(weight[k] * weight_y));
  }
}

void TemporalFilter::Interpolate(std::size_t line, const Phase& phase, std::span<std::uint8_t> to) const {
  const auto row = [&](int y) {
    return reinterpret_cast<const std::uint8_t*>(next_.data() + TexelIndex(0, y, picture_width_));
  };
  const std::uint8_t *low = row(phase.y.first[line]), *high = row(phase.y.second[line]);
  const std::uint16_t up = phase.y.share[4 * line], down = static_cast<std::uint16_t>(256 - up);
  for (std::size_t k = 0; k < to.size(); ++k) {
    to[k] = static_cast<std::uint8_t>(static_cast<std::uint16_t>(low[k] * down + high[k] * up + 128) >> 8);
  }
}

void TemporalFilter::ShowMean(int y, int x, int count) {
  const std::size_t size = 4 * static_cast<std::size_t>(count), at = TexelIndex(x, y, width_);
  std::array<float, 4 * kSpan> factor{};
  for (std::size_t k = 0; k < size; ++k) factor[k] = per_weight_[at + k / 4];
  std::array<std::uint8_t, 4 * kSpan> mean{};
  const std::int32_t* sum = sums_.data() + 4 * at;
  for (std::size_t k = 0; k < size; ++k) {
    mean[k] = static_cast<std::uint8_t>(static_cast<int>(static_cast<float>(sum[k]) * factor[k] + 0.5f));
  }
  std::memcpy(&shown_[at], mean.data(), size);
}

void TemporalFilter::ShowAlone(int y, int x, int count, const Phase& phase, std::span<const std::uint8_t> row) {
  const auto line = static_cast<std::size_t>(y), column = static_cast<std::size_t>(x);
  const auto size = static_cast<std::size_t>(count);
  std::uint32_t* shown = &shown_[TexelIndex(x, y, width_)];
  std::array<std::uint32_t, kSpan> left{}, right{}, alone{};
  const std::uint8_t* change = changes_.data() + TexelIndex(0, phase.y.nearest[line], picture_width_);
  for (std::size_t k = 0; k < size; ++k) {
    std::memcpy(&left[k], &row[4 * static_cast<std::size_t>(phase.x.first[column + k])], 4);
    std::memcpy(&right[k], &row[4 * static_cast<std::size_t>(phase.x.second[column + k])], 4);
    alone[k] = change[phase.x.nearest[column + k]] == kMovedOn ? ~0u : 0u;
  }
  std::array<std::uint8_t, 4 * kSpan> a, b, single{};
  std::memcpy(a.data(), left.data(), sizeof left);
  std::memcpy(b.data(), right.data(), sizeof right);
  const std::uint16_t* share = phase.x.share.data() + 4 * column;
  for (std::size_t k = 0; k < 4 * size; ++k) {
    const auto rest = static_cast<std::uint16_t>(256 - share[k]);
    single[k] = static_cast<std::uint8_t>(static_cast<std::uint16_t>(a[k] * rest + b[k] * share[k] + 128) >> 8);
  }
  std::array<std::uint32_t, kSpan> pixels;
  std::memcpy(pixels.data(), single.data(), sizeof single);
  for (std::size_t k = 0; k < size; ++k) shown[k] = (pixels[k] & alone[k]) | (shown[k] & ~alone[k]);
}

}  // namespace fulcrum::render
