// A hand rests on a surface that pushes back with 0.5 N; the servo renders the force at 1 kHz from a contact model that
// comes every 10 ms.
#include "haptics_node/servo/servo.h"

#include <cstdio>

#include "services/scene/builder/build.h"

using namespace fulcrum;

class Hand final : public haptics::HapticDevice {
 public:
  explicit Hand(const Vec3d& place) : place_(place) {}
  Vec3d ReadPosition(const Tick&) noexcept override { return place_; }
  void WriteForce(const Vec3d& force) noexcept override { force_N_ = force; }
  [[nodiscard]] const Vec3d& force_N() const { return force_N_; }

 private:
  Vec3d place_, force_N_ = Vec3d::Zero();
};

int main() {
  const scene::SceneData scene = scene::BuildProcedural(scene::Small());
  const SceneView view = scene.View();
  const Vec3d pivot = view.tools[0].p_WP.cast<double>();
  Hand hand(pivot + 0.5 * static_cast<double>(view.tools[0].shaft_length_m) * pivot.normalized());
  haptics::Servo servo(haptics::ServoSettingsOf(view), {&hand, nullptr});

  ContactModel model{.stamp = {.sequence = 0, .epoch = 1}, .physics_dt_s = 0.01f};
  Contact& contact = model.devices[0].contacts[0];
  contact = {.kind = ContactKind::kSurface, .id = 1, .f_ref = Vec3f(0, 0, 0.5f), .k1 = 500, .k_body = 200, .b_body = 5};
  contact.u_c = -contact.f_ref / contact.k_body;
  contact.radius = 0.01f;
  model.devices[0].count = 1;
  model.devices[0].force_cap_N = 3;
  for (std::int64_t ms = 1; ms <= 2000; ++ms) {
    const std::int64_t now_ns = 1'000'000 * ms;
    if (ms % 10 == 0) {
      contact.x_ref = servo.record().tool.tools[0].p_WT;
      model.tool_stamp_ns = model.stamp.stamp_ns = now_ns - 1'000'000;
      ++model.stamp.sequence;
      servo.OfferModel(model, now_ns);
    }
    servo.Step({.index = std::uint64_t(ms), .session_time_s = 1e-3 * double(ms), .dt_s = 1e-3, .stamp_ns = now_ns});
  }
  const double expected_N = 0.5 * static_cast<double>(view.haptics.force_scale);
  std::printf("force on the hand %.3f N (at a scale of %.1f)\n", hand.force_N().norm(), expected_N / 0.5);
  return std::abs(hand.force_N().norm() - expected_N) < 0.01 * expected_N ? 0 : 1;
}
