#include "services/scene/builder/operator_hand.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <random>

#include "services/base/core/operator_script.h"

namespace fulcrum::scene {
namespace {

constexpr double kStep_s = 0.02;
constexpr int kTones = 3;
constexpr double kTau = 2 * std::numbers::pi;

/// Sum of tones of random frequencies and phases, with an RMS of 1.
class Wander {
 public:
  Wander(double low_Hz, double high_Hz, std::mt19937* random) {
    std::uniform_real_distribution<double> frequency(low_Hz, high_Hz), phase(0, kTau);
    for (Tone& tone : tones_) tone = {frequency(*random), phase(*random)};
  }
  [[nodiscard]] double At(double time_s) const {
    double sum = 0;
    for (const Tone& tone : tones_) sum += std::sin(kTau * tone.frequency_Hz * time_s + tone.phase);
    return sum * std::sqrt(2.0 / kTones);
  }

 private:
  struct Tone {
    double frequency_Hz = 0, phase = 0;
  };
  std::array<Tone, kTones> tones_;
};

OperatorHand Varied(OperatorHand hand, std::mt19937* random) {
  std::uniform_real_distribution<double> share(0.75, 1.25);
  for (double* value :
       {&hand.tremor_m, &hand.drift_m, &hand.hesitation, &hand.lag_s, &hand.pedal_lag_s, &hand.jaw_lag_s}) {
    *value *= share(*random);
  }
  return hand;
}

}  // namespace

std::optional<OperatorHand> HandNamed(std::string_view name) {
  if (name == "expert") {
    return OperatorHand{.tremor_m = 0.08e-3,
                        .drift_m = 0.15e-3,
                        .hesitation = 0.1,
                        .lag_s = 0.05,
                        .pedal_lag_s = 0.05,
                        .jaw_lag_s = 0.05,
                        .roll_rad = 0.02};
  }
  if (name == "novice") {
    return OperatorHand{.tremor_m = 0.4e-3,
                        .drift_m = 1.5e-3,
                        .hesitation = 0.7,
                        .lag_s = 0.2,
                        .pedal_lag_s = 0.5,
                        .jaw_lag_s = 0.3,
                        .roll_rad = 0.15};
  }
  return std::nullopt;
}

std::vector<ScriptKey> Perform(std::span<const ScriptKey> script, const OperatorHand& usual, double duration_s,
                               std::uint32_t scopes) {
  std::mt19937 random(usual.seed);
  const OperatorHand hand = Varied(usual, &random);
  const double varied = std::clamp(hand.hesitation, 0.0, 0.9);
  std::vector<ScriptKey> performed;
  for (std::uint32_t tool = 0; tool < static_cast<std::uint32_t>(kMaxTools); ++tool) {
    if (!EvaluateScript(script, tool, 0).present) continue;
    const std::array<Wander, 3> tremor{Wander(8, 12, &random), Wander(8, 12, &random), Wander(8, 12, &random)};
    const std::array<Wander, 3> drift{Wander(0.2, 0.8, &random), Wander(0.2, 0.8, &random), Wander(0.2, 0.8, &random)};
    // Of a generator of its own, so that a scope changes nothing for the other tools.
    std::mt19937 turns(usual.seed + 1);
    const Wander roll(0.2, 0.8, &turns);
    const double pace_Hz = std::uniform_real_distribution<double>(0.5, 0.9)(random);
    const double pace_phase = std::uniform_real_distribution<double>(0, kTau)(random);
    // Time in the script: its rate is 1 + varied · cos(…), never negative.
    const auto meant_s = [&](double time_s) {
      const double turn = kTau * pace_Hz;
      return time_s - hand.lag_s + varied / turn * (std::sin(turn * time_s + pace_phase) - std::sin(pace_phase));
    };
    const auto steps = static_cast<int>(duration_s / kStep_s);
    for (int i = 0; i <= steps; ++i) {
      const double time_s = i * kStep_s, now_s = meant_s(time_s);
      ScriptPoint point = EvaluateScript(script, tool, now_s);
      for (int axis = 0; axis < 3; ++axis) {
        const auto n = static_cast<std::size_t>(axis);
        point.p_W[axis] +=
            static_cast<float>(hand.tremor_m * tremor[n].At(time_s) + hand.drift_m * drift[n].At(time_s));
      }
      if ((scopes >> tool & 1u) != 0) point.roll_rad += static_cast<float>(usual.roll_rad * roll.At(time_s));
      const ScriptPoint pedals = EvaluateScript(script, tool, now_s - hand.pedal_lag_s);
      performed.push_back({static_cast<float>(time_s), tool, point.p_W,
                           EvaluateScript(script, tool, now_s - hand.jaw_lag_s).jaw_rad, pedals.pedals, pedals.power_W,
                           point.roll_rad});
    }
  }
  return performed;
}

}  // namespace fulcrum::scene
