// Properties that must hold for any bytes as contact model: a servo in contact is offered arbitrary messages between
// good ones. The force stays finite, within its limit and its rate limit; a refused message does not change the state.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>

#include "tests/unit/haptics/rig.h"
#include "tests/unit/haptics/test_tissue.h"

namespace fulcrum::haptics::testing {

/// Bytes written over a valid message, which is numbers throughout.
struct Patch {
  std::size_t at = 0;
  std::span<const std::uint8_t> bytes;
};

class GateCheck {
 public:
  /// Valid message for the present time, from the tissue.
  [[nodiscard]] ContactModel Good() {
    ContactModel model;
    model.stamp = {sequence_, epoch_, TickAt(millisecond_).stamp_ns};
    model.tool_stamp_ns = TickAt(millisecond_).stamp_ns - 12'000'000;
    for (std::uint32_t i = 0; i < 2; ++i) {
      model.devices[0].contacts[i] = tissue_.Report();
      model.devices[0].contacts[i].id = i;
    }
    model.devices[0].count = 2;
    return model;
  }
  static void Apply(const Patch& patch, ContactModel* model) {
    auto* const bytes = reinterpret_cast<std::uint8_t*>(model);
    const std::size_t at = patch.at % sizeof(*model);
    std::memcpy(bytes + at, patch.bytes.data(), std::min(patch.bytes.size(), sizeof(*model) - at));
  }

  /// One millisecond with this message. False: a required property is violated.
  [[nodiscard]] bool Offer(const ContactModel& model) {
    const Tick tick = TickAt(millisecond_++);
    const std::uint64_t dropped = servo_.figures().models_dropped;
    servo_.OfferModel(model, tick.stamp_ns);
    servo_.Step(tick);
    const bool refused = servo_.figures().models_dropped > dropped;
    // The reference servo does not receive refused messages.
    if (!refused) twin_.OfferModel(model, tick.stamp_ns);
    twin_.Step(tick);
    // The next message follows the epoch and sequence that the gate has accepted last.
    sequence_ = servo_.record().model_sequence + 1;
    epoch_ = std::max(epoch_, servo_.record().model_epoch);
    refused_ += refused ? 1 : 0;
    offered_ += 1;
    const bool good = device_.force.allFinite() && device_.force.norm() <= 3.3f + kRounding &&
                      (device_.force - last_).norm() <= 0.4f + kRounding &&
                      servo_.record().state_hash == twin_.record().state_hash;
    last_ = device_.force;
    peak_ = std::max(peak_, last_.norm());
    return good;
  }

  [[nodiscard]] std::uint64_t offered() const { return offered_; }
  [[nodiscard]] std::uint64_t refused() const { return refused_; }
  [[nodiscard]] double peak_N() const { return peak_; }

 private:
  static constexpr double kRounding = 1e-9;
  static Vec3d Tip(double t) { return {0.002 * std::sin(3 * t), 0, -0.004 + 0.003 * std::sin(17 * t)}; }
  static TestTissue Pressed() {
    TestTissue tissue({});
    tissue.Place(Vec3d(0, 0, 0));
    for (int i = 0; i < 100; ++i) tissue.Step(Vec3d(0, 0, -0.004), 1e-3);
    return tissue;
  }

  TestTissue tissue_ = Pressed();
  GuidedDevice device_{BenchTrocar(), Tip}, twin_device_{BenchTrocar(), Tip};
  Servo servo_{ServoSettingsOf(BenchScene(1.0)), {&device_, nullptr}},
      twin_{ServoSettingsOf(BenchScene(1.0)), {&twin_device_, nullptr}};
  std::uint64_t millisecond_ = 100, epoch_ = 1, sequence_ = 1, offered_ = 0, refused_ = 0;
  Vec3d last_ = Vec3d::Zero();
  double peak_ = 0;
};

/// Brings the check's servo into contact with the tissue. False: valid messages alone violate a property.
[[nodiscard]] inline bool Press(GateCheck* check) {
  constexpr int kUntilForcesAreUp = 300;
  for (int i = 0; i < kUntilForcesAreUp; ++i) {
    if (!check->Offer(check->Good())) return false;
  }
  return true;
}

/// Reads `input` as a list of patches (place in two bytes, length in one, bytes) over good messages, one each tick.
[[nodiscard]] inline bool OfferPatches(std::span<const std::uint8_t> input, GateCheck* check) {
  while (input.size() >= 3) {
    const std::size_t at = input[0] + 256u * input[1];
    const std::size_t length = std::min<std::size_t>(input[2] % 32u, input.size() - 3);
    ContactModel model = check->Good();
    GateCheck::Apply({at, input.subspan(3, length)}, &model);
    if (!check->Offer(model)) return false;
    input = input.subspan(3 + length);
  }
  return true;
}

[[nodiscard]] inline bool Survives(std::span<const std::uint8_t> input) {
  GateCheck check;
  return Press(&check) && OfferPatches(input, &check);
}

}  // namespace fulcrum::haptics::testing
