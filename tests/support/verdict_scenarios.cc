#include "tests/support/verdict_scenarios.h"

#include <signal.h>
#include <sys/ptrace.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <memory>
#include <system_error>
#include <thread>

#include "services/base/core/messages.h"
#include "services/scene/builder/build.h"
#include "services/scene/format/scene_file.h"
#include "tests/support/cart.h"
#include "tests/support/program.h"
#include "tests/support/working_scene.h"

namespace fulcrum::testing {
namespace {

namespace fs = std::filesystem;
using Words = std::vector<std::string>;

constexpr double kPatience_s = 60;  // For the end of a session on a busy machine.

void Sleep(double seconds) { std::this_thread::sleep_for(std::chrono::duration<double>(seconds)); }

class Scratch {
 public:
  explicit Scratch(int domain)
      : path_(fs::temp_directory_path() /
              ("fulcrum-verdict-" + std::to_string(::getpid()) + "-" + std::to_string(domain))) {
    fs::remove_all(path_);
    fs::create_directories(path_);
  }
  ~Scratch() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  Scratch(const Scratch&) = delete;
  Scratch& operator=(const Scratch&) = delete;
  [[nodiscard]] const fs::path& path() const { return path_; }

 private:
  fs::path path_;
};

// ------------------------------------------------------------------------------------------------------ fake nodes

/// The small scene with fake nodes in place of the real ones.
class FakeCart {
 public:
  FakeCart(int domain, const std::vector<NodeId>& nodes) : domain_(domain), folder_(domain) {
    fs::create_directories(out());
    fs::create_directories(folder_.path() / "bin");
    fs::copy_file(fs::path(FULCRUM_BIN_DIR) / "fulcrum", fulcrum());
    data_ = scene::BuildProcedural(scene::Small());
    data_.fixed.node_mask = 0;
    data_.fixed.script_duration_s = 0;
    data_.script.clear();
    for (const NodeId node : nodes) {
      AddProgram(node);
      data_.fixed.node_mask |= 1u << static_cast<unsigned>(node);
    }
  }
  void AddProgram(NodeId node) const {
    fs::copy_file(fs::path(FULCRUM_BIN_DIR) / "supervisor_fake_node", folder_.path() / "bin" / NodeName(node));
  }
  /// Sets the behaviour of a node, see fake_node.cc.
  void Order(NodeId node, const std::string& what) const {
    std::ofstream(out() / (std::string(NodeName(node)) + ".do")) << what << "\n";
  }
  /// A script that cuts for `seconds`.
  void Cut(float seconds) {
    data_.fixed.script_duration_s = seconds;
    const Vec3f here = data_.fixed.tools[1].p_WP - Vec3f(0, 0, 0.05f);
    data_.script = {{0, 1, here, 0, kPedalCut, 35}, {seconds, 1, here, 0, kPedalNone, 0}};
  }
  void Start(const Words& more = {}) {
    const fs::path scene = folder_.path() / "tiny.fulcrum";
    scene::WriteSceneFile(data_, "name: tiny\n", scene);
    // No identity of a keyed bus has the rights for the ports of the fake node; the scenarios swap it by its path.
    Words words{"up",        scene, "--domain",   std::to_string(domain_),
                "--out",     out(), "--open-bus", "--allow-swap-command",
                "--no-video"};
    words.insert(words.end(), more.begin(), more.end());
    up_ = Program(fulcrum(), words);
  }
  /// Waits until the session has begun.
  bool Begins() {
    return WaitFor(kPatience_s, [this] { return up_.Said().find("\nt ") != std::string::npos; });
  }
  [[nodiscard]] pid_t Process(NodeId node) const {
    const auto nodes = ChildrenOf(up_.pid());
    const auto found = nodes.find(NodeName(node));
    return found == nodes.end() ? -1 : found->second;
  }
  /// kill -9, and waits until the node runs again.
  void Kill(NodeId node) const {
    const pid_t victim = Process(node);
    if (victim > 0) ::kill(victim, SIGKILL);
    (void)WaitFor(kPatience_s, [&] { return Process(node) > 0 && Process(node) != victim; });
    Sleep(0.6);  // Until the node reports.
  }
  /// A subcommand for this session.
  void Command(Words words) const {
    words.insert(words.end(), {"--domain", std::to_string(domain_)});
    (void)Program(fulcrum(), words).End(0);
    Sleep(0.8);
  }
  std::string End(int signal, int* exit_code) {
    *exit_code = up_.End(signal);
    return up_.Said();
  }
  [[nodiscard]] fs::path out() const { return folder_.path() / "out"; }
  [[nodiscard]] fs::path fulcrum() const { return folder_.path() / "bin" / "fulcrum"; }
  [[nodiscard]] const fs::path& folder() const { return folder_.path(); }

 private:
  int domain_;
  Scratch folder_;
  scene::SceneData data_;
  Program up_;
};

using enum NodeId;

/// A scenario with fake nodes: `prepare` runs before the start, `suffer` during the session. Without `suffer` it ends
/// after `seconds`, otherwise by Ctrl-C after `suffer`.
Scenario Fake(const std::string& name, int exit_code, const std::string& fault, const std::vector<NodeId>& nodes,
              const Words& more, const std::function<void(FakeCart&)>& prepare,
              const std::function<void(FakeCart&)>& suffer) {
  return {name, false, exit_code, fault, [=](int domain, int* code, double*) {
            FakeCart cart(domain, nodes);
            if (prepare) prepare(cart);
            cart.Start(more);
            if (!suffer) return cart.End(0, code);
            if (cart.Begins()) suffer(cart);
            return cart.End(SIGINT, code);
          }};
}

void AddFakes(std::vector<Scenario>* all) {
  const std::vector<NodeId> two{kPhysics, kThermal}, servo{kHaptics, kPhysics};
  const std::vector<NodeId> whole{kHandleBridge, kHaptics, kPhysics, kThermal};
  const auto order = [](NodeId node, const std::string& what) {
    return [=](FakeCart& cart) { cart.Order(node, what); };
  };
  const auto recorder = [](const std::string& what) {
    return [=](FakeCart& cart) {
      cart.AddProgram(kRecorder);
      cart.Order(kRecorder, what);
    };
  };
  const auto none = std::function<void(FakeCart&)>();
  const auto add = [all](Scenario scenario) { all->push_back(std::move(scenario)); };
  const Words short_time{"--seconds", "2"}, longer{"--seconds", "4.5"}, recorded{"--seconds", "2", "--record"};

  add(Fake("fake_healthy", 0, "", two, short_time, none, none));
  add(Fake("fake_killed_once", 0, "", two, {}, none, [](FakeCart& cart) { cart.Kill(kPhysics); }));
  add(Fake("fake_killed_too_often", 1, "physics_node died 4 times, of which 3 are allowed", two, {}, none,
           [](FakeCart& cart) {
             for (int kill = 0; kill < 4; ++kill) cart.Kill(kPhysics);
           }));
  add(Fake("fake_crash_loop", 1, "thermal_node killed by signal 6", two, {}, order(kThermal, "crash"), none));
  add(Fake("fake_exit_3", 3, "thermal_node ended with exit code 3", two, {}, order(kThermal, "exit 3"), none));
  add(Fake("fake_exit_4_keep_going", 4, "thermal_node ended with exit code 4", two, {"--seconds", "2", "--keep-going"},
           order(kThermal, "exit 4"), none));
  add(Fake("fake_stuck", 1, "physics_node was stuck", two, longer, order(kPhysics, "hang once"), none));
  add(Fake("fake_slow", 1, "physics_node ran at", two, longer, order(kPhysics, "step 25"), none));
  add(Fake("fake_quarantine", 1, "physics_node reset 3 particles", two, short_time,
           order(kPhysics, "metric quarantined 3"), none));
  add(Fake("fake_foreign_samples", 1, "nodes dropped 5 samples of another session", two, short_time,
           order(kThermal, "metric foreign_samples 5"), none));
  add(Fake("fake_recorder_losses", 1, "the recorder lost samples", two, recorded, recorder("lost 7"), none));
  add(Fake("fake_recording_ended", 1, "the recording ended before the session", two, recorded,
           recorder("metric recording_ended 1"), none));
  add(Fake("fake_restarted_by_command", 0, "", two, {}, none, [](FakeCart& cart) {
    for (int restart = 0; restart < 4; ++restart) cart.Command({"restart", "thermal_node"});
  }));
  add(Fake(
      "fake_swapped_by_command", 0, "", two, {},
      [](FakeCart& cart) {
        fs::create_directory(cart.folder() / "other");
        fs::create_symlink(fs::path(FULCRUM_BIN_DIR) / "supervisor_fake_node",
                           cart.folder() / "other" / "thermal_node");
      },
      [](FakeCart& cart) {
        cart.Command({"swap", "thermal_node", "--with", cart.folder() / "other" / "thermal_node"});
      }));
  add(Fake(
      "fake_nothing_was_cut", 1, "nothing was cut", whole, {}, [](FakeCart& cart) { cart.Cut(4); }, none));
  add(Fake(
      "fake_no_heat_no_cut", 0, "", {kHandleBridge, kHaptics, kPhysics}, {}, [](FakeCart& cart) { cart.Cut(4); },
      none));
  // The node with a spare: it hangs, is killed, and its spare continues.
  add(Fake("fake_picture_hangs", 1, "render_node was stuck", {kPhysics, kRender}, longer, order(kRender, "hang once"),
           none));
  // A folder in place of the file, because root may write everywhere else.
  add(Fake("fake_no_summary", 1, "summary.json", servo, {}, none,
           [](FakeCart& cart) { fs::create_directory(cart.out() / "latest" / "summary.json"); }));
}

// ------------------------------------------------------------------------------------------------------ real carts

/// A whole cart at work, 0.5 s after the first line of progress.
class RealCart {
 public:
  RealCart(int domain, const std::string& scene, const Words& more)
      : domain_(domain), cart_(std::make_unique<Cart>(scene, domain, more)) {
    (void)WaitFor(kPatience_s, [this] { return cart_->Said().find("\nt ") != std::string::npos || Ended(); });
    Sleep(0.5);
  }
  [[nodiscard]] pid_t Process(const std::string& node) const {
    const auto nodes = cart_->nodes();
    const auto found = nodes.find(node);
    return found == nodes.end() ? -1 : found->second;
  }
  void Signal(const std::string& node, int signal) const {
    if (const pid_t process = Process(node); process > 0) ::kill(process, signal);
  }
  void Stop(const std::string& node, double seconds) const {
    const pid_t process = Process(node);
    if (process <= 0) return;
    ::kill(process, SIGSTOP);
    Sleep(seconds);
    ::kill(process, SIGCONT);
  }
  void Kill(const std::string& node) const {
    const pid_t victim = Process(node);
    if (victim > 0) ::kill(victim, SIGKILL);
    (void)WaitFor(kPatience_s, [&] { return Process(node) > 0 && Process(node) != victim; });
    Sleep(0.8);
  }
  std::string End(int* exit_code) {
    *exit_code = cart_->WaitForEnd(kPatience_s).value_or(-1000);
    return cart_->Said();
  }
  [[nodiscard]] const Cart& cart() const { return *cart_; }
  [[nodiscard]] int domain() const { return domain_; }

 private:
  [[nodiscard]] bool Ended() const { return cart_->Said().find("report: ") != std::string::npos; }

  int domain_;
  std::unique_ptr<Cart> cart_;
};

Scenario Real(const std::string& name, int exit_code, const std::string& fault, const Words& more,
              const std::function<void(RealCart&, double*)>& suffer) {
  return {name, true, exit_code, fault, [=](int domain, int* code, double* picture_back_s) {
            RealCart cart(domain, "small", more);
            if (suffer) suffer(cart, picture_back_s);
            return cart.End(code);
          }};
}

/// Thread that draws: only cyclic threads set the timer slack to the minimum.
pid_t CyclicThreadOf(pid_t process) {
  std::error_code error;
  for (const auto& entry : fs::directory_iterator("/proc/" + std::to_string(process) + "/task", error)) {
    const std::string task = entry.path().filename();
    std::ifstream slack("/proc/" + task + "/timerslack_ns");
    long ns = 0;
    if (slack >> ns && ns == 1) return std::stoi(task);
  }
  return -1;
}

/// Time until a new picture exists [s].
/// @param held thread traced by this one: a killed process ends only after its tracer has been notified; 0: none.
double UntilNextPicture(const Cart& cart, pid_t held = 0) {
  const auto begin = std::chrono::steady_clock::now();
  const double newest_s = cart.PictureTime();
  (void)WaitFor(kPatience_s, [&] {
    if (held > 0) (void)::waitpid(held, nullptr, WNOHANG | __WALL);
    return cart.PictureTime() > newest_s;
  });
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

/// Stops only the thread that draws, like a fault of a graphics driver.
void HangPicture(RealCart& cart, double* picture_back_s) {
  // The spare that takes over is prepared in the first seconds.
  (void)WaitFor(kPatience_s, [&] { return cart.Process("render_spare") > 0; });
  Sleep(1);
  const pid_t thread = CyclicThreadOf(cart.Process("render_node"));
  if (thread <= 0 || ::ptrace(PTRACE_ATTACH, thread, nullptr, nullptr) != 0) return;
  (void)::waitpid(thread, nullptr, __WALL);
  Sleep(0.1);  // For a picture that was being written.
  *picture_back_s = 0.1 + UntilNextPicture(cart.cart(), thread);
}

/// Stops a node for a share of each second.
void Slow(const RealCart& cart, const std::string& node, double share) {
  for (int second = 0; second < 6; ++second) {
    cart.Stop(node, share);
    Sleep(1 - share);
  }
}

std::string StrangerRefused(int domain, int* exit_code) {
  const Scratch scratch(domain);
  for (const char* keys : {"ours", "theirs"}) {
    if (Program("fulcrum", {"keys", "init", scratch.path() / keys}).End(0) != 0) return "no keys";
  }
  const fs::path file = scratch.path() / "cart.yaml";
  std::ofstream(file) << "security: {keys: ours}\n";
  RealCart cart(domain, "small", {"--cart", file, "--seconds", "6"});
  Program stranger("security_intruder",
                   {std::to_string(domain), "stranger", scratch.path() / "theirs", "thermal_node"});
  const bool refused =
      WaitFor(kPatience_s, [&] { return cart.cart().Said().find("! refused: ") != std::string::npos; });
  const std::string said = cart.End(exit_code);
  return (refused ? "" : "nobody was refused: not well\n") + said;
}

std::string WithoutHeat(int domain, int* exit_code) {
  const Scratch scratch(domain);
  const fs::path scene = scratch.path() / "cold.yaml";
  std::ofstream(scene) << WorkingScene("small", 5, "[handle_bridge, haptics_node, physics_node]");
  Cart cart(scene, domain);
  *exit_code = cart.WaitForEnd(kPatience_s).value_or(-1000);
  return cart.Said();
}

void AddReals(std::vector<Scenario>* all) {
  const auto add = [all](Scenario scenario) { all->push_back(std::move(scenario)); };
  const Words six{"--seconds", "6"}, eight{"--seconds", "8"}, recorded{"--seconds", "6", "--record"};
  using C = RealCart;
  add(Real("healthy_recorded", 0, "", recorded, {}));
  add({"healthy_without_heat", true, 0, "", [](int domain, int* code, double*) { return WithoutHeat(domain, code); }});
  add({"stranger_refused", true, 0, "", [](int domain, int* code, double*) { return StrangerRefused(domain, code); }});
  add(Real("servo_stopped_3_of_6_s", 1, "haptics_node was silent", six,
           [](C& cart, double*) { cart.Stop("haptics_node", 3); }));
  add(Real("servo_at_half_rate", 1, "haptics_node ran at", eight,
           [](C& cart, double*) { Slow(cart, "haptics_node", 0.5); }));
  add(Real("servo_misses_deadlines", 1, "haptics_node missed", eight,
           [](C& cart, double*) { Slow(cart, "haptics_node", 0.27); }));
  add(Real("physics_killed_once", 0, "", six, [](C& cart, double*) { cart.Kill("physics_node"); }));
  add(Real("physics_killed_too_often", 1, "physics_node died 4 times", {"--seconds", "12"}, [](C& cart, double*) {
    for (int kill = 0; kill < 4; ++kill) cart.Kill("physics_node");
  }));
  add(Real("recorder_killed", 1, "samples were lost with the recorder", recorded,
           [](C& cart, double*) { cart.Kill("recorder"); }));
  add(Real("restarted_by_command", 0, "", eight, [](C& cart, double*) {
    for (const char* node : {"thermal_node", "haptics_node", "handle_bridge", "physics_node"}) {
      (void)Program("fulcrum", {"restart", node, "--domain", std::to_string(cart.domain())}).End(0);
      Sleep(0.7);
    }
  }));
  // A file in place of the folder, because root may write everywhere else.
  add(Real("pictures_not_writable", 1, "render_node could not write", six, [](C& cart, double*) {
    fs::remove_all(cart.cart().session() / "frames");
    std::ofstream(cart.cart().session() / "frames") << "not a folder";
  }));
  add(Real("picture_hangs", 1, "render_node was stuck", eight, HangPicture));
  add(Real("picture_suspended", 1, "render_node was silent", eight, [](C& cart, double* picture_back_s) {
    (void)WaitFor(kPatience_s, [&] { return cart.Process("render_spare") > 0; });
    Sleep(1);
    cart.Signal("render_node", SIGSTOP);
    *picture_back_s = UntilNextPicture(cart.cart());
  }));
}

}  // namespace

const std::vector<Scenario>& VerdictScenarios() {
  static const std::vector<Scenario> kAll = [] {
    std::vector<Scenario> all;
    AddFakes(&all);
    AddReals(&all);
    return all;
  }();
  return kAll;
}

ScenarioResult RunScenario(const Scenario& scenario, int domain) {
  ScenarioResult result;
  int exit_code = -1;
  result.said = scenario.run(domain, &exit_code, &result.picture_back_s);
  const auto says = [&](const std::string& text) { return result.said.find(text) != std::string::npos; };
  if (exit_code != scenario.exit_code) {
    result.wrong = "exit code " + std::to_string(exit_code) + " instead of " + std::to_string(scenario.exit_code);
  } else if (scenario.fault.empty()) {
    if (says("! not well: ") || !says(": all well")) result.wrong = "it is called not well";
  } else {
    const std::size_t told = result.said.find("! not well: ");
    const std::size_t end = result.said.find("NOT WELL: ");
    const auto names = [&](std::size_t from) {
      return from != std::string::npos && result.said.find(scenario.fault, from) != std::string::npos;
    };
    if (!names(told)) result.wrong = "the fault is not told when it happens";
    if (!names(end)) result.wrong = "the fault is not in the verdict";
  }
  return result;
}

}  // namespace fulcrum::testing
