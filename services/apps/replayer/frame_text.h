// Camera and instruments of a frame of a data set, as JSON.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>

#include "render_node/node/render_node.h"
#include "services/apps/replayer/truth.h"

namespace fulcrum::replay {

/// Intrinsics of both cameras in the first frame, units of the images, names of the classes and of the organs that have
/// instances.
[[nodiscard]] std::string CalibrationText(const render::Pinhole& camera, double baseline_m,
                                          std::span<const Solid> solids);

/// What a line needs of the renderer.
struct FrameState {
  FrameState(const render::RenderNode& node, const ContactModel& contacts);

  std::array<ToolSample, kMaxTools> tools;
  HandleState handles;
  std::array<double, kMaxTools> force_N{};  ///< Of the tissue on each tool.
};

/// One line: time, camera with its intrinsics, which the zoom ring of a held scope changes, and each instrument's pose,
/// jaw, force and keypoints.
[[nodiscard]] std::string FrameText(std::uint64_t frame, double time_s, const FrameState& state, const SceneView& scene,
                                    const Truth& truth);

}  // namespace fulcrum::replay
