#include "tests/support/mouse_operator.h"

#include <chrono>
#include <cmath>
#include <limits>
#include <thread>
#include <vector>

#include "render_node/geometry/laparoscope.h"
#include "services/base/core/operator_script.h"
#include "tests/support/cart.h"
#include "tests/support/session_bus.h"

namespace fulcrum::testing {

using Clock = std::chrono::steady_clock;
using Seconds = std::chrono::duration<double>;

Eyes::Eyes(int domain)
    : participant_(ReaderOf(domain, "watch")),
      tools_(participant_.MakeInput<ToolState>()),
      handles_(participant_.MakeInput<HandleState>()),
      topology_(participant_.MakeInput<TopologyState>()),
      health_(participant_.MakeInput<Health>()) {}

void Eyes::Look() {
  (void)tools_->TakeLatest(&tools);
  (void)handles_->TakeLatest(&handles);
  (void)topology_->TakeLatest(&topology);
  Health health;
  while (health_->TakeNext(&health)) newest_[static_cast<std::size_t>(health.node)] = health;
}

bool Eyes::Ready() const { return tools.tools[1].kind == ToolKind::kHook && handles.handles[0].present; }

double Eyes::Metric(NodeId node, const std::string& name) const {
  for (const fulcrum::Metric& metric : newest_[static_cast<std::size_t>(node)].metrics) {
    if (metric.name == name) return metric.value;
  }
  return std::numeric_limits<double>::quiet_NaN();
}

MouseOperator::MouseOperator(const RenderParams& camera, MouseAndKeyboard* hand, Eyes* eyes)
    : hand_(hand), eyes_(eyes) {
  const Eigen::Matrix4f view = render::MakeLaparoscope(camera).view;
  right_ = view.row(0).head<3>().transpose();
  up_ = view.row(1).head<3>().transpose();
  forward_ = -view.row(2).head<3>().transpose();
  eye_ = camera.scope_tip_W;
  pixel_ = 2 * std::tan(0.5f * 0.0174533f * camera.fov_deg) / static_cast<float>(camera.height);
}

bool MouseOperator::Go(std::size_t tool, const Vec3f& target, float speed_m_s, float near_m) {
  return Follow(tool, {&target, 1}, speed_m_s, near_m);
}

bool MouseOperator::Follow(std::size_t tool, std::span<const Vec3f> places, float speed_m_s, float near_m) {
  const auto limit = Clock::now() + std::chrono::seconds(30);
  while (true) {
    eyes_->Look();
    const Vec3f begin = eyes_->tools.tools[tool].p_WT;
    if ((places.back() - begin).norm() < near_m) return true;
    if (Clock::now() > limit) return false;
    Vec3f at = begin;
    for (const Vec3f& place : places) {
      Draw(at, place, speed_m_s);
      at = place;
    }
    AwaitStand(tool, begin, (at - begin).norm());
    places = places.last(1);
  }
}

void MouseOperator::Draw(const Vec3f& from, const Vec3f& to, float speed_m_s) {
  constexpr std::chrono::milliseconds kPeriod(20);
  const Vec3f way = to - from;
  const int steps = static_cast<int>(std::ceil(way.norm() / (speed_m_s * Seconds(kPeriod).count())));
  auto next = Clock::now();
  for (int i = 0; i < steps; ++i) {
    const Vec3f step = way / static_cast<float>(steps);
    const float metres = pixel_ * forward_.dot(from + step * static_cast<float>(i) - eye_);
    Send(step.dot(right_) / metres, -step.dot(up_) / metres, step.dot(forward_) / metres);
    std::this_thread::sleep_until(next += kPeriod);
  }
}

void MouseOperator::AwaitStand(std::size_t tool, const Vec3f& from, float way_m) {
  constexpr Seconds kStand(0.15), kLongestLag(1.5);
  const auto ordered = Clock::now();
  Vec3f last = eyes_->tools.tools[tool].p_WT;
  for (auto moved = ordered; Clock::now() - moved < kStand;) {
    std::this_thread::sleep_for(Seconds(0.02));
    eyes_->Look();
    const Vec3f& tip = eyes_->tools.tools[tool].p_WT;
    const bool under_way = (tip - from).norm() < 0.7f * way_m && Clock::now() - ordered < kLongestLag;
    if ((tip - last).norm() < 1e-4f && !under_way) continue;
    last = tip;
    moved = Clock::now();
  }
}

void MouseOperator::Send(float x, float y, float deep) {
  rest_ += Vec3f(x, y, deep);
  const Eigen::Vector3i whole = rest_.array().round().matrix().cast<int>();
  rest_ -= whole.cast<float>();
  if (whole.x() != 0 || whole.y() != 0) hand_->Move(whole.x(), whole.y());
  if (whole.z() != 0) hand_->MoveDeep(whole.z());
}

DissectionByMouse DissectByMouse(const SceneView& view, MouseAndKeyboard* hand, Eyes* eyes) {
  DissectionByMouse done;
  MouseOperator move(view.render, hand, eyes);
  const auto place = [&](std::uint32_t tool, double time_s) { return EvaluateScript(view.script, tool, time_s).p_W; };
  const auto require = [&](bool holds, const char* step) {
    if (!holds && done.fault.empty()) done.fault = step;
    return holds;
  };
  const auto seen = [&](double limit_s, const auto& holds) {
    return WaitFor(limit_s, [&] {
      eyes->Look();
      return holds();
    });
  };
  const auto grasped = [&] { return eyes->Metric(NodeId::kPhysics, "grasped_particles"); };
  const ToolSample& grasper = eyes->tools.tools[0];

  // The grasper comes down with open jaws, and closes.
  hand->Click("1");
  require(move.Go(0, place(0, 1.2), 0.1f), "the grasper does not reach the tissue from above");
  require(move.Go(0, place(0, 2.0), 0.03f, 2e-3f), "the grasper does not reach the membrane");
  hand->Click("k");
  require(seen(10, [&] { return eyes->handles.handles[0].jaw_angle_rad < 0.1f; }), "the jaws do not close");
  require(seen(10, [&] { return grasped() > 0; }), "the jaws hold nothing");
  const float low = grasper.p_WT.z();
  require(move.Go(0, place(0, 5.8), 0.015f, 3e-3f), "the grasper does not lift the membrane");
  eyes->Look();
  done.grasped = grasped();
  done.lifted_mm = 1e3 * (grasper.p_WT.z() - low);
  done.pull_N = grasper.f_W.norm();

  // The hook goes through the membrane beside the fold, and along the organ with the pedal down.
  hand->Click("2");
  for (const double time_s : {6.3, 7.0}) {
    require(move.Go(1, place(1, time_s), time_s < 7 ? 0.06f : 0.02f, 2e-3f), "the hook does not reach the membrane");
  }
  hand->Press("f", true);
  require(seen(10, [&] { return eyes->handles.pedals == kPedalCut; }), "the pedal is not down");
  std::vector<Vec3f> line;
  for (double time_s = 8; time_s < 14.9; time_s += 0.5) line.push_back(place(1, time_s));
  require(move.Follow(1, line, 0.005f), "the hook does not reach the end of the line");
  hand->Press("f", false);
  require(seen(10, [&] { return eyes->handles.pedals == kPedalNone; }), "the pedal does not rise");
  (void)move.Go(1, place(1, 15.8), 0.05f, 3e-3f);
  (void)seen(1.5, [] { return false; });  // The published length follows at a limited rate.
  done.cut_mm = 1e3 * eyes->topology.cut_length_m;
  require(done.cut_mm >= 20, "the slit is shorter than 20 mm");

  // The grasper goes back and lets go.
  hand->Click("1");
  require(move.Go(0, place(0, 16.2), 0.03f, 3e-3f), "the grasper does not come back");
  hand->Click("k");
  require(seen(10, [&] { return grasped() == 0; }), "the jaws do not release the membrane");
  require(move.Go(0, place(0, 19.0), 0.08f, 3e-3f), "the grasper does not leave");
  (void)seen(0.5, [] { return false; });
  done.released = grasped();
  done.released_N = grasper.f_W.norm();
  require(done.released_N < 0.1, "the tissue pulls at the released grasper");
  return done;
}

}  // namespace fulcrum::testing
