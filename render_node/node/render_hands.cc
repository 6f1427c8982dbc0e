// The part of the render node that follows the tools and their handles.
#include <cmath>

#include "render_node/geometry/laparoscope.h"
#include "render_node/node/render_node.h"

namespace fulcrum::render {
namespace {

// Changes of a pose below these limits are not visible: a fifth of a pixel at 10 cm.
constexpr float kSamePlace = 2e-5f;   // [m]
constexpr float kSameAngle = 0.002f;  // [rad]
constexpr float kSameJaw = 0.015f;    // [rad]: a pixel at the tip; above the noise of a handle's potentiometer.
constexpr float kSameZoom = 0.03f;    // [rad] of the ring: above that noise.
constexpr float kSameSoil = 0.02f;

bool LooksTheSame(const ToolSample& a, const ToolSample& b) {
  return a.kind == b.kind && (a.p_WT - b.p_WT).norm() < kSamePlace && a.q_WT.angularDistance(b.q_WT) < kSameAngle;
}

}  // namespace

void RenderNode::TakeTools() {
  if (ports_.tools.TakeLatest(&new_tools_)) {
    arrivals_[1].time_s = session_time_s_;
    tools_.stamp = new_tools_.stamp;
    for (int k = 0; k < kMaxTools; ++k) {
      const auto i = static_cast<std::size_t>(k);
      if (!LooksTheSame(tools_.tools[i], new_tools_.tools[i])) {
        tools_.tools[i] = new_tools_.tools[i];
        view_.SetTool(k, tools_.tools[i]);
        if (tools_.tools[i].kind == ToolKind::kScope) FollowScope();
        changed_on_screen_ = changed_in_file_ = true;
      }
    }
  }
  lens_.Step(session_time_s_, tools_, (contact_.touching || contact_.on_solid) && hud_.power_W > 0);
  if (std::abs(lens_.soil() - hud_.soil) > kSameSoil || (lens_.soil() == 0 && hud_.soil != 0)) {
    hud_.soil = lens_.soil();
    view_.SetSoil(hud_.soil);
    changed_on_screen_ = changed_in_file_ = true;
  }
  TakeHandles();
}

void RenderNode::TakeHandles() {
  // Two squeezes of a tube's valve may lie between two steps.
  bool taken = !hud_.tube && ports_.handles.TakeLatest(&new_handles_);
  while (hud_.tube && ports_.handles.TakeNext(&new_handles_)) {
    taken = true;
    FollowValves();
  }
  if (taken) {
    arrivals_[2].time_s = session_time_s_;
    if (handles_.pedals != new_handles_.pedals) {
      handles_.pedals = new_handles_.pedals;
      changed_on_screen_ = changed_in_file_ = true;
    }
    for (int k = 0; k < kMaxTools; ++k) {
      const auto i = static_cast<std::size_t>(k);
      HandleSample& shown = handles_.handles[i];
      const HandleSample& now = new_handles_.handles[i];
      const bool scope = scene_.tools[i].kind == ToolKind::kScope;
      if (now.present && std::abs(now.jaw_angle_rad - shown.jaw_angle_rad) > (scope ? kSameZoom : kSameJaw)) {
        shown = now;
        view_.SetJaw(k, now.jaw_angle_rad);
        if (scope) FollowScope();
        changed_on_screen_ = changed_in_file_ = true;
      }
    }
  }
}

void RenderNode::FollowValves() {
  for (int k = 0; k < kMaxTools; ++k) {
    const auto i = static_cast<std::size_t>(k);
    if (scene_.tools[i].kind != ToolKind::kSuction) continue;
    const HandleSample& handle = new_handles_.handles[i];
    const bool there = handle.present && tools_.tools[i].kind == ToolKind::kSuction;
    if (!there) valves_[i].Shut();
    const double time_s = 1e-9 * static_cast<double>(new_handles_.stamp.stamp_ns);
    if (there) (void)valves_[i].Step(time_s, handle.jaw_angle_rad);
    if (valves_[i].flow() == hud_.flow[i]) continue;
    hud_.flow[i] = valves_[i].flow();
    view_.SetFlow(k, hud_.flow[i], session_time_s_);
    changed_on_screen_ = changed_in_file_ = true;
  }
}

void RenderNode::FollowScope() {
  for (std::size_t i = 0; i < kMaxTools; ++i) {
    const ToolSample& scope = tools_.tools[i];
    if (scope.kind != ToolKind::kScope) continue;
    camera_.Hold(scope.p_WT, SightOf(scope.q_WT, scene_.render.scope_angle_deg),
                 ZoomAt(handles_.handles[i].jaw_angle_rad));
    view_.SetCamera(camera_.params());
    return;
  }
}

}  // namespace fulcrum::render
