// The whole cart at work, as a user runs it: five nodes and the recorder over DDS on this machine, the built-in scene
// with its script of traction and cutting. Then the same ticks again, each node alone and without other processes: what
// the session adds to a step. The start, as one waits for it; the window, as one looks at it; and the cart at rest.
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <initializer_list>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "services/apps/replayer/node_test.h"
#include "services/base/config/cart.h"
#include "services/records/log_tools/recording.h"
#include "services/scene/format/scene_file.h"
#include "services/transport/bus/convert/cdr.h"
#include "tests/benchmark/report.h"
#include "tests/support/cart.h"
#include "tests/support/mouse_operator.h"
#include "tests/support/session_bus.h"
#include "tests/support/virtual_screen.h"

namespace fulcrum {
namespace {

namespace fs = std::filesystem;
using benchmark::Report;

constexpr int kDomain = 89;
constexpr double kPatience_s = 60;

double CpuSeconds(const testing::Cart& cart) {
  double sum = testing::CpuSeconds(cart.pid()).value_or(0);
  for (const auto& [name, pid] : testing::ChildrenOf(cart.pid())) sum += testing::CpuSeconds(pid).value_or(0);
  return sum;
}

/// The share of one core that the cart takes for some seconds [%].
double CpuPct(const testing::Cart& cart, double seconds) {
  const double before = CpuSeconds(cart);
  std::this_thread::sleep_for(std::chrono::duration<double>(seconds));
  return 100 * (CpuSeconds(cart) - before) / seconds;
}

/// The last value of a metric in a node's recorded Health.
std::optional<double> LastMetric(const fs::path& recording, NodeId node, const std::string& name) {
  std::optional<double> last;
  log_tools::Recording file(recording, {.topics = {"Health"}});
  log_tools::Entry entry;
  while (file.Next(&entry)) {
    (void)log_tools::WithDecoded(*entry.source->topic, entry.message.data, [&]<class T>(const T& message) {
      if constexpr (std::is_same_v<T, Health>) {
        if (message.node != node) return;
        for (const Metric& metric : message.metrics) {
          if (metric.name == name) last = metric.value;
        }
      }
    });
  }
  return last;
}

/// Pictures that render_node draws in some seconds.
double PicturesIn(double seconds) {
  testing::Eyes eyes(kDomain);
  const auto drawn = [&eyes] {
    double pictures = std::numeric_limits<double>::quiet_NaN();
    (void)testing::WaitFor(kPatience_s, [&] {
      eyes.Look();
      return std::isfinite(pictures = eyes.Metric(NodeId::kRender, "frames_drawn"));
    });
    return pictures;
  };
  const double before = drawn();
  std::this_thread::sleep_for(std::chrono::duration<double>(seconds));
  return drawn() - before;
}

/// Bytes of TissueFrame on the bus, a period of physics, in some seconds.
double FrameBytes(double seconds) {
  constexpr double kPhysics_Hz = 100;
  bus::DdsParticipant participant(testing::ReaderOf(kDomain, "frames"));
  const auto frames = participant.MakeInput<TissueFrame>();
  TissueFrame frame;
  // A late joiner gets the last frames at once: they were sent before.
  (void)testing::WaitFor(kPatience_s, [&] { return frames->TakeLatest(&frame); });
  std::vector<std::uint8_t> bytes;
  double sum = 0;
  const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double>(seconds);
  while (std::chrono::steady_clock::now() < end) {
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
    if (frames->TakeLatest(&frame) && bus::EncodeCdr(frame, &bytes)) sum += static_cast<double>(bytes.size());
  }
  return sum / (kPhysics_Hz * seconds);
}

struct Step {
  double p50_ms = 0, p99_ms = 0;
};

/// The recorded ticks of a node again, alone in this process, on one thread as in the session.
Step StepAlone(const fs::path& session, NodeId node) {
  const fs::path folder = fs::temp_directory_path() / ("bench_cart." + std::to_string(::getpid()));
  fs::create_directories(folder);
  replay::LockStepSettings settings;
  settings.recording = session / "recording.mcap";
  settings.nodes = {node};
  settings.folder = folder;
  const scene::SceneFile scene(session / "scene.fulcrum");
  const config::CartConfig cart = config::LoadCart(session / "cart.yaml");
  const replay::NodeTestResult result = replay::TestNode(settings, {}, scene.view(), cart, [](double) {});
  fs::remove_all(folder);
  return {result.figures.at("step_p50_ms"), result.figures.at("step_p99_ms")};
}

bool Work(Report* report) {
  const int seconds = report->quick() ? 12 : 20;
  testing::Cart cart("built-in", kDomain, {"--record", "--seconds", std::to_string(seconds)});
  // The pull and the cut: from 4 s on everything works.
  if (!testing::WaitFor(kPatience_s, [&] { return cart.PictureTime() > 4; })) return false;
  report->Add("cart.cpu_pct", CpuPct(cart, 6), "%");
  const std::optional<int> code = cart.WaitForEnd(kPatience_s);
  if (!code) return false;
  // A node that was late makes the session end badly, and is a figure here.
  if (*code != 0) std::fprintf(stderr, "bench_cart: %s\n", cart.Said().c_str());
  const fs::path session = cart.session();
  const std::string summary = testing::ReadFile(session / "summary.json");
  const double session_s = testing::FigureOf(summary, "session_seconds");
  for (const auto& [node, key] : {std::pair{NodeId::kPhysics, "physics"},
                                  {NodeId::kThermal, "thermal"},
                                  {NodeId::kHaptics, "haptics"},
                                  {NodeId::kRender, "render"}}) {
    const std::string from = std::string(NodeName(node)) + ".", stem = std::string("cart.") + key + ".";
    const Step live{testing::FigureOf(summary, from + "step_p50_ms"), testing::FigureOf(summary, from + "step_p99_ms")};
    report->Add(stem + "step_ms_p50", live.p50_ms, "ms");
    report->Add(stem + "step_ms_p99", live.p99_ms, "ms");
    const double ticks = testing::FigureOf(summary, from + "ticks");
    report->Add(stem + "missed_pct", 100 * testing::FigureOf(summary, from + "overruns") / ticks, "%");
    if (node != NodeId::kPhysics && node != NodeId::kThermal) continue;
    const Step alone = StepAlone(session, node);
    report->Add(stem + "alone_step_ms_p50", alone.p50_ms, "ms");
    report->Add(stem + "alone_step_ms_p99", alone.p99_ms, "ms");
    report->Add(stem + "bench_to_live_ratio", live.p50_ms / alone.p50_ms, "1");
  }
  const fs::path recording = session / "recording.mcap";
  if (const auto drawn = LastMetric(recording, NodeId::kRender, "frames_drawn")) {
    report->Add("cart.pictures_per_s", *drawn / session_s, "1/s");
  }
  report->Add("cart.recording_MB_per_s", 1e-6 * static_cast<double>(fs::file_size(recording)) / session_s, "MB/s");
  return true;
}

/// The operation with a reader of live pictures, as the console's page is: the way from a motion to force and picture.
bool Live(Report* report) {
  const int seconds = report->quick() ? 12 : 20;
  testing::Cart cart("built-in", kDomain, {"--record", "--seconds", std::to_string(seconds)});
  if (!testing::WaitFor(kPatience_s, [&] { return cart.PictureTime() > 4; })) return false;
  {
    bus::DdsParticipant participant(testing::ReaderOf(kDomain, "watch"));
    std::atomic<int> pictures{0};
    const auto reader = participant.MakeInput<Picture>([&pictures] { ++pictures; });
    constexpr auto kSettle = std::chrono::seconds(1);
    std::this_thread::sleep_for(kSettle);
    const int before = pictures;
    constexpr double kWatched_s = 5;
    std::this_thread::sleep_for(std::chrono::duration<double>(kWatched_s));
    report->Add("cart.live_pictures_per_s", (pictures - before) / kWatched_s, "1/s");
    if (!cart.WaitForEnd(kPatience_s)) return false;
  }
  const std::string summary = testing::ReadFile(cart.session() / "summary.json");
  for (const char* name :
       {"motion_to_force_p50_ms", "motion_to_force_p99_ms", "motion_to_picture_p50_ms", "motion_to_picture_p95_ms"}) {
    const std::string key = name;
    const std::size_t at = key.rfind("_p");  // The key has the unit before the quantile.
    report->Add("cart." + key.substr(0, at) + "_ms" + key.substr(at, 4), testing::FigureOf(summary, key), "ms");
  }
  return true;
}

/// From the command to the first picture on the disk, of a scene that was compiled before.
bool Start(Report* report) {
  std::vector<double> times_s;
  const int starts = report->quick() ? 2 : 7;
  for (int i = 0; i <= starts; ++i) {
    const auto begin = std::chrono::steady_clock::now();
    const testing::Cart cart("built-in", kDomain);
    while (cart.PictureTime() < 0) {
      const std::chrono::duration<double> waited = std::chrono::steady_clock::now() - begin;
      if (waited.count() > kPatience_s) return false;
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
    const std::chrono::duration<double> used = std::chrono::steady_clock::now() - begin;
    if (i > 0)
      times_s.push_back(used.count());  // The first one may compile the scene, and reads programs from the disk.
  }
  report->Add("cart.start_to_picture_s", benchmark::Quantile(times_s, 0.5), "s");
  report->Add("cart.start_to_picture_s_max", benchmark::Quantile(times_s, 1), "s");
  return true;
}

/// The operation in a window of the scene's size, 960 x 540, recorded.
bool Window(Report* report) {
  const testing::VirtualScreen screen;
  if (screen.display().empty()) {
    std::fprintf(stderr, "bench_cart: Xvfb is needed; apt install xvfb\n");
    return true;
  }
  ::setenv("DISPLAY", screen.display().c_str(), 1);
  struct Unset {
    ~Unset() { ::unsetenv("DISPLAY"); }  // The screen ends here, and sessions without a window follow.
  } unset;
  const int seconds = report->quick() ? 12 : 20;
  // The scene asks for 15 pictures a second; here nothing but the machine limits them.
  testing::Cart cart("built-in", kDomain,
                     {"--window", "--record", "--seconds", std::to_string(seconds), "--set", "render.rate_Hz=60"});
  // The pull and the cut.
  if (!testing::WaitFor(kPatience_s, [&] { return cart.PictureTime() > 4; })) return false;
  std::vector<double> rates_Hz;
  {
    testing::Eyes eyes(kDomain);
    const auto drawn = [&eyes] {
      eyes.Look();
      return eyes.Metric(NodeId::kRender, "frames_drawn");
    };
    double before = std::numeric_limits<double>::quiet_NaN();
    if (!testing::WaitFor(kPatience_s, [&] { return std::isfinite(before = drawn()); })) return false;
    for (int second = 0; second < (report->quick() ? 5 : 12); ++second) {
      std::this_thread::sleep_for(std::chrono::seconds(1));
      const double after = drawn();
      rates_Hz.push_back(after - before);
      before = after;
    }
  }
  report->Add("cart.window_fps_p50", benchmark::Quantile(rates_Hz, 0.5), "1/s");
  if (!cart.WaitForEnd(kPatience_s)) return false;
  const std::string summary = testing::ReadFile(cart.session() / "summary.json");
  report->Add("cart.window_servo_overruns_per_minute",
              60 * testing::FigureOf(summary, "haptics_node.overruns") / testing::FigureOf(summary, "session_seconds"),
              "1");
  return true;
}

/// Nothing touches the tissue: what the cart takes from the machine while it waits.
bool Idle(Report* report) {
  const fs::path yaml = fs::temp_directory_path() / ("bench_cart_idle." + std::to_string(::getpid()) + ".yaml");
  std::ofstream(yaml) << "name: idle\nbase: " << FULCRUM_SOURCE_DIR << "/deploy/scenes/built-in.yaml\n"
                      << "script:\n  duration_s: 60\n"
                      << "  tool0:\n    - {time_s: 0, sheet: [0.3, 0.5], height_mm: 55, jaw_deg: 20}\n"
                      << "  tool1:\n    - {time_s: 0, sheet: [0.7, 0.5], height_mm: 55}\n";
  bool well = false;
  {
    testing::Cart cart(yaml.string(), kDomain);
    well = testing::WaitFor(kPatience_s, [&] { return cart.PictureTime() >= 0; });
    if (well) {
      std::this_thread::sleep_for(std::chrono::seconds(4));  // The tissue comes to rest.
      report->Add("cart.idle_cpu_pct", CpuPct(cart, report->quick() ? 5 : 15), "%");
      report->Add("cart.pictures_drawn_at_rest", PicturesIn(report->quick() ? 5 : 20), "1");
      report->Add("body.frame_kB.rest", 1e-3 * FrameBytes(report->quick() ? 4 : 20), "kB");
    }
  }
  fs::remove(yaml);
  return well;
}

}  // namespace
}  // namespace fulcrum

int main(int argc, char** argv) {
  fulcrum::benchmark::Report report(argc, argv);
  const auto wants = [&report](std::initializer_list<const char*> stems) {
    return std::any_of(stems.begin(), stems.end(), [&report](const char* stem) { return report.Wants(stem); });
  };
  const bool idle = wants({"cart.idle_cpu_pct", "cart.pictures_drawn_at_rest", "body.frame_kB.rest"});
  const bool work = wants({"cart.cpu_pct", "cart.physics", "cart.thermal", "cart.haptics", "cart.render",
                           "cart.pictures_per_s", "cart.recording_MB_per_s"});
  const bool live = wants({"cart.live_pictures_per_s", "cart.motion_to_force_ms", "cart.motion_to_picture_ms"});
  const bool start = wants({"cart.start_to_picture_s"});
  const bool window = wants({"cart.window_"});
  if ((start && !fulcrum::Start(&report)) || (window && !fulcrum::Window(&report))) {
    std::fprintf(stderr, "bench_cart: the session did not begin or end\n");
    return 1;
  }
  if ((idle && !fulcrum::Idle(&report)) || (work && !fulcrum::Work(&report)) || (live && !fulcrum::Live(&report))) {
    std::fprintf(stderr, "bench_cart: the session did not begin or end\n");
    return 1;
  }
  return 0;
}
