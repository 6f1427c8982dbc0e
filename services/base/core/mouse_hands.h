// Mouse and keyboard, or a touch screen, as an operator's hands: motions of the pointer move the tip of one tool in the
// picture's plane, the wheel moves it along the view, buttons and keys close the jaw and press the pedals. Used by the
// window (render_node) and by the page (services/session/console). Pure; times are passed in.
#pragma once

#include <array>
#include <cstdint>

#include "services/base/core/messages.h"

namespace fulcrum {

/// What the hands need of the picture, frame W.
struct HandsView {
  Vec3f eye = Vec3f::Zero();                          ///< [m]
  Vec3f right = Vec3f::UnitX(), up = Vec3f::UnitZ();  ///< Unit vectors of the picture.
  Vec3f forward = Vec3f::UnitY();                     ///< Unit vector of the view.
  float pixel = 1e-3f;                                ///< Size of a pixel at 1 m [m].
  std::array<bool, kMaxTools> present{};              ///< The session has this tool, and a person operates it.
  std::array<bool, kMaxTools> scope{};                ///< It is a scope: its motion moves the picture.
  std::array<Vec3f, kMaxTools> tip = AtOrigin();      ///< Newest places of the tips [m].
  std::array<float, kMaxTools> roll_rad{};            ///< Newest rolls about the shafts [rad].
  std::array<bool, kMaxTools> closed{};               ///< The jaw is closed; of a scope: zoomed.
  std::array<float, kMaxTools> force_N{};             ///< Forces at the tips [N].
};

enum class HandsKey {
  kTool0,
  kTool1,
  kTool2,
  kTool3,
  kJaw,
  kJawLock,
  kCut,
  kCoag,
  kClutch,
  kDepth,
  kFine,
  kSteady,
  kRollLeft,
  kRollRight
};

/// An angle at which HandsView::closed is true: below the half of a jaw's way, or above that of a scope's zoom ring.
[[nodiscard]] bool IsClosed(float jaw_rad, bool scope);

class MouseHands {
 public:
  explicit MouseHands(OperatorSource source) : source_(source) {}

  /// A tool that was not there before begins where it is.
  void SetView(const HandsView& view);

  /// Takes the controls: the tools begin where they are, turned as they are, and closed jaws are locked.
  void Take(std::int64_t now_ns);
  /// Releases them: pedals up, tools let go.
  void Release();
  [[nodiscard]] bool active() const { return claim_ns_ != 0; }
  /// Tool that the pointer moves.
  [[nodiscard]] int tool() const { return tool_; }
  [[nodiscard]] bool steady() const { return steady_; }
  [[nodiscard]] bool locked(int tool) const { return locked_[static_cast<std::size_t>(tool)]; }

  // No effect while the controls are released.
  /// Motion of the pointer [pixels], x to the right, y up.
  void Move(float x, float y);
  /// Steps of the wheel, positive away from the operator.
  void Turn(int steps);
  /// Turns the tool about its shaft [rad], clockwise as seen from the handle; kRollLeft and kRollRight do the same in
  /// steps of 5 degrees.
  void Roll(float by_rad);
  /// Motion of the tip: to the right and up in the picture, and along the view [m].
  void Push(const Vec3f& by);
  void Press(HandsKey key, bool down);

  /// The present intention. @param now_ns CLOCK_MONOTONIC [ns].
  [[nodiscard]] OperatorInput At(std::int64_t now_ns);

 private:
  void MoveTip(const Vec3f& by);
  void Choose(int tool);

  OperatorSource source_;
  HandsView view_;
  std::int64_t claim_ns_ = 0;
  int tool_ = 1;
  bool jaw_down_ = false, clutch_ = false, depth_ = false, fine_ = false, steady_ = false;
  std::uint8_t pedals_ = kPedalNone;
  std::array<bool, kMaxTools> locked_{};
  std::array<Vec3f, kMaxTools> wanted_ = AtOrigin(), sent_ = AtOrigin();
  std::array<float, kMaxTools> roll_{};
  std::int64_t sent_ns_ = 0;
};

}  // namespace fulcrum
