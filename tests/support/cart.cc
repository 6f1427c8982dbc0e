#include "tests/support/cart.h"

#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <sstream>
#include <system_error>
#include <thread>

#include "services/base/core/exit_code.h"
#include "tests/support/pace_faults.h"

namespace fulcrum::testing {

namespace fs = std::filesystem;

bool WaitFor(double limit_s, const std::function<bool()>& done) {
  using std::chrono::steady_clock;
  const auto start = steady_clock::now();
  while (std::chrono::duration<double>(steady_clock::now() - start).count() < limit_s) {
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

double FigureOf(const std::string& summary, const std::string& key) {
  const std::size_t at = summary.find("\"" + key + "\": ");
  return at == std::string::npos ? std::nan("") : std::atof(summary.c_str() + at + key.size() + 4);
}

std::string FaultBesidePace(int code, const std::string& said) {
  if (code == 0) return {};
  const std::string faults = FaultsButPace(said);
  const bool slow =
      code == static_cast<int>(ExitCode::kFailure) && faults.empty() && said.find("\nfault at ") != std::string::npos;
  return slow ? std::string() : "exit code " + std::to_string(code) + "\n" + faults + said;
}

std::optional<double> CpuSeconds(pid_t pid) {
  const std::string line = ReadFile("/proc/" + std::to_string(pid) + "/stat");
  const std::size_t name_end = line.rfind(')');
  if (name_end == std::string::npos) return {};
  std::istringstream fields(line.substr(name_end + 1));
  std::string skipped;
  constexpr int kBeforeUserTime = 11;
  for (int i = 0; i < kBeforeUserTime; ++i) fields >> skipped;
  double user = 0, system = 0;
  fields >> user >> system;
  return (user + system) / static_cast<double>(::sysconf(_SC_CLK_TCK));
}

Cart::Cart(const std::string& scene, int domain, const std::vector<std::string>& more_arguments)
    : folder_(fs::temp_directory_path() /
              ("fulcrum-cart-" + std::to_string(::getpid()) + "-" + std::to_string(domain))) {
  fs::remove_all(folder_);
  fs::create_directories(folder_);
  std::vector<std::string> arguments{"up", scene, "--domain", std::to_string(domain), "--out", folder_, "--no-video"};
  arguments.insert(arguments.end(), more_arguments.begin(), more_arguments.end());
  up_ = Program("fulcrum", arguments);
}

Cart::~Cart() {
  up_ = Program();
  std::error_code ignored;
  fs::remove_all(folder_, ignored);
}

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
    if (ppid == parent && state != 'Z') children.emplace(line.substr(open + 1, close - open - 1), std::stoi(name));
  }
  return children;
}

double Cart::PictureTime() const {
  double newest_s = -1;
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator(session() / "frames", ignored)) {
    int ms = 0;
    if (std::sscanf(entry.path().filename().c_str(), "frame_%d.png", &ms) == 1)
      newest_s = std::max(newest_s, 1e-3 * ms);
  }
  return newest_s;
}
std::map<std::string, pid_t> Cart::nodes() const { return ChildrenOf(up_.pid()); }

std::optional<int> Cart::WaitForEnd(double limit_s) {
  std::optional<int> code;
  WaitFor(limit_s, [&] { return (code = up_.Poll()).has_value(); });
  return code;
}

std::string Cart::FaultAtEnd(double limit_s) {
  const std::optional<int> code = WaitForEnd(limit_s);
  return code ? FaultBesidePace(*code, Said()) : "it does not end\n" + Said();
}

}  // namespace fulcrum::testing
