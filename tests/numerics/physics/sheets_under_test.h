// The accurate mode with contact of sheets with each other.
#pragma once

#include <vector>

#include "physics_node/collision/sheet_collision.h"
#include "tests/numerics/physics/accurate_under_test.h"

namespace fulcrum::physics {

class SheetsUnderTest final : public AccurateUnderTest {
 public:
  explicit SheetsUnderTest(const SceneView& scene)
      : AccurateUnderTest(scene), collision_(scene, &tissue_, &particles_) {}

 private:
  void FindPairs(std::span<const float> moved) override { collision_.FindPairs(moved); }
  std::span<ContactRow> Contacts(float part) override {
    rows_.clear();
    collision_.FindRows(part);
    collision_.JoinRows(&rows_);
    return rows_;
  }
  void Stop() override {
    AccurateUnderTest::Stop();
    collision_.Restart();
  }
  void TopologyChanged() override {
    AccurateUnderTest::TopologyChanged();
    collision_.Follow();
  }

  SheetCollision collision_;
  std::vector<ContactRow> rows_;
};

}  // namespace fulcrum::physics
