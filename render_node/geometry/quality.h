// Resolution of the scene: the picture keeps its size and its text, the scene may be drawn with fewer pixels, or on a
// GPU with more, whose means smooth the edges. Pure.
#pragma once

#include <array>
#include <cstddef>
#include <string_view>

namespace fulcrum::render {

enum class Quality { kAuto, kLow, kHigh };

/// "auto", "low" or "high". Throws InputError for anything else.
[[nodiscard]] Quality QualityFromName(std::string_view name);

/// Chooses the scene's share of the picture's width and height. With kAuto it depends on the drawing time: one step
/// down if the median of the last pictures exceeds the budget, one step up if the finer step would still stay below it.
/// The first picture is drawn coarsely, because a session waits for it after a restart. Scales above 1 have a budget of
/// their own, so that a fast display keeps its rate.
class QualityControl {
 public:
  /// `height` of the picture [pixels]: the scene never has fewer than 270 lines, or as many as the picture; nor fewer
  /// than 374 at a scale below 0.52. `smooth`: scales above 1 are used.
  QualityControl(Quality quality, int height, bool smooth = false);

  /// Four by four samples a pixel, which four bilinear samples average exactly (shaders/smooth.frag).
  static constexpr float kMostScale = 4;

  /// The picture has another height [pixels]. With kAuto the scene gets no more lines than it had, as far as there is a
  /// scale for it; finer steps follow as above.
  void SetHeight(int height);
  /// Adds the drawing time of one picture [ms].
  void Add(double draw_ms);
  /// Largest scale at the present height: 1, or up to kMostScale while the scene has at most 3,060 lines.
  [[nodiscard]] float most() const { return kScales[first_step_]; }
  [[nodiscard]] float scale() const { return kScales[first_ ? last_step_ : step_]; }

 private:
  [[nodiscard]] double BudgetOf(std::size_t step) const;
  [[nodiscard]] double CostOfFiner(std::size_t step) const;

  // Above 1 each step has half of the pixels of the one before, from 1 on about 0.7.
  static constexpr std::size_t kFull = 4;
  static constexpr std::array<float, 17> kScales{kMostScale, 2.83f, 2.0f,  1.41f, 1.0f,  0.85f, 0.72f, 0.61f, 0.52f,
                                                 0.44f,      0.37f, 0.31f, 0.26f, 0.22f, 0.19f, 0.16f, 0.13f};
  static constexpr std::size_t kWindow = 9;

  Quality quality_;
  bool smooth_;
  std::size_t first_step_ = kFull;  // Finest step.
  int height_ = 0;
  bool first_;  // The next picture is drawn coarsely and not counted.
  std::size_t step_ = kFull;
  std::size_t last_step_ = kFull;  // Coarsest step with enough lines.
  std::array<double, kWindow> cost_ms_{};
  std::size_t count_ = 0;
  int calm_ = 0;  // Consecutive windows that would permit a finer step.
};

}  // namespace fulcrum::render
