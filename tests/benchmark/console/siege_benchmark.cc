// Time until the operator's Stop is answered beside a thousand silent connections, half of them from the operator's own
// address and half from a hundred others; each connects again as soon as it is closed. The first Stop ends a running
// session; the others only request the same route.
#include <signal.h>
#include <stdlib.h>

#include <chrono>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <string>
#include <thread>
#include <vector>

#include "tests/benchmark/report.h"
#include "tests/support/cart.h"
#include "tests/support/http_client.h"
#include "tests/support/siege.h"

namespace fulcrum::testing {
namespace {

using Clock = std::chrono::steady_clock;

constexpr int kDomain = 67;
constexpr std::size_t kSilent = 1000;
// Above the target of 500 ms, so that an answer later than this counts as late and not as lost.
constexpr double kLimit_s = 5;

std::vector<std::string> Addresses() {
  std::vector<std::string> addresses;
  for (int i = 0; i < 100; ++i) {
    addresses.emplace_back("127.0.0.1");
    addresses.push_back("127.0.0." + std::to_string(i + 2));
  }
  return addresses;
}

struct Answers {
  std::vector<double> ms;
  int failed = 0;

  void Count(Clock::time_point from, int status) {
    ms.push_back(std::chrono::duration<double, std::milli>(Clock::now() - from).count());
    if (status != 200 && status != 409) ++failed;
  }
};

std::string StopRequest(const ConsoleProgram& console) {
  return "POST /api/stop HTTP/1.1\r\nHost: 127.0.0.1\r\nAuthorization: Bearer " + console.token() +
         "\r\nContent-Length: 0\r\n\r\n";
}

int StopOnce(const ConsoleProgram& console) {
  try {
    HttpConnection connection(console.port(), {.tls = console.tls()});
    connection.Send(StopRequest(console));
    return connection.Reply(kLimit_s).status;
  } catch (const std::exception&) {
    return 0;  // The handshake failed.
  }
}

void Measure(benchmark::Report* report, const std::string& stem, const std::vector<std::string>& words,
             bool with_session) {
  std::string folder = (std::filesystem::temp_directory_path() / "fulcrum_siege_XXXXXX").string();
  if (::mkdtemp(folder.data()) == nullptr) throw std::runtime_error("no folder");
  ::setenv("XDG_STATE_HOME", (folder + "/state").c_str(), 1);
  std::vector<std::string> all{"--token-file", folder + "/token"};
  all.insert(all.end(), words.begin(), words.end());
  {
    ConsoleProgram console(kDomain, folder + "/out", all);
    if (with_session) {
      const bool runs =
          console.Post("/api/start", "scene=small&seconds=60&record=off").status == 200 && WaitFor(60, [&] {
            return console.Get("/api/state").body.find("\"phase\":\"running\"") != std::string::npos;
          });
      if (!runs) throw std::runtime_error("the session does not start");
    }
    HttpConnection kept(console.port(), {.tls = console.tls()});
    kept.Send(StopRequest(console).replace(0, 14, "GET /api/state"));
    if (kept.Reply().status != 200) throw std::runtime_error("no answer before the siege");
    const Siege siege(console.port(), {.connections = kSilent, .from = Addresses()});
    if (!WaitFor(30, [&] { return siege.made() > kSilent; })) throw std::runtime_error("no siege");
    Answers fresh, page;
    const int count = report->quick() ? 100 : 400;
    for (int i = 0; i < count; ++i) {
      Clock::time_point from = Clock::now();
      const int status = StopOnce(console);
      fresh.Count(from, status);
      if (i == 0 && with_session && status != 200) throw std::runtime_error("the session was not stopped");
      from = Clock::now();
      kept.Send(StopRequest(console));
      page.Count(from, kept.Reply(kLimit_s).status);
      // Requests arrive at varying phases of the console's loop.
      std::this_thread::sleep_for(std::chrono::milliseconds(7 * (i % 11)));
    }
    std::fprintf(stderr, "%s: %zu connections made by the siege\n", stem.c_str(), siege.made());
    report->Add(stem + "_ms_p50", benchmark::Quantile(fresh.ms, 0.5), "ms");
    report->Add(stem + "_ms_p99", benchmark::Quantile(fresh.ms, 0.99), "ms");
    report->Add(stem + "_ms_max", benchmark::Quantile(fresh.ms, 1), "ms");
    report->Add(stem + ".kept_ms_p99", benchmark::Quantile(page.ms, 0.99), "ms");
    report->Add(stem + ".failed", fresh.failed + page.failed, "answers");
    if (with_session) {
      const bool ended =
          WaitFor(60, [&] { return console.Get("/api/state").body.find("\"phase\":\"idle\"") != std::string::npos; });
      if (!ended) throw std::runtime_error("the session does not end");
    }
    console.program().End(SIGTERM);
  }
  std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace fulcrum::testing

int main(int argc, char** argv) {
  fulcrum::benchmark::Report report(argc, argv);
  ::signal(SIGPIPE, SIG_IGN);
  try {
    if (report.Wants("guard.stop_under_siege")) {
      fulcrum::testing::Measure(&report, "guard.stop_under_siege", {}, true);
    }
    if (report.Wants("guard.stop_under_siege_tls")) {
      fulcrum::testing::Measure(&report, "guard.stop_under_siege_tls", {"--bind", "0.0.0.0"}, false);
    }
  } catch (const std::exception& error) {
    std::fprintf(stderr, "siege: %s\n", error.what());
    return 1;
  }
  return 0;
}
