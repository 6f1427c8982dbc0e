// A secured cart: attempts that it refuses, the time to make the keys of a session, and the time to join it.
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <ctime>
#include <filesystem>
#include <string>
#include <thread>
#include <vector>

#include "services/transport/bus/dds/participant.h"
#include "services/transport/bus/dds/shared_memory.h"
#include "services/transport/bus/input_account.h"
#include "services/transport/keys/issuing.h"
#include "services/transport/keys/key_folder.h"
#include "tests/benchmark/report.h"
#include "tests/benchmark/security/foreign_session.h"
#include "tests/benchmark/security/keys_cost.h"
#include "tests/benchmark/security/listed_attempts.h"
#include "tests/support/intruder.h"

namespace fulcrum {
namespace {

namespace fs = std::filesystem;

constexpr int kDomain = 74, kJoinDomain = 75;

void Attempts(benchmark::Report* report, const fs::path& scratch) {
  int refused = 0, all = 0;
  for (const testing::Attempt& attempt : testing::TryAllAttempts(kDomain, scratch)) {
    ++all;
    refused += attempt.refused() ? 1 : 0;
    std::fprintf(stderr, "%s %s: exit code %d of %d, %s, %s: %s\n", attempt.refused() ? "refused" : "NOT REFUSED",
                 attempt.name.c_str(), attempt.exit_code, attempt.wanted_exit_code,
                 attempt.came_through ? "came through" : "nothing came through",
                 attempt.reported ? "reported" : "not reported", attempt.last_line.c_str());
  }
  for (const ListedAttempt& attempt : ListedAttempts()) {
    std::string said;
    const bool held = IsRefused(attempt, &said);
    ++all;
    refused += held ? 1 : 0;
    std::fprintf(stderr, "%s %s: %s in %s\n%s", held ? "refused" : "NOT REFUSED", attempt.name, attempt.test,
                 attempt.program, held ? "" : said.c_str());
  }
  report->Add("security.refused", 100.0 * refused / all, "%");
  report->Add("security.attempts", all, "");
}

/// Time from the creation of a new participant to its first sample of a running writer.
double JoinMs(int domain, const bus::Security& writer, const bus::Security& reader) {
  const auto now_ns = [] { return std::chrono::steady_clock::now().time_since_epoch().count(); };
  bus::DdsParticipant there({.domain = domain, .node_name = "supervisor", .security = writer});
  const auto out = there.MakeOutput<Health>();
  std::jthread writing([&](const std::stop_token& stop) {
    bus::Stamper stamper(now_ns());
    Health health;
    while (!stop.stop_requested()) {
      health.stamp = stamper.Next(now_ns());
      out->Write(health);
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
  });
  std::this_thread::sleep_for(std::chrono::milliseconds(150));
  const std::int64_t begin_ns = now_ns();
  bus::DdsParticipant anew({.domain = domain, .node_name = "fulcrum", .security = reader});
  const auto in = anew.MakeInput<Health>();
  Health health;
  constexpr std::int64_t kPatience_ns = 20'000'000'000;
  while (!in->TakeNext(&health) && now_ns() - begin_ns < kPatience_ns) {
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return 1e-6 * static_cast<double>(now_ns() - begin_ns);
}

/// Time to make the keys of a session in shared memory, as each `fulcrum up` does.
void SessionKeys(benchmark::Report* report) {
  const fs::path folder = "/dev/shm/fulcrum-bench-keys-" + std::to_string(::getpid());
  const std::time_t now = std::time(nullptr);
  std::vector<double> times_ms;
  for (int i = 0; i < (report->quick() ? 20 : 200); ++i) {
    const auto begin = std::chrono::steady_clock::now();
    keys::MakeSessionKeys(folder, {now, now + 24 * 3600});
    const std::chrono::duration<double, std::milli> time = std::chrono::steady_clock::now() - begin;
    times_ms.push_back(time.count());
  }
  keys::RemoveSessionKeys(folder);
  report->Add("security.session_keys.ms_p50", benchmark::Quantile(times_ms, 0.5), "ms");
  report->Add("security.session_keys.ms_max", benchmark::Quantile(times_ms, 1), "ms");
}

void Joining(benchmark::Report* report, const fs::path& keys) {
  struct Mode {
    const char* name;
    bool secured, encrypt;
  };
  for (const Mode& mode : {Mode{"off", false, false}, {"on", true, false}, {"encrypted", true, true}}) {
    const std::string key = std::string("security.join.") + mode.name;
    if (!report->Wants(key)) continue;
    const auto as = [&](const char* identity) {
      return mode.secured ? bus::Security{keys, identity, mode.encrypt} : bus::Security();
    };
    std::vector<double> times_ms;
    for (int i = 0; i < (report->quick() ? 5 : 20); ++i) {
      times_ms.push_back(JoinMs(kJoinDomain, as("supervisor"), as("fulcrum")));
    }
    report->Add(key + ".ms_p50", benchmark::Quantile(times_ms, 0.5), "ms");
    report->Add(key + ".ms_max", benchmark::Quantile(times_ms, 1), "ms");
  }
  bus::RemoveSharedMemory(bus::SharedMemoryDirectory(kJoinDomain));
}

}  // namespace
}  // namespace fulcrum

int main(int argc, char** argv) {
  using namespace fulcrum;
  benchmark::Report report(argc, argv);
  const fs::path scratch = fs::temp_directory_path() / ("fulcrum-bench-security-" + std::to_string(::getpid()));
  fs::create_directories(scratch);
  std::string wrong;
  if (report.Wants("security.join")) {
    const std::time_t now = std::time(nullptr);
    keys::MakeKeyFolder(scratch / "join", {now, now + 24 * 3600}, false);
    Joining(&report, scratch / "join");
  }
  if (report.Wants("security.session_keys")) SessionKeys(&report);
  if (report.Wants("security.refused") || report.Wants("security.attempts")) Attempts(&report, scratch);
  if (report.Wants("security.foreign_session")) wrong = MeasureForeignSession(&report);
  const bool keys = report.Wants("guard.keys_start") || report.Wants("guard.start") || report.Wants("guard.rate") ||
                    report.Wants("guard.encrypted");
  if (wrong.empty() && keys) wrong = MeasureKeysCost(scratch, &report);
  fs::remove_all(scratch);
  bus::RemoveSharedMemory(bus::SharedMemoryDirectory(kDomain));
  if (!wrong.empty()) std::fprintf(stderr, "bench_security: %s\n", wrong.c_str());
  return wrong.empty() ? 0 : 1;
}
