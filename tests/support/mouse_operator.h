// A person who watches the picture and moves the tools with pointer and keys. It sees where the tools are on the bus,
// as a person sees it in the picture, and acts through nothing but MouseAndKeyboard.
#pragma once

#include <filesystem>
#include <memory>
#include <span>
#include <string>

#include "services/base/core/scene_view.h"
#include "services/transport/bus/dds/participant.h"
#include "tests/support/mouse_and_keyboard.h"

namespace fulcrum::testing {

/// Reads tools, pedals and tissue of the session in a domain.
class Eyes {
 public:
  explicit Eyes(int domain);
  void Look();
  /// Both tools are in the session.
  [[nodiscard]] bool Ready() const;
  /// Newest metric of a node; NaN: it has not reported it.
  [[nodiscard]] double Metric(NodeId node, const std::string& name) const;

  ToolState tools;
  HandleState handles;
  TopologyState topology;

 private:
  bus::DdsParticipant participant_;
  std::unique_ptr<bus::Input<ToolState>> tools_;
  std::unique_ptr<bus::Input<HandleState>> handles_;
  std::unique_ptr<bus::Input<TopologyState>> topology_;
  std::unique_ptr<bus::Input<Health>> health_;
  std::array<Health, kNodeCount> newest_;
};

class MouseOperator {
 public:
  MouseOperator(const RenderParams& camera, MouseAndKeyboard* hand, Eyes* eyes);

  /// Moves the tip of a tool to `target` at `speed_m_s`, straight, by the pointer, with Control along the view, waits
  /// until it stands, and corrects what is left: right with any lag between pointer and tool. False: it did not arrive.
  bool Go(std::size_t tool, const Vec3f& target, float speed_m_s, float near_m = 1.5e-3f);
  /// The same through several places, without a stop at those before the last.
  bool Follow(std::size_t tool, std::span<const Vec3f> places, float speed_m_s, float near_m = 1.5e-3f);

 private:
  /// Orders a straight way from `from` to `to`.
  void Draw(const Vec3f& from, const Vec3f& to, float speed_m_s);
  /// Waits until the tool stands, `way_m` from where it was.
  void AwaitStand(std::size_t tool, const Vec3f& from, float way_m);
  /// Whole pixels; the rest is kept for the next time.
  void Send(float x, float y, float deep);

  MouseAndKeyboard* hand_;
  Eyes* eyes_;
  Vec3f right_, up_, forward_, eye_;
  float pixel_;
  Vec3f rest_ = Vec3f::Zero();
};

/// What the task of `built-in` came to.
struct DissectionByMouse {
  double grasped = 0;     ///< Particles in the jaws, while they pull.
  double lifted_mm = 0;   ///< Way of the grasper's tip upwards with the tissue in it.
  double pull_N = 0;      ///< Force at its tip there.
  double cut_mm = 0;      ///< Length of the slit.
  double released = 0;    ///< Particles in the jaws at the end.
  double released_N = 0;  ///< Force at the grasper's tip at the end.
  std::string fault;      ///< First step that failed; empty: all of them succeeded.
};

/// Grasps the membrane, tents it, cuts 20 mm beside the fold and releases it, at the places of the scene's script. The
/// controls must have been taken.
[[nodiscard]] DissectionByMouse DissectByMouse(const SceneView& view, MouseAndKeyboard* hand, Eyes* eyes);

}  // namespace fulcrum::testing
