// What a session of a scene is expected to run like on this machine, said before it starts.
#pragma once

#include <filesystem>
#include <string>

namespace fulcrum::supervisor {

/// Of a step of physics_node alone, as scene_profiler --forecast measures it.
struct StepForecast {
  double period_ms = 0, all_ms = 0, working_ms = 0;  ///< As physics::Forecast.
};

/// A step in a session over a step alone, in the median: cores are shared, heat and picture go on beside. Measured 1.2
/// to 1.4 (deploy/docs/measurements/haptics, Live force error).
inline constexpr double kSessionOverStep = 1.3;

/// In one line: whether steps will be in time, otherwise the rate if all were as long, and what makes the scene
/// cheaper.
[[nodiscard]] std::string Describe(const StepForecast& forecast);

/// The line for a compiled scene in the folder `cache`, on `threads` of physics_node: measured by the program
/// `profiler` once, and kept beside the scene. Empty for other scenes, and when it cannot be measured.
[[nodiscard]] std::string ForecastOf(const std::filesystem::path& scene, const std::filesystem::path& cache,
                                     const std::filesystem::path& profiler, int threads);

}  // namespace fulcrum::supervisor
