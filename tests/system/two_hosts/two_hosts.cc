#include "tests/system/two_hosts/two_hosts.h"

#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>
#include <map>
#include <sstream>
#include <stdexcept>

#include "tests/support/cart.h"

namespace fulcrum::testing {
namespace {

namespace fs = std::filesystem;

/// Programs of iproute2 and util-linux; in /usr/sbin and /usr/bin on Debian.
const char* const kIp = "/usr/sbin/ip";
const char* const kNsenter = "/usr/bin/nsenter";

int Ip(const std::vector<std::string>& words, std::string* said = nullptr) {
  Program ip(kIp, words);
  const int code = ip.End(0);
  if (said != nullptr) *said = ip.Said();
  return code;
}

void MustIp(const std::vector<std::string>& words) {
  std::string said;
  if (Ip(words, &said) == 0) return;
  std::string line = "ip";
  for (const std::string& word : words) line += " " + word;
  throw std::runtime_error(line + ": " + said);
}

}  // namespace

std::string TwoHosts::WhyNot() {
  if (::geteuid() != 0) return "two network namespaces need root";
  if (!fs::exists(kIp) || !fs::exists(kNsenter)) return "iproute2 and util-linux are needed";
  const std::string name = "fulcrum-try-" + std::to_string(::getpid());
  std::string said;
  if (Ip({"netns", "add", name}, &said) != 0) return "no network namespace can be made here: " + said;
  const int veth = Ip({"-n", name, "link", "add", "wc", "type", "veth", "peer", "name", "wh"}, &said);
  (void)Ip({"netns", "del", name});
  if (veth != 0) return "no virtual cable can be made here: " + said;
  Program time("/usr/bin/unshare", {"--time", "--mount", "--fork", "true"});
  return time.End(0) == 0 ? std::string() : "no time namespace can be made here: " + time.Said();
}

std::string TwoHosts::Name(const char* what) const { return "fulcrum-" + std::to_string(::getpid()) + "-" + what; }

TwoHosts::TwoHosts(const Settings& settings)
    : folder_(fs::temp_directory_path() / ("fulcrum-two-hosts-" + std::to_string(::getpid()))) {
  fs::remove_all(folder_);
  fs::create_directories(folder_);
  MustIp({"netns", "add", Name("wire")});
  MakeHost("cart", "wc", kCartAddress, 0, &cart_holder_, &cart_pid_);
  MakeHost("host", "wh", kHostAddress, settings.far_clock_ahead_s, &host_holder_, &host_pid_);
  cable_ = Program(kIp, {"netns", "exec", Name("wire"), std::string(FULCRUM_BIN_DIR) + "/two_hosts_cable", "wc", "wh",
                         std::to_string(settings.delay_ms), std::to_string(settings.loss_percent), settings.word});
}

void TwoHosts::MakeHost(const std::string& name, const char* end, const char* address, double clock_ahead_s,
                        Program* holder, std::string* pid) const {
  const std::string space = Name(name.c_str());
  MustIp({"netns", "add", space});
  MustIp({"-n", Name("wire"), "link", "add", end, "type", "veth", "peer", "name", "link0", "netns", space});
  MustIp({"-n", Name("wire"), "link", "set", end, "up"});
  MustIp({"-n", space, "addr", "add", std::string(address) + "/24", "dev", "link0"});
  MustIp({"-n", space, "link", "set", "lo", "up"});
  MustIp({"-n", space, "link", "set", "link0", "up"});
  *holder = Program(kIp, {"netns", "exec", space, "/usr/bin/unshare", "--mount", "--time", "--monotonic",
                          std::to_string(std::lround(clock_ahead_s)), "--fork", "--kill-child", "/bin/sh", "-c",
                          "mount -t tmpfs -o size=512M tmpfs /dev/shm && echo $$ && exec sleep infinity"});
  if (!WaitFor(10, [&] { return holder->Said().find('\n') != std::string::npos; })) {
    throw std::runtime_error(space + ": " + holder->Said());
  }
  *pid = holder->Said().substr(0, holder->Said().find('\n'));
}

TwoHosts::~TwoHosts() {
  cable_ = Program();
  cart_holder_ = Program();
  host_holder_ = Program();
  for (const char* name : {"cart", "host", "wire"}) (void)Ip({"netns", "del", Name(name)});
  std::error_code ignored;
  fs::remove_all(folder_, ignored);
}

Program TwoHosts::OnCart(const std::string& program, const std::vector<std::string>& arguments) const {
  std::vector<std::string> words{"-t", cart_pid_, "-n", "-m", "-T", std::string(FULCRUM_BIN_DIR) + "/" + program};
  words.insert(words.end(), arguments.begin(), arguments.end());
  return {kNsenter, words};
}

Program TwoHosts::OnHost(const std::string& program, const std::vector<std::string>& arguments) const {
  std::vector<std::string> words{"-t", host_pid_, "-n", "-m", "-T", std::string(FULCRUM_BIN_DIR) + "/" + program};
  words.insert(words.end(), arguments.begin(), arguments.end());
  return {kNsenter, words};
}

void TwoHosts::Cut() const { MustIp({"-n", Name("wire"), "link", "set", "wh", "down"}); }
void TwoHosts::Mend() const { MustIp({"-n", Name("wire"), "link", "set", "wh", "up"}); }

void ForEachFrame(const fs::path& file, const std::function<void(const HeardFrame&)>& take) {
  std::ifstream stream(file, std::ios::binary);
  HeardFrame frame;
  std::uint32_t count = 0;
  const auto read = [&](void* to, std::size_t size) {
    return static_cast<bool>(stream.read(static_cast<char*>(to), static_cast<std::streamsize>(size)));
  };
  while (read(&frame.sequence, 8) && read(&frame.age_s, 8) && read(&count, 4)) {
    frame.xyz.resize(std::size_t{3} * count);
    if (!read(frame.xyz.data(), frame.xyz.size() * sizeof(float))) return;
    take(frame);
  }
}

std::vector<HeardTool> HeardTools(const fs::path& file) {
  std::vector<HeardTool> tools;
  std::ifstream stream(file);
  for (std::string line; std::getline(stream, line);) {
    HeardTool tool;
    if (std::sscanf(line.c_str(), "tool %lf %lf %lf %lf", &tool.time_s, &tool.force0_N, &tool.force1_N,
                    &tool.model_age_s) == 4) {
      tools.push_back(tool);
    }
  }
  return tools;
}

std::vector<double> HeardLinkFigure(const fs::path& file, const std::string& name) {
  std::vector<double> values;
  std::ifstream stream(file);
  for (std::string line; std::getline(stream, line);) {
    std::istringstream words(line);
    std::string kind, figure;
    double value = 0;
    if (words >> kind >> figure >> value && kind == "link" && figure == name) values.push_back(value);
  }
  return values;
}

FrameComparison CompareFrames(const fs::path& near, const fs::path& far) {
  std::map<std::uint64_t, std::vector<float>> known;
  ForEachFrame(near, [&](const HeardFrame& frame) { known[frame.sequence] = frame.xyz; });
  FrameComparison found;
  std::vector<double> ages;
  std::uint64_t before = 0;
  ForEachFrame(far, [&](const HeardFrame& frame) {
    ages.push_back(frame.age_s);
    if (before != 0 && frame.sequence > before) {
      found.largest_gap = std::max(found.largest_gap, static_cast<double>(frame.sequence - before));
    }
    before = frame.sequence;
    const auto same = known.find(frame.sequence);
    if (same == known.end() || same->second.size() != frame.xyz.size()) return;
    ++found.compared;
    for (std::size_t i = 0; i + 2 < frame.xyz.size(); i += 3) {
      const double error = std::hypot(static_cast<double>(frame.xyz[i]) - static_cast<double>(same->second[i]),
                                      static_cast<double>(frame.xyz[i + 1]) - static_cast<double>(same->second[i + 1]),
                                      static_cast<double>(frame.xyz[i + 2]) - static_cast<double>(same->second[i + 2]));
      found.largest_error_m = std::max(found.largest_error_m, error);
    }
  });
  if (!ages.empty()) {
    std::nth_element(ages.begin(), ages.begin() + static_cast<std::ptrdiff_t>(ages.size() / 2), ages.end());
    found.median_age_s = ages[ages.size() / 2];
  }
  return found;
}

}  // namespace fulcrum::testing
