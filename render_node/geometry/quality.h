// How finely the scene is drawn: the picture keeps its size and its text, the scene beneath may have fewer pixels.
// Pure.
#pragma once

#include <array>
#include <cstddef>
#include <string_view>

namespace fulcrum::render {

enum class Quality { kAuto, kLow, kHigh };

/// "auto", "low" or "high". Throws InputError for anything else.
[[nodiscard]] Quality QualityFromName(std::string_view name);

/// Chooses the scene's share of the picture's width and height. With kAuto it goes by what pictures cost: down a step
/// when the median of the last ones is above the budget, up when a step more would still stay below it. The very first
/// picture is drawn coarsely: somebody waits for it, after a restart in mid-operation.
class QualityControl {
 public:
  /// `height` of the picture [pixels]: the scene never has fewer than 270 lines, or as many as the picture.
  QualityControl(Quality quality, int height);

  /// Cost of one picture [ms].
  void Add(double draw_ms);
  [[nodiscard]] float scale() const { return kScales[first_ ? last_step_ : step_]; }

 private:
  // Each has about 0.7 of the pixels of the one before.
  static constexpr std::array<float, 5> kScales{1.0f, 0.85f, 0.72f, 0.61f, 0.52f};
  static constexpr std::size_t kWindow = 9;

  bool automatic_;
  bool first_;
  std::size_t step_ = 0;
  std::size_t last_step_ = 0;  // The coarsest that is still legible.
  std::array<double, kWindow> cost_ms_{};
  std::size_t count_ = 0;
  int calm_ = 0;  // Windows in a row that would permit a finer step.
};

}  // namespace fulcrum::render
