#include "tests/support/browser_client.h"

#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <sstream>
#include <utility>

#include "tests/support/cart.h"

namespace fulcrum::testing {
namespace {

constexpr double kStart_s = 120;

/// Name of the key in the browser.
std::string BrowserKey(const std::string& x_key) { return x_key == "Return" ? "Enter" : x_key; }

}  // namespace

BrowserClient::BrowserClient(const std::string& scene, int domain, const std::filesystem::path& npm)
    : log_(std::filesystem::temp_directory_path() / ("fulcrum_browser_" + std::to_string(::getpid()) + ".log")) {
  // Orders to a browser that has ended are an error of the stream, not the end of the test.
  std::signal(SIGPIPE, SIG_IGN);
  const std::string command =
      "exec " FULCRUM_SOURCE_DIR "/tests/integration/console/npm/run.sh " FULCRUM_BIN_DIR "/fulcrum '" + npm.string() +
      "' remote " + scene + " " + std::to_string(domain) + " >'" + log_.string() + "' 2>&1";
  orders_ = ::popen(command.c_str(), "w");
}

BrowserClient::~BrowserClient() {
  (void)End();
  std::error_code ignored;
  std::filesystem::remove(log_, ignored);
}

std::string BrowserClient::Said() const { return ReadFile(log_); }

std::string BrowserClient::missing() const {
  const std::string said = Said();
  return said.starts_with("SKIPPED") ? said : std::string();
}

bool BrowserClient::Begin() {
  std::istringstream lines;
  const auto says = [&](const std::string& word, std::string* rest) {
    std::istringstream all(Said());
    for (std::string line; std::getline(all, line);) {
      if (line.starts_with(word)) return *rest = line.substr(word.size()), true;
    }
    return false;
  };
  std::string rest;
  const bool ready =
      WaitFor(kStart_s, [&] { return says("ready ", &rest) || says("failed", &rest) || !missing().empty(); });
  if (!ready || !says("ready ", &rest)) return false;
  session_ = rest;
  return true;
}

bool BrowserClient::End() {
  if (orders_ == nullptr) return false;
  Order("end");
  const int status = ::pclose(std::exchange(orders_, nullptr));
  return WIFEXITED(status) && WEXITSTATUS(status) == 0;
}

void BrowserClient::Move(int x, int y) { Order("move " + std::to_string(x) + " " + std::to_string(y)); }

void BrowserClient::MoveDeep(int pixels) { Order("deep " + std::to_string(pixels)); }

void BrowserClient::Press(const std::string& key, bool down) { Order((down ? "down " : "up ") + BrowserKey(key)); }

void BrowserClient::Order(const std::string& line) {
  if (orders_ == nullptr) return;
  std::fprintf(orders_, "%s\n", line.c_str());
  std::fflush(orders_);
}

}  // namespace fulcrum::testing
