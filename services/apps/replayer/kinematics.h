// Poses, jaws, forces and pedals of a session at any time, between the samples of the recording. Pure.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "services/base/core/messages.h"

namespace fulcrum::replay {

struct KinematicState {
  struct Tool {
    Vec3d tip_W = Vec3d::Zero();  ///< [m]
    Eigen::Quaterniond q_WT = Eigen::Quaterniond::Identity();
    double jaw_rad = 0;
    double force_N = 0;  ///< Of the tissue on the tool.
  };
  std::array<Tool, kMaxTools> tools;
  std::uint8_t pedals = kPedalNone;  ///< PedalBits.
};

class Kinematics {
 public:
  /// Add samples in the order of their stamps; an older one, of a writer that was restarted, is passed over.
  void Add(const ToolState& tools);
  void Add(const HandleState& handles);
  void Add(const ContactModel& contacts);

  [[nodiscard]] bool empty() const { return tools_.empty(); }
  /// Number of ToolStates.
  [[nodiscard]] std::size_t poses() const { return tools_.size(); }
  /// Longest time between two samples between which a value is taken to be linear [s]: five periods of physics. Nodes
  /// publish less often while nothing moves, and not at all while they are restarted.
  static constexpr double kLongest_s = 0.05;
  /// At this stamp [ns of CLOCK_MONOTONIC]: poses, jaws and forces linearly between the samples before and after (turns
  /// along the shorter arc) if they are at most kLongest_s apart, otherwise as in the one before; pedals as last
  /// sampled; before the first sample, that one.
  [[nodiscard]] KinematicState At(std::int64_t stamp_ns) const;

 private:
  struct Poses {
    std::int64_t stamp_ns;
    std::array<Vec3d, kMaxTools> tip_W;
    std::array<Eigen::Quaterniond, kMaxTools> q_WT;
  };
  struct Handles {
    std::int64_t stamp_ns;
    std::array<double, kMaxTools> jaw_rad;
    std::uint8_t pedals;
  };
  struct Forces {
    std::int64_t stamp_ns;
    std::array<double, kMaxTools> force_N;
  };
  std::vector<Poses> tools_;
  std::vector<Handles> handles_;
  std::vector<Forces> forces_;
};

}  // namespace fulcrum::replay
