// Traction tears the membrane at the stretch limit of the scene, on any mesh, and torn tissue separates.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <string>

#include "tests/numerics/cut/strip_pull.h"

namespace fulcrum::cut {
namespace {

constexpr float kMeshes_m[] = {0.002f, 0.0013333f, 0.001f};
constexpr float kMostError = 0.10f, kMostSpread = 0.05f;

/// Range of the onsets on the three meshes.
struct Onsets {
  float least = 1e9f, most = 0;
  void Add(float stretch) {
    least = std::min(least, stretch);
    most = std::max(most, stretch);
  }
};

TEST(Tear, WhatIsStretchedEvenlyTearsAtTheSetStretchOnAnyMesh) {
  for (const float limit : {1.8f, 3.1f}) {
    Onsets onsets;
    for (const float h_m : kMeshes_m) {
      SCOPED_TRACE("limit " + std::to_string(limit) + ", mesh of " + std::to_string(h_m));
      const StripResult result =
          PullStrip({.h_m = h_m, .tear_stretch = limit, .guided = true, .after_s = 0, .most_s = 10});
      ASSERT_TRUE(result.torn);
      EXPECT_EQ(result.fault, "");
      EXPECT_NEAR(result.stretch, limit, kMostError * limit);
      onsets.Add(result.stretch);
    }
    EXPECT_LE(onsets.most - onsets.least, kMostSpread * onsets.most);
    std::printf("evenly, limit %.1f: tears at %.3f to %.3f\n", static_cast<double>(limit),
                static_cast<double>(onsets.least), static_cast<double>(onsets.most));
  }
}

TEST(Tear, AClampedStripTearsAtItsMostStretchedPlaceAndComesApart) {
  Onsets onsets;
  for (const float h_m : kMeshes_m) {
    SCOPED_TRACE("mesh of " + std::to_string(h_m));
    const StripResult result = PullStrip({.h_m = h_m});
    std::printf(
        "clamped, mesh %.2f mm: tears at %.3f, %u edges torn, %u severed, apart after %.2f s, still after %.2f s\n",
        1e3 * static_cast<double>(h_m), static_cast<double>(result.stretch), result.torn_edges, result.severed_edges,
        result.apart_s, result.still_s);
    ASSERT_TRUE(result.torn);
    EXPECT_TRUE(result.finite);
    EXPECT_EQ(result.fault, "");
    EXPECT_LE(result.stretch, 1.8f) << "the largest stretch exceeds the average";
    EXPECT_GE(result.apart_s, 0);
    EXPECT_LE(result.apart_s, 1.0);
    EXPECT_GE(result.still_s, 0) << "the halves come to rest";
    EXPECT_GE(result.severed_edges, result.torn_edges);
    onsets.Add(result.stretch);
  }
  EXPECT_LE(onsets.most - onsets.least, kMostSpread * onsets.most);
}

TEST(Tear, PrestrainCountsAsStretch) {
  const StripResult result = PullStrip({.guided = true, .prestrain = 0.04f, .after_s = 0});
  EXPECT_NEAR(result.stretch, 1.8f, kMostError * 1.8f);
}

TEST(Tear, NeverWithALimitOfZero) { EXPECT_FALSE(PullStrip({.tear_stretch = 0, .most_s = 3}).torn); }

}  // namespace
}  // namespace fulcrum::cut
