// Random burns: for any input from a hand, a bus or a disk nothing crashes, all numbers stay finite, and the topology
// agrees with the cells.
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <memory>
#include <random>
#include <span>
#include <vector>

#include "services/base/core/sanitizers.h"
#include "tests/numerics/thermal/flat_scene.h"
#include "tests/numerics/thermal/topology_validator.h"

namespace fulcrum::thermal {
namespace {

#if FULCRUM_SANITIZED
constexpr int kBurns = 300;
#else
constexpr int kBurns = 10'000;
#endif
constexpr int kBurnsPerSheet = 20;
constexpr float kSheet_m = 0.007f;

/// A sheet of 7 mm, sheared for every other seed, so that its border crosses cells.
scene::SceneData SmallScene(bool sheared) {
  scene::SceneData data = FlatScene(8, 8, 1e-3f);
  for (Vec2f& p : data.membrane_material) p.x() += sheared ? 0.4f * p.y() : 0.0f;
  data.protected_structures = {{ProtectedKind::kUreter, 0.002f, 0.001f, 0, 2}};
  data.protected_points = {{Vec3f::Zero(), Vec2f(0.002f, 0.003f)}, {Vec3f::Zero(), Vec2f(0.006f, 0.003f)}};
  return data;
}

class Fuzz {
 public:
  explicit Fuzz(std::uint32_t seed) : random_(seed) {}

  [[nodiscard]] float Between(float low, float high) {
    return std::uniform_real_distribution<float>(low, high)(random_);
  }
  [[nodiscard]] int Below(int count) { return std::uniform_int_distribution<int>(0, count - 1)(random_); }
  [[nodiscard]] bool OneIn(int count) { return Below(count) == 0; }
  [[nodiscard]] Vec2f Anywhere() { return {Between(-0.001f, 1.6f * kSheet_m), Between(-0.001f, kSheet_m + 0.001f)}; }
  [[nodiscard]] float Absurd() {
    constexpr float kInf = std::numeric_limits<float>::infinity();
    constexpr float kValues[] = {NAN, kInf, -kInf, 1e30f, -1e30f, 1e-38f, -1.0f, 2e9f, 0.0f};
    return kValues[Below(std::size(kValues))];
  }

  /// A contact of a burn, occasionally with an absurd value.
  [[nodiscard]] CauteryContact Contact(const Vec2f& at, const CauteryContact& burn) {
    CauteryContact contact = burn;
    contact.touching = !OneIn(30);
    contact.material = at;
    if (OneIn(60)) contact.material = Anywhere();
    if (OneIn(60)) contact.material.x() = Absurd();
    if (OneIn(60)) contact.material.y() = Absurd();
    if (OneIn(60)) contact.contact_radius_m = Absurd();
    // The footprint moves with the contact.
    contact.footprint.x += static_cast<std::int32_t>(1e4f * at.x());
    contact.footprint.y += static_cast<std::int32_t>(1e4f * at.y());
    if (OneIn(60)) contact.footprint.width = static_cast<std::uint32_t>(Below(2 * static_cast<int>(kFootprintCells)));
    if (OneIn(60)) contact.footprint.x = INT32_MAX - Below(99);
    if (OneIn(60)) contact.footprint.gap.resize(static_cast<std::size_t>(Below(8192)));
    if (OneIn(60)) contact.session_time_s = OneIn(2) ? NAN : static_cast<double>(Absurd());
    if (OneIn(60)) contact.material_rate = Vec2f::Constant(Absurd());
    return contact;
  }

 private:
  std::mt19937 random_;
};

/// Properties that must hold after every step. Only a damaged checkpoint makes tissue colder than the body.
void CheckState(const ThermalSolver& solver, float coldest = -1e-3f) {
  for (const Tile* tile : solver.field().awake()) {
    const TileState& s = tile->state;
    float sum = 0;
    for (int k = 0; k < kTileCells; ++k) {
      sum += std::abs(s.enthalpy[k]) * 1e-9f + s.water[k] + s.omega_cell[k] + s.omega_collagen[k] + s.charred[k];
    }
    ASSERT_TRUE(std::isfinite(sum));
    ASSERT_GE(tile->theta_min, coldest);
    ASSERT_LE(tile->theta_max, kThetaPlausible);
  }
  const Ledger& ledger = solver.ledger();
  ASSERT_TRUE(std::isfinite(ledger.joule + ledger.generator + ledger.Out()));
  ASSERT_TRUE(std::isfinite(solver.figures().power_W + solver.figures().present_C + solver.cut_length_m()));
  for (const SolverEvent& event : solver.events()) {
    ASSERT_TRUE(event.material.allFinite() && std::isfinite(event.temperature_C + event.value));
  }
}

/// One sheet with its solver, the tip's tracker and the checkpoint.
class Patient {
 public:
  explicit Patient(const SceneView& scene) : scene_(scene), slot_(ThermalSolver::CheckpointCapacity(scene)) { Fresh(); }

  void Fresh() {
    solver_ = std::make_unique<ThermalSolver>(scene_);
    tracker_ = std::make_unique<TipTracker>(solver_->field().sheet(), scene_.thermal.hook_radius_m);
    validator_ = std::make_unique<TopologyValidator>(scene_, solver_->field().sheet());
  }

  /// A straight burn of a few frames at random speed, power, mode and place.
  void Burn(Fuzz* fuzz) {
    CauteryContact burn;
    const GeneratorDemand demand{static_cast<CauteryMode>(1 + fuzz->Below(3)),
                                 fuzz->OneIn(5) ? kMaxSetPower_W : fuzz->Between(0, 80)};
    burn.contact_radius_m = fuzz->OneIn(5) ? fuzz->Between(0, 5e-3f) : fuzz->Between(2e-4f, 1e-3f);
    if (fuzz->OneIn(2)) SetMetal(fuzz, &burn);
    burn.tented = fuzz->OneIn(3);
    const float heading = fuzz->Between(-4, 4), speed = std::pow(10.0f, fuzz->Between(-3.5f, -0.5f));
    const Vec2f rate = speed * Vec2f(std::cos(heading), std::sin(heading));
    Vec2f at = fuzz->Anywhere();
    const float dt = fuzz->OneIn(10) ? fuzz->Between(1e-4f, 0.05f) : 0.01f;
    for (int frame = 1 + fuzz->Below(6); frame > 0; --frame) {
      // Each frame gets one sample, or none, or several at once.
      std::vector<TipInput> tips;
      for (int n = fuzz->OneIn(10) ? fuzz->Below(4) : 1; n > 0; --n, at += rate * dt) {
        time_s_ += fuzz->OneIn(50) ? static_cast<double>(fuzz->Between(-0.1f, 1.2f)) : static_cast<double>(dt);
        burn.session_time_s = time_s_;
        const CauteryContact contact = fuzz->Contact(at, burn);
        if (tracker_->Accepts(contact)) tips.push_back(tracker_->Advance(contact, demand, dt));
      }
      Step(tips, dt);
      if (::testing::Test::HasFatalFailure()) return;
    }
  }

  /// A piece of straight metal about (0, 0) at any slant, partly through the sheet; or random gaps.
  static void SetMetal(Fuzz* fuzz, CauteryContact* burn) {
    const int width = 1 + fuzz->Below(static_cast<int>(kFootprintCells)), height = 1 + fuzz->Below(width);
    const Vec2f along = Vec2f(fuzz->Between(-1, 1), fuzz->Between(-1, 1)).normalized();
    const float above_m = fuzz->Between(-2e-4f, 2e-4f);
    const bool senseless = fuzz->OneIn(4);
    burn->footprint = {-width / 2, -height / 2, static_cast<std::uint32_t>(width), {}};
    for (int j = 0; j < height; ++j) {
      for (int i = 0; i < width; ++i) {
        const Vec2f off = 1e-4f * Vec2f(static_cast<float>(i - width / 2), static_cast<float>(j - height / 2));
        const float across = std::abs(along.x() * off.y() - along.y() * off.x());
        burn->footprint.gap.push_back(senseless ? static_cast<std::uint8_t>(fuzz->Below(256))
                                                : Footprint::Encode(across - 5e-4f + above_m));
      }
    }
  }

  /// Pause, with the current off.
  void Rest(int frames) {
    time_s_ += 0.01 * frames;
    for (int n = 0; n < frames; ++n) Step({}, 0.01f);
  }

  /// Saves and continues from the checkpoint, with equal bits.
  void Restart() {
    while (solver_->topology().staged()) Step({}, 0.01f);
    const std::size_t bytes = solver_->Save(slot_);
    ASSERT_GT(bytes, 0u);
    const std::uint64_t before = solver_->FullHash();
    auto other = std::make_unique<ThermalSolver>(scene_);
    ASSERT_TRUE(other->Restore(std::span(slot_).first(bytes)));
    ASSERT_EQ(other->FullHash(), before);
    solver_ = std::move(other);
    // The old tracker refers to the sheet of the old solver.
    tracker_ = std::make_unique<TipTracker>(solver_->field().sheet(), scene_.thermal.hook_radius_m);
  }

  /// A damaged or truncated checkpoint is refused, or the solver continues from it.
  void RestartFromRuins(Fuzz* fuzz) {
    while (solver_->topology().staged()) Step({}, 0.01f);
    std::size_t bytes = solver_->Save(slot_);
    ASSERT_GT(bytes, 0u);
    for (int n = 1 + fuzz->Below(8); n > 0; --n) {
      // Half of them in the first part, which contains the counts and the topology.
      const int reach = static_cast<int>(fuzz->OneIn(2) ? std::min<std::size_t>(bytes, 20'000) : bytes);
      slot_[fuzz->Below(reach)] ^= static_cast<std::byte>(1 << fuzz->Below(8));
    }
    if (fuzz->OneIn(4)) bytes = fuzz->Below(static_cast<int>(bytes));
    ThermalSolver other(scene_);
    if (!other.Restore(std::span(slot_).first(bytes))) {
      ASSERT_EQ(other.FullHash(), ThermalSolver(scene_).FullHash());
      ++refused_;
      return;
    }
    TipInput tip;
    tip.active = true;
    tip.mode = CauteryMode::kCut;
    tip.power_W = 30;
    tip.path.radius_m = 5e-4f;
    tip.path.from = tip.path.to = {0.5f * kSheet_m, 0.5f * kSheet_m};
    for (int n = 0; n < 5; ++n) {
      other.Step(tip, 0.01f);
      CheckState(other, -kThetaPlausible);
    }
  }

  [[nodiscard]] const ThermalSolver& solver() const { return *solver_; }
  [[nodiscard]] int refused() const { return refused_; }

 private:
  void Step(std::span<const TipInput> tips, float dt_s) {
    solver_->Step(tips, dt_s);
    CheckState(*solver_);
    if (solver_->committed()) {
      ASSERT_EQ(validator_->Check(*solver_), "");
    }
  }

  const SceneView& scene_;
  std::vector<std::byte> slot_;
  std::unique_ptr<ThermalSolver> solver_;
  std::unique_ptr<TipTracker> tracker_;
  std::unique_ptr<TopologyValidator> validator_;
  double time_s_ = 0;
  int refused_ = 0;
};

TEST(ThermalFuzzTest, RandomBurnsLeaveNothingBadBehind) {
  std::uint64_t removed = 0, commits = 0;
  int refused = 0;
  for (int burn = 0; burn < kBurns; burn += kBurnsPerSheet) {
    SCOPED_TRACE("sheet of burn " + std::to_string(burn));
    Fuzz fuzz(burn);
    const scene::SceneData data = SmallScene(burn / kBurnsPerSheet % 2 == 1);
    const SceneView scene = data.View();
    Patient patient(scene);
    for (int n = 0; n < kBurnsPerSheet; ++n) {
      SCOPED_TRACE("burn " + std::to_string(burn + n));
      patient.Burn(&fuzz);
      if (fuzz.OneIn(10)) patient.Rest(fuzz.Below(20));
      if (fuzz.OneIn(10)) patient.Restart();
      if (fuzz.OneIn(20)) patient.RestartFromRuins(&fuzz);
      if (HasFatalFailure()) return;
    }
    ASSERT_LE(patient.solver().ledger().ClosureError(patient.solver().field().Stored()), 1e-4);
    ASSERT_EQ(patient.solver().field().quarantined(), 0u);
    commits += patient.solver().topology().revision();
    removed += patient.solver().topology().dead_edge_count();
    refused += patient.refused();
  }
  // Burns, cuts and damaged checkpoints did occur.
  EXPECT_GT(commits, kBurns / 10u);
  EXPECT_GT(removed, kBurns / 10u);
  EXPECT_GT(refused, kBurns / 200);
}

}  // namespace
}  // namespace fulcrum::thermal
