// What a scene costs and how right it is on this machine: the scene's own script with each preset of mode accurate,
// against a solution of much smaller steps. Without heat and cuts: the tissue stays whole.
#pragma once

#include <array>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "physics_node/simulation/tissue_simulation.h"

namespace fulcrum::physics {

/// Stages of a step, in their order. kModels: the contact models for servo and heat. kRest: grasps, tears, sleep.
enum class Stage { kContacts, kPrediction, kLinearisation, kSolve, kUpdate, kModels, kRest };
inline constexpr std::size_t kStages = 7;
[[nodiscard]] std::string_view NameOf(Stage stage);
[[nodiscard]] std::string_view NameOf(PhysicsPreset preset);

struct PresetFigures {
  PhysicsPreset preset = PhysicsPreset::kDefault;
  double step_p50_ms = 0, step_p99_ms = 0;  ///< Of the steps in which something is awake, on one thread.
  double awake = 0;                         ///< Share of the steps.
  std::array<double, kStages> stage_ms{};   ///< Mean of these steps.
  double position_error = 0;                ///< RMS over particles and time, of the RMS displacement.
  double force_error = 0;                   ///< RMS of the force on the tools, of its RMS.
  double deepest_mm = 0;                    ///< A tool in the tissue, at the end of a step.
};

struct ThreadFigures {
  int threads = 1;
  double step_p50_ms = 0, step_p99_ms = 0;
};

struct SceneProfile {
  double period_ms = 0;
  std::vector<PresetFigures> presets;  ///< fast, default, accurate.
  std::vector<ThreadFigures> threads;  ///< Of the scene's own preset.
};

struct ProfileSettings {
  double seconds = 0;         ///< First part of the script; 0: all of it.
  int most_threads = 1;       ///< Tried are 1, 2, 4, … up to this.
  int reference_threads = 1;  ///< Of the reference, whose time does not count.
};

/// Runs the script several times. @param progress is called with the work in hand and its share done, often.
/// Throws InputError for a scene of another mode or without a script.
[[nodiscard]] SceneProfile ProfileScene(const SceneView& scene, const ProfileSettings& settings,
                                        const std::function<void(std::string_view, double)>& progress);

/// What to write into the scene and the cart for this machine.
struct Advice {
  bool in_time = false;  ///< false: not even the cheapest preset fits; the figures are its.
  PhysicsPreset preset = PhysicsPreset::kDefault;
  int threads = 1;
  double forecast_p99_ms = 0;  ///< Of a step of physics_node in a session.
};
/// The most accurate preset whose p99 in a session is forecast below kMostOfPeriod periods: few periods are missed
/// then.
/// @pre not empty
[[nodiscard]] Advice AdviceOf(const SceneProfile& profile);

/// A step in a session over a step alone, at p99: cuts, publishing, state hash, and nodes that share the cores.
/// Measured with `built-in` on two cores, where it is 1.4 to 2.3 (deploy/docs/measurements/physics, The whole cart).
inline constexpr double kSessionOverAlone = 1.7;
inline constexpr double kMostOfPeriod = 1.2;
/// Cores that the other nodes of a cart need: with two threads on two cores a step in a session takes longer than with
/// one.
inline constexpr int kCoresOfOthers = 2;

}  // namespace fulcrum::physics
