// The whole picture as an OpenSceneGraph graph: what the surgeon sees. Knows no bus and no window.
#pragma once

#include <memory>
#include <osg/Group>
#include <span>

#include "render_node/geometry/laparoscope.h"
#include "render_node/scene_graph/overlay.h"
#include "services/base/core/scene_view.h"

namespace fulcrum::render {

class LaparoscopeView {
 public:
  /// Builds everything for `scene`, whose arrays must outlive it. Needs no OpenGL context.
  explicit LaparoscopeView(const SceneView& scene);
  ~LaparoscopeView();
  LaparoscopeView(const LaparoscopeView&) = delete;
  LaparoscopeView& operator=(const LaparoscopeView&) = delete;

  /// Particles in scene order, 3 * n floats [m]. @pre n is the scene's count.
  void SetTissue(std::span<const float> xyz);
  /// Where what breathes is drawn: at this time of the simulation [s]. True when that is another place than before.
  bool SetBreath(double simulated_time_s);
  /// False, and nothing changes, when it belongs to another grid.
  bool SetTopology(const TopologyState& topology);
  /// False when the patch lies outside the sheet or has the wrong size.
  bool ApplyPatch(const TemperaturePatch& patch);
  void SetTool(int tool, const ToolSample& sample);
  void SetJaw(int tool, float angle_rad);

  /// Text in the corners.
  void SetTexts(std::span<const OverlayText> texts);
  /// A puff of steam where (s, t) [m] of the sheet is drawn now.
  void AddSmoke(const Vec2f& material, double session_time_s);
  /// A cut at (s, t) [m]: the vessels that it opens bleed until heat closes them.
  void OpenVessels(const Vec2f& material, double session_time_s);
  /// Moves smoke and blood on. True when the picture changes by that, or is going to.
  bool UpdateEffects(double session_time_s);

  /// Looks from and to where `params` says; size and field of view stay.
  void SetCamera(const RenderParams& params);
  /// Share of the picture's width and height that the scene is drawn with, in (0, 1]; text always has all of it.
  void SetScale(float scale);

  /// Carries the last SetTissue and SetTopology over to the meshes. Split off so that several changes cost one update.
  /// Where nothing changed, the next picture shows the last one of the scene again.
  void Update();

  [[nodiscard]] osg::Group* root() const;
  [[nodiscard]] const Laparoscope& laparoscope() const;
  /// Where the sheet's node nearest to (s, t) [m] is drawn now, frame W.
  [[nodiscard]] Vec3f OnMembrane(const Vec2f& material) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace fulcrum::render
