// One session of the real nodes: a hook that follows a stroke on the built-in scene, recorded, and the map of its cut.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "services/records/log_tools/cut_map.h"
#include "tests/benchmark/cut/stroke.h"

namespace fulcrum::benchmark {

/// How the membrane is held: free, free and without prestrain, over the middle of the organ, pulled by the grasper
/// beside the path, or lifted by it.
enum class Held { kFree, kSlack, kOrgan, kTaut, kTented };
/// How the foot lies, which depends on the trocar: pointing into the sheet at 70 degrees or at 45 degrees, heel first
/// with its end up, or level.
enum class Foot { kDown, kSlanted, kUp, kLevel };

/// Time between kills: more than twice the time that a killed node needs until it works again.
inline constexpr double kKillPeriod_s = 1.1;

struct SessionPlan {
  std::string name;  ///< Part of its keys, "s07".
  Shape shape = Shape::kAlong;
  double speed_mm_s = 4;
  double power_W = 35;
  std::string pedal = "cut";
  Held held = Held::kFree;
  Foot foot = Foot::kDown;
  bool loaded = false;  ///< Two busy processes run beside the session.
  double dt_ms = 10;
  std::string preset = "default";
  double longest_mm = 22;
  double stay_s = 0.1;  ///< Time on the sheet before the hook moves, with the pedal pressed.
  int kills = 0;  ///< Kills of thermal_node and physics_node in turn, one each kKillPeriod_s from the start of the cut.
};

[[nodiscard]] std::string Describe(const SessionPlan& plan);

/// Runs sessions. A session that fails yields no figures; the reason is written to stderr.
class SessionRunner {
 public:
  /// @param keep folder for recordings and maps; empty: none are kept.
  explicit SessionRunner(std::filesystem::path keep);
  ~SessionRunner();
  SessionRunner(const SessionRunner&) = delete;
  SessionRunner& operator=(const SessionRunner&) = delete;

  /// Runs up to two times more if the pedal was not received for most of the stroke: simulated firmware that gets no
  /// processor time sends nothing, and physics then treats the pedal as up.
  [[nodiscard]] std::optional<log_tools::CutMap> Run(const SessionPlan& plan);
  /// Number of runs rejected because the pedal signal was lost; if there are many, the remaining runs are not
  /// representative.
  [[nodiscard]] int repeated() const { return repeated_; }
  /// Number of nodes that were killed and started again, in all sessions.
  [[nodiscard]] int killed() const { return killed_; }
  /// Runs a scene unchanged, with its own script.
  [[nodiscard]] std::optional<log_tools::CutMap> RunScene(const std::string& name, const std::string& base);

 private:
  [[nodiscard]] std::optional<log_tools::CutMap> RunFiles(const std::string& name, const std::filesystem::path& scene,
                                                          const std::filesystem::path& cart, double seconds,
                                                          bool loaded, int kills = 0);
  /// Positions of the sheet's nodes after the grasper has pulled it.
  [[nodiscard]] std::vector<Vec3f> PulledNodes(const SessionPlan& plan, const Vec3d& trocar_W);

  std::filesystem::path folder_, keep_;
  int domain_;
  int repeated_ = 0, killed_ = 0;
};

}  // namespace fulcrum::benchmark
