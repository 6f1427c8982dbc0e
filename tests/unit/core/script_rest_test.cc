#include "services/base/core/script_rest.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "services/base/core/operator_script.h"

namespace fulcrum {
namespace {

bool Same(const ScriptPoint& a, const ScriptPoint& b) {
  return a.p_W == b.p_W && a.jaw_rad == b.jaw_rad && a.pedals == b.pedals && a.power_W == b.power_W &&
         a.roll_rad == b.roll_rad;
}

TEST(ScriptRest, EndsWhereTheScriptFirstGivesSomethingElse) {
  std::mt19937 random(7);
  int rests = 0, moves = 0;
  for (int run = 0; run < 100; ++run) {
    // Keys that repeat the last one as often as not, in each of their parts.
    std::vector<ScriptKey> script;
    const auto half = [&] { return random() % 2 == 0; };
    ScriptKey key{0.5f, 1, Vec3f::Zero(), 0, 0, 0};
    for (int k = 0; k < 8; ++k) {
      if (half() && half()) key.p_W.x() += 0.01f;
      if (half() && half()) key.jaw_rad += 0.1f;
      if (half() && half()) key.pedals ^= 1u;
      if (half() && half() && half()) key.roll_rad += 0.1f;
      script.push_back(key);
      key.time_s += 0.25f;
    }
    for (const double time_s : {0.0, 0.6, 1.13, 1.77, 2.9}) {
      const ScriptPoint now = EvaluateScript(script, 1, time_s);
      const double until_s = ScriptRestsUntil(script, 1, time_s);
      double changes_s = INFINITY;
      for (double t = time_s; t < 3 && std::isinf(changes_s); t += 1e-3) {
        if (!Same(EvaluateScript(script, 1, t), now)) changes_s = t;
      }
      if (std::isinf(changes_s)) {
        EXPECT_TRUE(std::isinf(until_s)) << until_s;
        ++rests;
        continue;
      }
      // A motion begins with speed 0: for some milliseconds a float does not show it.
      EXPECT_LE(until_s, changes_s);
      EXPECT_TRUE(until_s <= time_s || until_s > changes_s - 0.02) << until_s;
      moves += until_s <= time_s ? 1 : 0;
    }
  }
  EXPECT_GT(rests, 30);
  EXPECT_GT(moves, 30);
  EXPECT_TRUE(std::isinf(ScriptRestsUntil({}, 0, 1.0)));
}

}  // namespace
}  // namespace fulcrum
