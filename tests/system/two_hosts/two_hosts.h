// Two hosts and a cable between them on one machine: network namespaces, each with its own /dev/shm, so that the cable
// is their only connection, and the far host with a CLOCK_MONOTONIC of its own. Needs root.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "tests/support/program.h"

namespace fulcrum::testing {

class TwoHosts {
 public:
  struct Settings {
    double delay_ms = 0;           ///< In each direction.
    double loss_percent = 0;       ///< In each direction.
    double far_clock_ahead_s = 0;  ///< Whole seconds.
    std::string word = "fulcrum";  ///< For Overheard.
  };
  static constexpr const char* kCartAddress = "10.77.0.1";
  static constexpr const char* kHostAddress = "10.77.0.2";

  /// Empty, or why this machine cannot run it.
  [[nodiscard]] static std::string WhyNot();

  explicit TwoHosts(const Settings& settings);
  ~TwoHosts();
  TwoHosts(const TwoHosts&) = delete;
  TwoHosts& operator=(const TwoHosts&) = delete;

  /// A program of this build.
  [[nodiscard]] Program OnCart(const std::string& program, const std::vector<std::string>& arguments) const;
  [[nodiscard]] Program OnHost(const std::string& program, const std::vector<std::string>& arguments) const;
  /// Disconnects the cable, and connects it again.
  void Cut() const;
  void Mend() const;
  /// True if Settings::word was transmitted over the cable in the clear.
  [[nodiscard]] bool Overheard() const { return !cable_.Said().empty(); }
  /// Temporary folder, removed with the object.
  [[nodiscard]] const std::filesystem::path& folder() const { return folder_; }

 private:
  void MakeHost(const std::string& name, const char* end, const char* address, double clock_ahead_s, Program* holder,
                std::string* pid) const;
  [[nodiscard]] std::string Name(const char* what) const;

  std::filesystem::path folder_;
  Program cart_holder_, host_holder_, cable_;
  std::string cart_pid_, host_pid_;  ///< Of processes that run in the namespaces.
};

// ------------------------------------------------------------------------ records of the probes

struct HeardFrame {
  std::uint64_t sequence = 0;
  double age_s = 0;
  std::vector<float> xyz;
};
/// Calls `take` for each frame of a probe's file.
void ForEachFrame(const std::filesystem::path& file, const std::function<void(const HeardFrame&)>& take);

struct HeardTool {
  double time_s = 0, force0_N = 0, force1_N = 0, model_age_s = 0;
};
[[nodiscard]] std::vector<HeardTool> HeardTools(const std::filesystem::path& file);
/// Values of a figure of the link, in order.
[[nodiscard]] std::vector<double> HeardLinkFigure(const std::filesystem::path& file, const std::string& name);

/// Frames received by both probes, compared vertex by vertex.
struct FrameComparison {
  std::size_t compared = 0;
  double largest_error_m = 0;
  double median_age_s = 0, largest_gap = 0;  ///< Age in the second file; gap in frames of the first.
};
[[nodiscard]] FrameComparison CompareFrames(const std::filesystem::path& near, const std::filesystem::path& far);

}  // namespace fulcrum::testing
