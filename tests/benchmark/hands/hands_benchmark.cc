// How soon an operator's hand shows: in the force, and in the picture. And how soon an operator who is gone is safe. A
// program moves the pointer of a real X server over the window of a live session.
#include <signal.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "render_node/geometry/laparoscope.h"
#include "services/base/core/operator_script.h"
#include "services/base/runtime/cyclic_thread.h"
#include "services/scene/format/scene_file.h"
#include "services/transport/bus/dds/participant.h"
#include "tests/benchmark/report.h"
#include "tests/support/cart.h"
#include "tests/support/operated_session.h"
#include "tests/support/session_bus.h"
#include "tests/support/virtual_screen.h"
#include "tests/support/xclient.h"

namespace fulcrum {
namespace {

namespace fs = std::filesystem;
using runtime::MonotonicNs;
using testing::WaitFor;

constexpr int kDomain = 72;
constexpr double kPatience_s = 60;
constexpr int kEvents = 200, kEventsQuick = 20;
constexpr int kSquare = 48;        ///< Edge of the observed part of the picture [pixels].
constexpr float kMoved_m = 2e-7f;  ///< A tip at rest moves less in a tick.

/// Whether a tool has moved between two pictures of the square: live tissue alone changes single pixels, and faintly.
bool Differ(const std::vector<unsigned char>& a, const std::vector<unsigned char>& b) {
  constexpr int kFaint = 24, kFew = 60;
  int strong = 0;
  for (std::size_t i = 0; i < std::min(a.size(), b.size()); ++i) strong += std::abs(int{a[i]} - int{b[i]}) > kFaint;
  return strong > kFew;
}

double Ms(std::int64_t ns) { return 1e-6 * static_cast<double>(ns); }

class LiveSession {
 public:
  explicit LiveSession(const std::string& display)
      : cart_("built-in", kDomain, {"--hands", "mouse", "--set", "breathing.amplitude_mm=0"}), client_(display) {}

  /// What went wrong; empty: the right tool is operated.
  std::string Begin() {
    if (!WaitFor(kPatience_s, [&] { return fs::exists(cart_.session() / "scene.fulcrum"); })) return cart_.Said();
    scene_ = std::make_unique<scene::SceneFile>(fs::canonical(cart_.session() / "scene.fulcrum"));
    if (!WaitFor(kPatience_s, [&] { return client_.FindWindow("Fulcrum"); })) return "no window\n" + cart_.Said();
    participant_ = std::make_unique<bus::DdsParticipant>(testing::ReaderOf(kDomain, "watch"));
    tools_ = participant_->MakeInput<ToolState>();
    handles_ = participant_->MakeInput<HandleState>();
    if (!WaitFor(kPatience_s, [&] {
          Look();
          return tool_.tools[1].kind == ToolKind::kHook && handle_.handles[1].present;
        })) {
      return "the tools do not come\n" + cart_.Said();
    }
    client_.Click("Return");
    std::this_thread::sleep_for(std::chrono::seconds(1));
    // Into the middle of the picture, where the square finds it.
    for (int i = 0; i < 100; ++i) {
      Look();
      const Vec2f off = PlaceInPicture() - 0.5f * Size();
      if (off.norm() < 20) break;
      client_.Move(static_cast<int>(-0.2f * off.x()), static_cast<int>(-0.2f * off.y()));
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
    }
    std::this_thread::sleep_for(std::chrono::seconds(1));
    return {};
  }

  /// From a motion of the pointer to the tick whose device position contains it [ms]; negative: it never came.
  double InputToForce(int pixels) {
    tools_->TakeLatest(&tool_);
    const Vec3f before = tool_.tools[1].p_WT;
    const std::int64_t moved_ns = MonotonicNs();
    client_.Move(pixels, 0);
    while (MonotonicNs() - moved_ns < 500'000'000) {
      while (tools_->TakeNext(&tool_)) {
        if (tool_.stamp.stamp_ns > moved_ns && (tool_.tools[1].p_WT - before).norm() > kMoved_m) {
          return Ms(tool_.stamp.stamp_ns - moved_ns);
        }
      }
      std::this_thread::sleep_for(std::chrono::microseconds(200));
    }
    return -1;
  }

  /// From a motion of the pointer to another picture at the tip [ms]; negative: it never came.
  double InputToPicture(int pixels) {
    Look();
    const Vec2f at = PlaceInPicture();
    const int x = static_cast<int>(at.x()) - kSquare / 2, y = static_cast<int>(at.y()) - kSquare / 2;
    const auto before = client_.Pixels(x, y, kSquare);
    const std::int64_t moved_ns = MonotonicNs();
    client_.Move(pixels, 0);
    while (MonotonicNs() - moved_ns < 1'000'000'000) {
      if (Differ(client_.Pixels(x, y, kSquare), before)) return Ms(MonotonicNs() - moved_ns);
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    return -1;
  }

  /// From the last moment of the window's process to pedals up [ms]; it is stopped, as if it hung.
  double SilenceToPedalsUp() {
    client_.Press("f", true);
    if (!WaitFor(5, [&] {
          Look();
          return handle_.pedals == kPedalCut;
        })) {
      return -1;
    }
    const auto nodes = cart_.nodes();
    const auto window = nodes.find("render_node");
    if (window == nodes.end()) return -1;
    const std::int64_t stopped_ns = MonotonicNs();
    ::kill(window->second, SIGSTOP);
    double ms = -1;
    while (MonotonicNs() - stopped_ns < 1'000'000'000 && ms < 0) {
      while (handles_->TakeNext(&handle_)) {
        if (handle_.pedals == kPedalNone && handle_.stamp.stamp_ns > stopped_ns && ms < 0) {
          ms = Ms(handle_.stamp.stamp_ns - stopped_ns);
        }
      }
      std::this_thread::sleep_for(std::chrono::microseconds(500));
    }
    ::kill(window->second, SIGCONT);
    client_.Press("f", false);
    std::this_thread::sleep_for(std::chrono::milliseconds(700));
    return ms;
  }

  /// Whether the square at the tip changes without a motion of the pointer: then a change shows nothing.
  bool PictureMovesByItself() {
    Look();
    const Vec2f at = PlaceInPicture();
    const int x = static_cast<int>(at.x()) - kSquare / 2, y = static_cast<int>(at.y()) - kSquare / 2;
    const auto before = client_.Pixels(x, y, kSquare);
    const std::int64_t begin_ns = MonotonicNs();
    while (MonotonicNs() - begin_ns < 3'000'000'000) {
      if (Differ(client_.Pixels(x, y, kSquare), before)) return true;
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    return before.empty();
  }

  void End() {
    cart_.Signal(SIGINT);
    (void)cart_.WaitForEnd(kPatience_s);
  }

 private:
  void Look() {
    (void)tools_->TakeLatest(&tool_);
    (void)handles_->TakeLatest(&handle_);
  }
  [[nodiscard]] Vec2f Size() const {
    const RenderParams& camera = scene_->view().render;
    return {static_cast<float>(camera.width), static_cast<float>(camera.height)};
  }
  /// Of the tip [pixels], y down.
  [[nodiscard]] Vec2f PlaceInPicture() const {
    const RenderParams& camera = scene_->view().render;
    const Eigen::Matrix4f view = render::MakeLaparoscope(camera).view;
    const Vec3f in_camera = (view * tool_.tools[1].p_WT.homogeneous()).head<3>();
    const float pixel = 2 * std::tan(0.5f * 0.0174533f * camera.fov_deg) / static_cast<float>(camera.height);
    const Vec2f off = Vec2f(in_camera.x(), -in_camera.y()) / (-in_camera.z() * pixel);
    return 0.5f * Size() + off;
  }

  testing::Cart cart_;
  testing::XClient client_;
  std::unique_ptr<scene::SceneFile> scene_;
  std::unique_ptr<bus::DdsParticipant> participant_;
  std::unique_ptr<bus::Input<ToolState>> tools_;
  std::unique_ptr<bus::Input<HandleState>> handles_;
  ToolState tool_;
  HandleState handle_;
};

/// Repeats a measurement; the number that never came is printed.
template <class Measure>
std::vector<double> Repeat(int count, const char* what, const Measure& measure) {
  std::vector<double> values;
  int lost = 0;
  for (int i = 0; i < count; ++i) {
    const double value = measure(i % 2 == 0 ? 6 : -6);
    value < 0 ? void(++lost) : values.push_back(value);
    // At rest again, and not in step with anything that is periodic.
    std::this_thread::sleep_for(std::chrono::milliseconds(311 + 7 * (i % 11)));
  }
  if (lost > 0) std::fprintf(stderr, "%s: %d of %d never came\n", what, lost, count);
  return values;
}

/// The task of system_hands_test, each time in a session of its own: runs in which every step succeeded, of all.
template <class Start>
void MouseTasks(const std::string& key, const Start& start, benchmark::Report* report) {
  if (!report->Wants(key)) return;
  const int runs = report->quick() ? 1 : 20;
  int succeeded = 0;
  std::vector<double> cut_mm;
  for (int i = 0; i < runs; ++i) {
    const std::unique_ptr<testing::OperatedSession> session = start();
    std::string fault = session->Begin();
    if (!session->missing().empty()) return void(std::fprintf(stderr, "%s\n", session->missing().c_str()));
    if (fault.empty()) {
      const auto done = testing::DissectByMouse(session->scene(), &session->hand(), &session->eyes());
      fault = done.fault;
      cut_mm.push_back(done.cut_mm);
      if (!session->End() && fault.empty()) fault = "the session did not end well: " + session->Said();
    }
    succeeded += fault.empty() ? 1 : 0;
    if (!fault.empty()) std::fprintf(stderr, "%s: run %d: %s\n", key.c_str(), i + 1, fault.c_str());
  }
  report->Add(key + "success", succeeded, "count");
  report->Add(key + "runs", runs, "count");
  report->Add(key + "cut_mm_min", benchmark::Quantile(cut_mm, 0), "mm");
  report->Add(key + "cut_mm_max", benchmark::Quantile(cut_mm, 1), "mm");
}

int Run(benchmark::Report* report) {
  MouseTasks(
      "hands.mouse_task_window.", [] { return testing::WindowSession("built-in", kDomain); }, report);
  MouseTasks(
      "hands.mouse_task_page.", [] { return testing::BrowserSession("built-in", kDomain, FULCRUM_CONSOLE_NPM); },
      report);
  if (!report->Wants("hands.input_to_") && !report->Wants("hands.silence_")) return 0;
  const testing::VirtualScreen screen;
  if (screen.display().empty()) {
    std::fprintf(stderr, "bench_hands: Xvfb is needed; apt install xvfb\n");
    return 1;
  }
  ::setenv("DISPLAY", screen.display().c_str(), 1);
  LiveSession session(screen.display());
  if (const std::string wrong = session.Begin(); !wrong.empty()) {
    std::fprintf(stderr, "bench_hands: %s\n", wrong.c_str());
    return 1;
  }
  const int count = report->quick() ? kEventsQuick : kEvents;
  if (report->Wants("hands.input_to_force_ms")) {
    const auto ms = Repeat(count, "force", [&](int pixels) { return session.InputToForce(pixels); });
    report->Add("hands.input_to_force_ms_p50", benchmark::Quantile(ms, 0.5), "ms");
    report->Add("hands.input_to_force_ms_p99", benchmark::Quantile(ms, 0.99), "ms");
  }
  if (report->Wants("hands.input_to_picture_ms") && session.PictureMovesByItself()) {
    std::fprintf(stderr, "bench_hands: the picture at the tip changes without a motion: not measured\n");
  } else if (report->Wants("hands.input_to_picture_ms")) {
    const auto ms = Repeat(count, "picture", [&](int pixels) { return session.InputToPicture(pixels); });
    report->Add("hands.input_to_picture_ms_p50", benchmark::Quantile(ms, 0.5), "ms");
    report->Add("hands.input_to_picture_ms_p95", benchmark::Quantile(ms, 0.95), "ms");
  }
  if (report->Wants("hands.silence_to_safe_ms")) {
    const auto ms =
        Repeat(report->quick() ? 3 : 20, "pedals up", [&](int /*pixels*/) { return session.SilenceToPedalsUp(); });
    report->Add("hands.silence_to_safe_ms_max", benchmark::Quantile(ms, 1), "ms");
  }
  session.End();
  return 0;
}

}  // namespace
}  // namespace fulcrum

int main(int argc, char** argv) {
  fulcrum::benchmark::Report report(argc, argv);
  return report.Wants("hands.") ? fulcrum::Run(&report) : 0;
}
