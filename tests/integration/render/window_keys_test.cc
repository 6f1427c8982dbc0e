#include "render_node/input/window_keys.h"

#include <X11/keysym.h>
#include <gtest/gtest.h>

#include <array>

namespace fulcrum::render {
namespace {

using Symbols = std::array<unsigned long, 2>;

TEST(WindowKeys, DigitsAreFoundWhereverTheKeyboardHasThem) {
  EXPECT_EQ(HandsKeyOf(Symbols{XK_1, XK_exclam}), HandsKey::kTool0) << "us";
  EXPECT_EQ(HandsKeyOf(Symbols{XK_ampersand, XK_1}), HandsKey::kTool0) << "fr";
  EXPECT_EQ(HandsKeyOf(Symbols{XK_ecaron, XK_2}), HandsKey::kTool1) << "cz";
  EXPECT_EQ(HandsKeyOf(Symbols{XK_KP_Page_Down, XK_KP_3}), HandsKey::kTool2) << "keypad";
  EXPECT_EQ(HandsKeyOf(Symbols{XK_j, XK_J}), HandsKey::kJaw);
  EXPECT_EQ(HandsKeyOf(Symbols{XK_KP_Home, XK_KP_7}), std::nullopt);
  EXPECT_EQ(HandsKeyOf(Symbols{XK_x, XK_X}), std::nullopt);
}

}  // namespace
}  // namespace fulcrum::render
