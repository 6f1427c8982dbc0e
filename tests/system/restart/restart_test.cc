// The whole cart, as a user starts it: five processes over DDS with the small scene. Each node is killed in mid-run,
// while the hook cuts; the session must go on and end well.

#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <sstream>
#include <string>
#include <thread>

namespace fulcrum {
namespace {

namespace fs = std::filesystem;
using std::chrono::duration;
using std::chrono::steady_clock;

constexpr double kStartLimit_s = 60.0;  // compiling the scene and five starts, on a busy machine
constexpr double kEndLimit_s = 60.0;    // the script's 6 s, closing and the report, on a busy machine
constexpr double kRejoinLimit_s = 2.0;  // what the cart promises for a killed node
constexpr const char* kNodes[] = {"handle_bridge", "haptics_node", "physics_node", "thermal_node", "render_node"};

/// Children of `parent` by the name of their executable.
std::map<std::string, pid_t> ChildrenOf(pid_t parent) {
  std::map<std::string, pid_t> children;
  for (const auto& entry : fs::directory_iterator("/proc")) {
    const std::string name = entry.path().filename();
    if (name.find_first_not_of("0123456789") != std::string::npos) continue;
    std::ifstream stat(entry.path() / "stat");
    std::string line;
    if (!std::getline(stat, line)) continue;
    const auto open = line.find('('), close = line.rfind(')');
    if (open == std::string::npos || close == std::string::npos) continue;
    std::istringstream rest(line.substr(close + 1));
    char state = '?';
    pid_t ppid = 0;
    rest >> state >> ppid;
    if (ppid == parent && state != 'Z') children[line.substr(open + 1, close - open - 1)] = std::stoi(name);
  }
  return children;
}

bool WaitFor(double limit_s, const std::function<bool()>& done) {
  const auto start = steady_clock::now();
  while (duration<double>(steady_clock::now() - start).count() < limit_s) {
    if (done()) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  return done();
}

std::string ReadFile(const fs::path& file) {
  std::ifstream in(file);
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

/// Number of a key in the flat summary.json.
std::optional<double> Figure(const std::string& json, const std::string& key) {
  const auto at = json.find("\"" + key + "\":");
  if (at == std::string::npos) return std::nullopt;
  return std::strtod(json.c_str() + at + key.size() + 3, nullptr);
}

/// One run of `fulcrum up small`; everything is gone when the object is.
class Cart {
 public:
  explicit Cart(int domain) {
    folder_ =
        fs::temp_directory_path() / ("fulcrum-restart-" + std::to_string(getpid()) + "-" + std::to_string(domain));
    fs::remove_all(folder_);
    fs::create_directories(folder_);
    pid_ = fork();
    if (pid_ == 0) {
      const int log = open((folder_ / "up.log").c_str(), O_CREAT | O_WRONLY, 0600);
      dup2(log, 1);
      dup2(log, 2);
      const std::string program = std::string(FULCRUM_BIN_DIR) + "/fulcrum", number = std::to_string(domain);
      execl(program.c_str(), "fulcrum", "up", "small", "--domain", number.c_str(), "--out", folder_.c_str(), nullptr);
      _exit(127);
    }
  }
  ~Cart() {
    if (!ended_) {
      kill(pid_, SIGKILL);
      waitpid(pid_, nullptr, 0);
    }
    std::error_code ignored;
    fs::remove_all(folder_, ignored);
  }
  Cart(const Cart&) = delete;
  Cart& operator=(const Cart&) = delete;

  [[nodiscard]] pid_t pid() const { return pid_; }
  [[nodiscard]] std::string log() const { return ReadFile(folder_ / "up.log"); }
  [[nodiscard]] fs::path session() const { return folder_ / "latest"; }

  /// Exit status of `fulcrum up`, or nothing if it does not end.
  std::optional<int> WaitForEnd() {
    int status = 0;
    if (!WaitFor(kEndLimit_s, [&] { return waitpid(pid_, &status, WNOHANG) == pid_; })) return std::nullopt;
    ended_ = true;
    return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  }

 private:
  fs::path folder_;
  pid_t pid_ = -1;
  bool ended_ = false;
};

/// The hook is at work: the heat has cut something. Seen from outside by the pictures' session time.
bool InMidRun(const Cart& cart) {
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator(cart.session() / "frames", ignored)) {
    const std::string name = entry.path().filename();
    if (name.ends_with(".png") && name >= "frame_0002900.png") return true;
  }
  return false;
}

class KilledNode : public testing::TestWithParam<int> {};

TEST_P(KilledNode, IsRestartedRejoinsAndTheRunEndsWell) {
  const std::string victim = kNodes[GetParam()];
  Cart cart(91 + GetParam());
  std::map<std::string, pid_t> nodes;
  ASSERT_TRUE(WaitFor(kStartLimit_s, [&] { return InMidRun(cart); })) << cart.log();
  nodes = ChildrenOf(cart.pid());
  std::set<pid_t> pids;
  for (const char* node : kNodes) {
    ASSERT_TRUE(nodes.contains(node)) << node << " is not alive\n" << cart.log();
    pids.insert(nodes[node]);
  }
  ASSERT_EQ(pids.size(), std::size(kNodes)) << "each node is a process of its own";

  ASSERT_EQ(kill(nodes[victim], SIGKILL), 0);
  ASSERT_TRUE(WaitFor(kRejoinLimit_s,
                      [&] {
                        const auto now = ChildrenOf(cart.pid());
                        return now.contains(victim) && now.at(victim) != nodes[victim];
                      }))
      << victim << " was not started again";

  const auto exit_code = cart.WaitForEnd();
  ASSERT_TRUE(exit_code.has_value()) << "the session did not end\n" << cart.log();
  EXPECT_EQ(*exit_code, 0) << cart.log();
  const std::string summary = ReadFile(cart.session() / "summary.json");
  EXPECT_EQ(Figure(summary, victim + ".restarts"), 1.0) << summary;
  EXPECT_GT(Figure(summary, victim + ".longest_rejoin_s").value_or(0), 0.0) << summary;
  EXPECT_LE(Figure(summary, victim + ".longest_rejoin_s").value_or(1e9), kRejoinLimit_s) << summary;
  EXPECT_GT(Figure(summary, "cut_length_mm").value_or(0), 5.0) << "the cut went on";
  EXPECT_GT(Figure(summary, "max_displacement_mm").value_or(0), 5.0) << "the tissue was deformed";
  EXPECT_LE(Figure(summary, "peak_force_N").value_or(1e9), 3.3);
  for (const char* node : kNodes) {
    if (node != victim) {
      EXPECT_EQ(Figure(summary, std::string(node) + ".restarts"), 0.0) << node;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(EachNode, KilledNode, testing::Range(0, static_cast<int>(std::size(kNodes))),
                         [](const auto& node) { return std::string(kNodes[node.param]); });

TEST(Cart, EndsWhenInterruptedAndLeavesNoProcess) {
  Cart cart(96);
  ASSERT_TRUE(WaitFor(kStartLimit_s, [&] { return ChildrenOf(cart.pid()).size() == std::size(kNodes); })) << cart.log();
  const auto nodes = ChildrenOf(cart.pid());
  ASSERT_EQ(kill(cart.pid(), SIGINT), 0);
  ASSERT_TRUE(cart.WaitForEnd().has_value()) << cart.log();
  for (const auto& [name, pid] : nodes) EXPECT_NE(kill(pid, 0), 0) << name << " is still there";
}

}  // namespace
}  // namespace fulcrum
