// The complete laparoscopic picture as an OpenSceneGraph graph, independent of bus and window.
#pragma once

#include <memory>
#include <osg/Group>
#include <span>

#include "render_node/geometry/atlas.h"
#include "render_node/geometry/laparoscope.h"
#include "render_node/geometry/look.h"
#include "render_node/geometry/solid_burn.h"
#include "render_node/scene_graph/overlay.h"
#include "services/base/core/scene_view.h"
#include "services/base/core/suction.h"

namespace fulcrum::render {

class LaparoscopeView {
 public:
  /// Builds everything for `scene`, whose arrays must outlive it. Needs no OpenGL context.
  explicit LaparoscopeView(const SceneView& scene, const Look& look = {});
  ~LaparoscopeView();
  LaparoscopeView(const LaparoscopeView&) = delete;
  LaparoscopeView& operator=(const LaparoscopeView&) = delete;

  /// Particles in scene order, 3 * n floats [m]. @pre n is the scene's count.
  void SetTissue(std::span<const float> xyz);
  /// Sets the displacement of breathing surfaces for a time of the simulation [s]. Returns true if it has changed.
  bool SetBreath(double simulated_time_s);
  /// Returns false, and changes nothing, if the topology belongs to another grid.
  bool SetTopology(const TopologyState& topology);
  /// Of the sheet or of the solids. Returns false if the patch lies outside their atlas or has the wrong size.
  bool ApplyPatch(const TemperaturePatch& patch);
  void SetTool(int tool, const ToolSample& sample);
  void SetJaw(int tool, float angle_rad);
  /// Replaces the clips on the tissue. @pre anchors are vertices of the scene.
  void SetClips(std::span<const Clip> clips);
  /// What a suction and irrigation tube does from this time on.
  void SetFlow(int tool, TubeFlow flow, double session_time_s);
  /// A tube aspirates or irrigates: UpdateEffects must be called at each step, so that poses count when they come.
  [[nodiscard]] bool TubesWork() const;

  /// Sets the text in the corners.
  void SetTexts(std::span<const OverlayText> texts);
  /// Adds a puff of steam at the present position of the sheet's point (s, t) [m].
  void AddSmoke(const Vec2f& material, double session_time_s);
  /// The same at a place in frame W [m].
  void AddSmokeAt(const Vec3f& p_W, double session_time_s);
  /// Opens the vessels at a cut at (s, t) [m]; they bleed until heat closes them.
  void OpenVessels(const Vec2f& material, double session_time_s);
  /// Adds what only a burn shows to the picture, or removes it: a shader is compiled when it is drawn.
  void RehearseBurn(bool on);
  /// Advances smoke and blood. Returns true if the picture changes or will change by that, but for the haze.
  bool UpdateEffects(double session_time_s);
  [[nodiscard]] double shed_m3() const;  ///< Blood that vessels have shed since the start [m^3].
  /// True if the haze of smoke or the age of clots is no longer that of the last UpdateEffects.
  [[nodiscard]] bool HasFaded(double session_time_s) const;

  /// Size of the picture [pixels], of the scene's aspect but for rounding.
  void SetSize(int width, int height);
  /// Sets the camera's position, target, roll and field of view from `params`; the size does not change.
  void SetCamera(const RenderParams& params);
  /// Draws the membrane in so many triangles as a picture with `factor` times as many lines needs; 1 at first. What is
  /// coarser shifts a place of the tissue by up to half a pixel from one picture to the next.
  void SetDetail(float factor);
  /// 0: clear lens … 1: nothing to be seen.
  void SetSoil(float soil);
  /// Resolution of the scene as a share of the picture's width and height, in (0, most]; text is always drawn at full
  /// resolution.
  void SetScale(float scale);
  /// Largest scale, 1 at first; above it the scene's pixels are averaged.
  void SetMostScale(float most);

  /// Smooths edges where nothing moves, by means of the last pictures (geometry/temporal_filter.h). For a software
  /// rasteriser, scales up to 1, and pictures of at most kMostSmoothed pixels: its time and memory grow with them.
  static constexpr int kMostSmoothed = 1280 * 720;
  void SetSmoothed(bool on);
  /// Smooths the edges of instruments and the rim of the round field (scene_graph/edge_lines.h) in each picture,
  /// whatever moves: at scales up to 1, through a clear lens, and not where the mean of several pictures is shown. Off
  /// at first.
  void SetSmoothEdges(bool on);
  /// Makes the next picture smoother while nothing changes; false if it would be the same as the last one.
  bool Refine();
  /// The next picture draws a background for the smoothing though the camera rests, which ends after a period.
  [[nodiscard]] bool DrawsBackgroundAtRest() const;

  /// Updates the meshes after SetTissue, SetTopology, ApplyPatch and UpdateEffects; separate, so that several changes
  /// need one update only.
  /// Without a change the next picture reuses the last one of the scene.
  void Update();

  /// The sheet's thermal state as drawn.
  [[nodiscard]] const Atlas& atlas() const;
  /// The same of the solids; empty before their first patch.
  [[nodiscard]] const BurnAtlas& burn_atlas() const;
  [[nodiscard]] osg::Group* root() const;
  [[nodiscard]] const Laparoscope& laparoscope() const;
  /// Present position, frame W, of the sheet's node nearest to (s, t) [m].
  [[nodiscard]] Vec3f OnMembrane(const Vec2f& material) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace fulcrum::render
