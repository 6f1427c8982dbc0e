#include "tests/benchmark/security/keys_cost.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <string>
#include <thread>
#include <vector>

#include "services/transport/keys/key_folder.h"
#include "tests/support/cart.h"

namespace fulcrum {
namespace {

namespace fs = std::filesystem;

constexpr int kKeysDomain = 76;
constexpr std::array kNodes{"handle_bridge", "haptics_node", "physics_node", "thermal_node", "render_node"};
constexpr double kKeysPatience_s = 60;
constexpr double kSession_s = 8;

struct Run {
  double start_ms = 0;  ///< From the start of `fulcrum up` until every node has joined.
  std::array<double, kNodes.size()> rate_Hz{};
};

enum Protection : std::size_t { kKeys, kOpen, kEncrypted, kProtections };

/// One session of `small`. @return false: it did not start or end.
bool Measure(Protection protection, const fs::path& encrypted_cart, Run* run) {
  std::vector<std::string> arguments{"--seconds", std::to_string(kSession_s)};
  if (protection == kOpen) arguments.emplace_back("--open-bus");
  if (protection == kEncrypted) arguments.insert(arguments.end(), {"--cart", encrypted_cart});
  const auto begin = std::chrono::steady_clock::now();
  testing::Cart cart("small", kKeysDomain, arguments);
  const auto joined = [&](const char* node) {
    return testing::ReadFile(cart.session() / "logs" / (std::string(node) + ".log")).find("joined session") !=
           std::string::npos;
  };
  while (!std::all_of(kNodes.begin(), kNodes.end(), joined)) {
    const std::chrono::duration<double> passed = std::chrono::steady_clock::now() - begin;
    if (passed.count() > kKeysPatience_s) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  run->start_ms = std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count();
  if (!cart.WaitForEnd(kKeysPatience_s)) return false;
  const std::string summary = testing::ReadFile(cart.session() / "summary.json");
  for (std::size_t i = 0; i < kNodes.size(); ++i) {
    run->rate_Hz[i] = testing::FigureOf(summary, std::string(kNodes[i]) + ".rate_achieved_Hz");
  }
  return true;
}

}  // namespace

std::string MeasureKeysCost(const fs::path& scratch, benchmark::Report* report) {
  const std::time_t now = std::time(nullptr);
  keys::MakeKeyFolder(scratch / "keys", {now, now + 24 * 3600}, false);
  std::ofstream(scratch / "encrypted.yaml") << "security: {keys: keys, encrypt: true}\n";
  std::array<std::vector<double>, kProtections> start_ms;
  std::array<std::array<std::vector<double>, kNodes.size()>, kProtections> rates_Hz;
  // Alternate the kinds, because the load of the machine changes over minutes. The first session compiles the scene.
  for (int i = 0; i < (report->quick() ? 4 : 21); ++i) {
    for (const Protection protection : {kOpen, kKeys, kEncrypted}) {
      Run run;
      if (!Measure(protection, scratch / "encrypted.yaml", &run)) return "a session did not start or end";
      if (i == 0) continue;
      start_ms[protection].push_back(run.start_ms);
      for (std::size_t n = 0; n < kNodes.size(); ++n) rates_Hz[protection][n].push_back(run.rate_Hz[n]);
    }
  }
  const auto median = [](const std::vector<double>& values) { return benchmark::Quantile(values, 0.5); };
  report->Add("guard.start_ms_p50.keys", median(start_ms[kKeys]), "ms");
  report->Add("guard.start_ms_p50.open", median(start_ms[kOpen]), "ms");
  report->Add("guard.start_ms_p50.encrypted", median(start_ms[kEncrypted]), "ms");
  report->Add("guard.keys_start_extra_ms_p50", median(start_ms[kKeys]) - median(start_ms[kOpen]), "ms");
  for (const Protection protection : {kKeys, kEncrypted}) {
    const std::string key = protection == kKeys ? "guard.rate_change_pct" : "guard.encrypted_rate_change_pct";
    double change_pct = 0;
    for (std::size_t n = 0; n < kNodes.size(); ++n) {
      const double open_Hz = median(rates_Hz[kOpen][n]);
      const double pct = 100 * (median(rates_Hz[protection][n]) - open_Hz) / open_Hz;
      report->Add(key + "." + kNodes[n], pct, "%");
      change_pct = std::max(change_pct, -pct);
    }
    report->Add(key, change_pct, "%");
  }
  return {};
}

}  // namespace fulcrum
