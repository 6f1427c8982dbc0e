#include "render_node/input/window_keys.h"

#include <X11/keysym.h>

#include <map>

namespace fulcrum::render {

std::optional<HandsKey> HandsKeyOf(std::span<const unsigned long> symbols) {
  static const std::map<unsigned long, HandsKey> kKeys{
      {XK_1, HandsKey::kTool0},         {XK_2, HandsKey::kTool1},         {XK_3, HandsKey::kTool2},
      {XK_4, HandsKey::kTool3},         {XK_KP_1, HandsKey::kTool0},      {XK_KP_2, HandsKey::kTool1},
      {XK_KP_3, HandsKey::kTool2},      {XK_KP_4, HandsKey::kTool3},      {XK_q, HandsKey::kRollLeft},
      {XK_e, HandsKey::kRollRight},     {XK_j, HandsKey::kJaw},           {XK_k, HandsKey::kJawLock},
      {XK_f, HandsKey::kCut},           {XK_g, HandsKey::kCoag},          {XK_space, HandsKey::kClutch},
      {XK_Control_L, HandsKey::kDepth}, {XK_Control_R, HandsKey::kDepth}, {XK_Shift_L, HandsKey::kFine},
      {XK_Shift_R, HandsKey::kFine},    {XK_v, HandsKey::kSteady}};
  for (const unsigned long symbol : symbols) {
    if (const auto found = kKeys.find(symbol); found != kKeys.end()) return found->second;
  }
  return std::nullopt;
}

}  // namespace fulcrum::render
