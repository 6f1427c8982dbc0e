#include "services/apps/replayer/projector.h"

#include <algorithm>

namespace fulcrum::replay {
namespace {

/// Longest time between two steps of the renderer: its effects follow the instruments, and its inputs keep few samples.
constexpr double kStep_s = 1.0 / 30;

}  // namespace

Projector::Projector(const std::filesystem::path& recording, const SceneView& scene, const render::Look& look)
    : recording_(recording), scene_(scene), look_(look) {
  Begin();
  if (Read()) span_ = SpanOf(recording_, ClockOf(recording_), replay_->session_start_ns());
}

void Projector::Begin() {
  replay_.reset();  // Two contexts of OpenGL at a time need twice the memory.
  render::RenderSettings settings;
  settings.look = look_;
  settings.quality = render::Quality::kHigh;  // A picture that stands still is looked at.
  replay_.emplace(recording_, scene_, settings);
  at_s_ = read_s_ = 0;
}

bool Projector::Read() {
  const std::optional<double> next_s = replay_->Next();
  read_s_ = next_s.value_or(read_s_);
  if (next_s && follow_) follow_(*replay_, read_s_);
  return next_s.has_value();
}

void Projector::GoTo(double time_s) {
  time_s = std::clamp(time_s, 0.0, end_s());
  if (time_s < at_s_) Begin();
  double due_s = at_s_ + kStep_s;
  while (read_s_ < time_s && Read()) {
    if (read_s_ < due_s || read_s_ >= time_s) continue;
    replay_->Step(read_s_);
    replay_->node().FollowEffects();
    due_s = read_s_ + kStep_s;
  }
  at_s_ = time_s;
  replay_->Step(time_s);
}

bool Projector::Draw(render::Bitmap* picture) {
  render::RenderNode& node = replay_->node();
  bool drawn = node.DrawInto(picture);
  while (!drawn && node.pictures_drawn() == 0 && Read()) {
    replay_->Step(std::max(at_s_, read_s_));
    drawn = node.DrawInto(picture);
  }
  return drawn;
}

}  // namespace fulcrum::replay
