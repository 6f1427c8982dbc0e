// How soon a gamepad shows in the force, and how soon one that is unplugged is safe. The window's input, in this
// process with a gamepad that SDL imitates, operates a live session; the device's own delay is not part of it.
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "render_node/input/window_input.h"
#include "services/base/runtime/cyclic_thread.h"
#include "services/transport/bus/dds/participant.h"
#include "services/transport/bus/input_account.h"
#include "tests/benchmark/report.h"
#include "tests/support/cart.h"
#include "tests/support/session_bus.h"
#include "tests/support/virtual_pad.h"
#include "tests/support/virtual_screen.h"
#include "tests/support/xclient.h"

namespace fulcrum {
namespace {

using runtime::MonotonicNs;
using testing::WaitFor;

constexpr int kDomain = 65;
constexpr double kPatience_s = 60;
constexpr std::int64_t kNever_ns = 500'000'000;
constexpr float kMoved_m = 2e-7f;  ///< A tip at rest moves less in a tick.

double Ms(std::int64_t ns) { return 1e-6 * static_cast<double>(ns); }

class PadSession {
 public:
  explicit PadSession(const std::string& display)
      : cart_("small", kDomain, {"--hands", "browser"}), screen_(display), window_(display) {}

  /// What went wrong; empty: the gamepad operates.
  std::string Begin() {
    reader_ = std::make_unique<bus::DdsParticipant>(testing::ReaderOf(kDomain, "watch"));
    tools_ = reader_->MakeInput<ToolState>();
    handles_ = reader_->MakeInput<HandleState>();
    writer_ = std::make_unique<bus::DdsParticipant>(testing::WriterOf(kDomain, "pad"));
    output_ = writer_->MakeOutput<OperatorInput>();
    if (!WaitFor(kPatience_s, [&] {
          Look();
          return tool_.tools[1].kind != ToolKind::kNone && handle_.handles[1].present;
        })) {
      return "the tools do not come\n" + cart_.Said();
    }
    const auto write = [this](const OperatorInput& input) {
      OperatorInput stamped = input;
      stamped.stamp = stamper_.Next(input.stamp.stamp_ns);
      output_->Write(stamped);
    };
    input_ = std::make_unique<render::WindowInput>(screen_, window_.id(), write);
    return Plug() ? std::string() : "the gamepad does not take the tools\n" + cart_.Said();
  }

  /// From a stick's motion to the tick whose device position contains it [ms]; negative: it never came.
  double ToForce(float deflection) {
    Look();
    const Vec3f before = tool_.tools[1].p_WT;
    const std::int64_t moved_ns = MonotonicNs();
    pad_->Axis(SDL_CONTROLLER_AXIS_LEFTX, deflection);
    double ms = -1;
    while (ms < 0 && MonotonicNs() - moved_ns < kNever_ns) {
      while (ms < 0 && tools_->TakeNext(&tool_)) {
        if (tool_.stamp.stamp_ns > moved_ns && (tool_.tools[1].p_WT - before).norm() > kMoved_m) {
          ms = Ms(tool_.stamp.stamp_ns - moved_ns);
        }
      }
      std::this_thread::sleep_for(std::chrono::microseconds(200));
    }
    pad_->Axis(SDL_CONTROLLER_AXIS_LEFTX, 0);
    return ms;
  }

  /// From the plug to pedals up [ms], while a trigger is held; negative: it never came.
  double UnplugToPedalsUp() {
    pad_->Axis(SDL_CONTROLLER_AXIS_TRIGGERRIGHT, 1);
    if (!PedalsAre(kPedalCut)) return -1;
    const std::int64_t unplugged_ns = MonotonicNs();
    pad_->Unplug();
    double ms = -1;
    while (ms < 0 && MonotonicNs() - unplugged_ns < kNever_ns) {
      while (ms < 0 && handles_->TakeNext(&handle_)) {
        if (handle_.pedals == kPedalNone) ms = Ms(handle_.stamp.stamp_ns - unplugged_ns);
      }
      std::this_thread::sleep_for(std::chrono::microseconds(200));
    }
    return Plug() ? ms : -1;
  }

 private:
  void Look() {
    while (tools_->TakeNext(&tool_)) {
    }
    while (handles_->TakeNext(&handle_)) {
    }
    if (!input_) return;
    HandsView view;
    for (std::size_t i = 0; i < kMaxTools; ++i) {
      view.present[i] = tool_.tools[i].kind != ToolKind::kNone;
      view.tip[i] = tool_.tools[i].p_WT;
    }
    input_->SetView(view);
  }
  bool PedalsAre(std::uint8_t pedals) {
    return WaitFor(5, [&] {
      Look();
      return handle_.pedals == pedals;
    });
  }
  /// Plugs a gamepad in and takes the tools with it.
  bool Plug() {
    const auto is = [this](bool gamepad, bool active) {
      return WaitFor(5, [&] {
        Look();
        return input_->state().gamepad == gamepad && input_->state().active == active;
      });
    };
    if (!is(false, false)) return false;
    pad_ = std::make_unique<testing::VirtualPad>();
    if (!is(true, false)) return false;
    pad_->Button(SDL_CONTROLLER_BUTTON_START, true);
    return is(true, true);
  }

  testing::Cart cart_;
  std::string screen_;
  testing::BareWindow window_;
  std::unique_ptr<bus::DdsParticipant> reader_, writer_;
  std::unique_ptr<bus::Input<ToolState>> tools_;
  std::unique_ptr<bus::Input<HandleState>> handles_;
  std::unique_ptr<bus::Output<OperatorInput>> output_;
  bus::Stamper stamper_{MonotonicNs()};
  std::unique_ptr<render::WindowInput> input_;
  std::unique_ptr<testing::VirtualPad> pad_;
  ToolState tool_;
  HandleState handle_;
};

int Run(benchmark::Report* report) {
  const testing::VirtualScreen screen;
  if (screen.display().empty()) {
    std::fprintf(stderr, "bench_pad: Xvfb is needed; apt install xvfb\n");
    return 1;
  }
  PadSession session(screen.display());
  if (const std::string wrong = session.Begin(); !wrong.empty()) {
    std::fprintf(stderr, "bench_pad: %s\n", wrong.c_str());
    return 1;
  }
  const auto repeat = [](int count, const auto& measure) {
    std::vector<double> values;
    for (int i = 0; i < count; ++i) {
      const double value = measure(i);
      value < 0 ? void(std::fprintf(stderr, "bench_pad: %d of %d never came\n", i + 1, count))
                : values.push_back(value);
      // At rest again, and not in step with anything that is periodic.
      std::this_thread::sleep_for(std::chrono::milliseconds(211 + 7 * (i % 11)));
    }
    return values;
  };
  const bool quick = report->quick();
  const auto force_ms = repeat(quick ? 20 : 200, [&](int i) { return session.ToForce(i % 2 == 0 ? 1.0f : -1.0f); });
  report->Add("hands.pad_to_force_ms_p50", benchmark::Quantile(force_ms, 0.5), "ms");
  report->Add("hands.pad_to_force_ms_p99", benchmark::Quantile(force_ms, 0.99), "ms");
  const auto safe_ms = repeat(quick ? 3 : 20, [&](int /*i*/) { return session.UnplugToPedalsUp(); });
  report->Add("hands.pad_unplug_to_safe_ms_max", benchmark::Quantile(safe_ms, 1), "ms");
  return 0;
}

}  // namespace
}  // namespace fulcrum

int main(int argc, char** argv) {
  fulcrum::benchmark::Report report(argc, argv);
  return report.Wants("hands.pad_") ? fulcrum::Run(&report) : 0;
}
