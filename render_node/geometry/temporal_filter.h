// Smooth edges at one sample a pixel, where nothing moves: the mean of the last pictures of the scene, each of which
// shows it at another place within a pixel (temporal anti-aliasing), with more pixels than a single picture has.
//
// The places repeat after a period. Where each picture of the last period equals the one a period before it, nothing
// has moved in that time, and the mean of the period is shown; elsewhere the picture alone. So what moves is not
// smeared and does not follow late. Differences of less than 8 of 255 do not count as motion: such slow changes of
// colour follow over a period. What is shown depends on the pictures of two periods only. Pure; integers and single
// products, so every CPU gives the same bytes.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "services/base/core/types.h"

namespace fulcrum::render {

/// Shift of the n-th picture within its pixels, from 0 on, right and up: a sequence of low discrepancy with the mean 0.
[[nodiscard]] Vec2f JitterOf(int n, int period);
/// Number of pictures that have about eight samples in each pixel of the mean, at `scale` pixels of theirs for one of
/// its in both directions.
[[nodiscard]] int JitterPeriod(float scale);

class TemporalFilter {
 public:
  /// Sizes of the mean and of the pictures [pixels]. Forgets all pictures.
  void SetSize(int width, int height, int picture_width, int picture_height);
  /// Forgets all pictures: what comes is seen by another camera.
  void Forget();

  /// Shift of the next picture [its pixels].
  [[nodiscard]] Vec2f jitter() const { return JitterOf(known_ % period_, period_); }
  [[nodiscard]] int period() const { return period_; }
  /// Pixels of the next picture, to be written before Add(): four bytes each, red first in memory, from the bottom up.
  [[nodiscard]] std::span<std::uint32_t> picture() { return next_; }
  /// Takes the next picture. @param still nothing but the jitter has changed in the last period() pictures.
  void Add(bool still);
  /// What is to be shown, pixels as above.
  [[nodiscard]] std::span<const std::uint32_t> shown() const { return shown_; }

 private:
  /// Of one place within a pixel: for each column or row of the mean the nearest one of the picture, and the two
  /// between which the picture is interpolated. For each channel the weight of the nearest, and the share of the second
  /// of the two [of 256].
  struct Axis {
    std::vector<int> nearest, first, second;
    std::vector<std::uint16_t> weight, share;
  };
  struct Phase {
    Axis x, y;
    std::vector<std::uint32_t> picture;  // The last one of this place.
  };
  static Axis MakeAxis(int count, int samples, float jitter);
  void FindChanges(const std::vector<std::uint32_t>& before);
  void AddRows(int from_y, int to_y, const Phase& phase);
  void AddWeighted(int y, int x, int count, const Phase& phase);
  void Interpolate(std::size_t line, const Phase& phase, std::span<std::uint8_t> to) const;
  void ShowMean(int y, int x, int count);
  void ShowAlone(int y, int x, int count, const Phase& phase, std::span<const std::uint8_t> row);

  int width_ = 0, height_ = 0, picture_width_ = 0, picture_height_ = 0, period_ = 1;
  int known_ = 0;  // Pictures since the last Forget().
  std::vector<Phase> phases_;
  std::vector<std::uint32_t> next_, shown_;
  std::vector<std::int32_t> sums_;     // Of the phases' pictures times their weights, four channels a pixel.
  std::vector<float> per_weight_;      // 1 / the sum of the weights, for each pixel of the mean.
  std::vector<std::uint8_t> changes_;  // Of the picture's pixels and their neighbours: kSame …
  // Of the picture's pixels: number of pictures in a row that show the same as a period before, up to period_. A thing
  // that covers a pixel in one picture only is in the mean until that picture's place comes again.
  std::vector<std::uint8_t> since_;
  std::vector<std::uint8_t> own_, across_;  // Scratch of FindChanges: of each pixel itself, of it and those beside it.
  std::vector<std::uint8_t> was_alone_;     // Of blocks of the mean: shows the last picture alone somewhere.
};

}  // namespace fulcrum::render
