// The recorder.
//
//   record.cpu_pct                  of one core, of the process, in the middle of a session of the built-in scene
//   record.lost_samples             in that whole session, by the sequences in the file
//   record.file_MB_per_s            rate at which that session writes
//   record.GB_per_hour              the same of the scripted operation (20 s), of which all but the ends is motion
//   record.readable_after_kill_pct  of the samples older than a second at kill -9 of the recorder, those in its file
//   record.lost_at_kill_ms_max      at those kills, the age of the newest sample in the file
//   record.busy.lost_samples        in a session beside two busy loops for each core, by the sequences in its file
//   record.busy.lost_for_replay     of these, samples that a replay needs
//   guard.disk_full_lost_samples    sent before the end of a recording that ends for lack of room, missing in its file
//   record.write_MB_per_s           largest rate at which frames, patches and tool states of such a session are packed
//                                   and written into a file in the folder for temporary files
#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <fstream>
#include <sstream>
#include <stop_token>
#include <thread>

#include "services/base/runtime/cyclic_thread.h"
#include "services/records/log_tools/sequence_gaps.h"
#include "services/records/log_tools/tools.h"
#include "services/records/recorder/priorities.h"
#include "services/records/recorder/recorder.h"
#include "tests/benchmark/report.h"
#include "tests/support/cart.h"
#include "tests/support/recorder_probe.h"

namespace fulcrum {
namespace {

namespace fs = std::filesystem;
using runtime::MonotonicNs;

constexpr int kCartDomain = 59, kProbeDomain = 60;
constexpr double kPatience_s = 60;

double Seconds(std::int64_t ns) { return 1e-9 * static_cast<double>(ns); }

/// Keeps all cores busy.
class BusyLoops {
 public:
  explicit BusyLoops(unsigned count) {
    for (unsigned i = 0; i < count; ++i) {
      loops_.emplace_back([](const std::stop_token& stop) {
        while (!stop.stop_requested()) {
        }
      });
    }
  }

 private:
  std::vector<std::jthread> loops_;
};

struct Losses {
  std::uint64_t samples = 0, lost = 0, needed = 0;
  double end_s = 0;
};

Losses LossesIn(const fs::path& file) {
  log_tools::Recording recording(file);
  log_tools::SequenceGaps gaps;
  log_tools::Entry entry;
  Losses losses;
  while (recording.Next(&entry)) {
    ++losses.samples;
    const std::uint64_t gap = gaps.Before(entry.message);
    losses.lost += gap;
    if (entry.source->topic && !recorder::IsDroppedFirst(*entry.source->topic)) losses.needed += gap;
    losses.end_s = std::max(losses.end_s, entry.time_s);
  }
  return losses;
}

/// False if the session failed to run.
bool BusySession(benchmark::Report* report) {
  const BusyLoops busy(2 * std::thread::hardware_concurrency());
  testing::Cart cart("built-in", kCartDomain, {"--record", "--seconds", report->quick() ? "10" : "30"});
  if (!cart.WaitForEnd(2 * kPatience_s)) return false;
  const Losses losses = LossesIn(cart.session() / "recording.mcap");
  if (losses.samples == 0) return false;
  report->Add("record.busy.lost_samples", static_cast<double>(losses.lost), "samples");
  report->Add("record.busy.lost_for_replay", static_cast<double>(losses.needed), "samples");
  return true;
}

void FullDisk(benchmark::Report* report) {
  testing::RecorderProbe probe(kProbeDomain);
  // Room for a second or two of the probe's frames.
  const auto result = probe.RecordUntilFull(60'000'000, 6);
  if (!result.has_ended) {
    std::fprintf(stderr, "bench_recording: the recording did not end in order for lack of room\n");
    return;
  }
  report->Add("guard.disk_full_lost_samples", static_cast<double>(result.lost), "samples");
  report->Add("guard.disk_full_recorded_samples", static_cast<double>(result.recorded), "samples");
}

/// False if the session failed to run.
bool Session(benchmark::Report* report) {
  const double seconds = report->quick() ? 15 : 60;
  testing::Cart cart("built-in", kCartDomain, {"--record", "--seconds", std::to_string(seconds)});
  pid_t recorder = -1;
  const bool begun = testing::WaitFor(kPatience_s, [&] {
    const auto nodes = cart.nodes();
    if (nodes.contains("recorder")) recorder = nodes.at("recorder");
    // `fulcrum up` prints progress every two seconds.
    return recorder > 0 && cart.Said().find(" s · ") != std::string::npos;
  });
  if (!begun) return false;
  constexpr auto kSettle = std::chrono::seconds(2);
  std::this_thread::sleep_for(kSettle);
  const double cpu_begin_s = testing::CpuSeconds(recorder).value_or(-1);
  const std::int64_t begin_ns = MonotonicNs();
  std::this_thread::sleep_for(std::chrono::duration<double>(seconds - 6));
  const double used_s = testing::CpuSeconds(recorder).value_or(-1) - cpu_begin_s;
  report->Add("record.cpu_pct", 100 * used_s / Seconds(MonotonicNs() - begin_ns), "%");
  if (!cart.WaitForEnd(kPatience_s)) return false;
  const fs::path file = cart.session() / "recording.mcap";
  const Losses losses = LossesIn(file);
  report->Add("record.lost_samples", static_cast<double>(losses.lost), "samples");
  report->Add("record.samples", static_cast<double>(losses.samples), "samples");
  report->Add("record.file_MB_per_s", 1e-6 * static_cast<double>(fs::file_size(file)) / losses.end_s, "MB/s");
  return true;
}

/// Size of the scripted operation's recording, in an hour at that rate. False if the session failed to run.
bool Moving(benchmark::Report* report) {
  constexpr double kOperation_s = 20;
  testing::Cart cart("built-in", kCartDomain, {"--record", "--seconds", std::to_string(kOperation_s)});
  if (!cart.WaitForEnd(2 * kPatience_s)) return false;
  const double size_B = static_cast<double>(fs::file_size(cart.session() / "recording.mcap"));
  report->Add("record.GB_per_hour", 1e-9 * size_B * 3600 / kOperation_s, "GB");
  return true;
}

void Kills(benchmark::Report* report) {
  testing::RecorderProbe probe(kProbeDomain);
  std::uint64_t due = 0, read = 0, missed = 0;
  double unread_ms = 0;
  for (int kill = 0; kill < (report->quick() ? 4 : 20); ++kill) {
    // Kill at varying phases of a chunk.
    const auto result = probe.RecordAndKill(1.6 + 0.037 * kill);
    due += result.due;
    read += result.read;
    missed += result.missed;
    unread_ms = std::max(unread_ms, result.unread_ms);
  }
  report->Add("record.readable_after_kill_pct", 100.0 * static_cast<double>(read) / static_cast<double>(due), "%");
  report->Add("record.lost_at_kill_ms_max", unread_ms, "ms");
  report->Add("record.readable_after_kill_missed", static_cast<double>(missed), "samples");
}

/// A second of a cart's messages, as compressible as real ones.
class Second {
 public:
  Second() {
    std::uint64_t noise = 1;
    frame_.resize(307'296);
    for (std::size_t i = 0; i < frame_.size(); ++i) {
      noise = noise * 6364136223846793005u + 1442695040888963407u;
      // Two of three bytes of a position are noise; a fifth of the frame is unused capacity.
      if (i % 4 < 3 && i < frame_.size() * 4 / 5) frame_[i] = static_cast<std::byte>(noise >> 56);
    }
    patch_.resize(262'184);
    for (std::size_t i = 0; i < patch_.size(); ++i) patch_[i] = static_cast<std::byte>(i % 4 == 0 ? (i >> 8) & 31u : 0);
    tool_.resize(168);
  }
  std::uint64_t Receive(recorder::Recorder* recorder) {
    std::uint64_t bytes = 0;
    const auto put = [&](TopicId topic, const std::vector<std::byte>& body, std::uint64_t* sequence) {
      recorder->Receive({topic, {1}, ++*sequence, 0, MonotonicNs(), head_, body});
      bytes += head_.size() + body.size();
    };
    for (int ms = 0; ms < 1000; ++ms) {
      put(TopicId::kToolState, tool_, &tools_);
      if (ms % 10 == 0) put(TopicId::kTissueFrame, frame_, &frames_);
      if (ms % 40 == 0) put(TopicId::kTemperaturePatch, patch_, &patches_);
      if (ms % 50 == 0) recorder->Flush(MonotonicNs());
    }
    return bytes;
  }

 private:
  const std::array<std::byte, 4> head_{std::byte{0}, std::byte{1}, std::byte{0}, std::byte{0}};
  std::vector<std::byte> frame_, patch_, tool_;
  std::uint64_t frames_ = 0, patches_ = 0, tools_ = 0;
};

void Write(benchmark::Report* report) {
  const fs::path file = fs::temp_directory_path() / ("bench_recording." + std::to_string(::getpid()));
  recorder::RecorderSettings settings;
  settings.file = file;
  Second second;
  std::vector<double> rates;
  for (int repeat = 0; repeat < (report->quick() ? 3 : 9); ++repeat) {
    recorder::Recorder recorder(settings);
    const std::int64_t begin_ns = MonotonicNs();
    std::uint64_t bytes = 0;
    for (int i = 0; i < 5; ++i) bytes += second.Receive(&recorder);
    recorder.Close(MonotonicNs());
    rates.push_back(1e-6 * static_cast<double>(bytes) / Seconds(MonotonicNs() - begin_ns));
    if (!recorder.stats().ended.empty()) std::fprintf(stderr, "bench_recording: %s\n", recorder.stats().ended.c_str());
  }
  report->Add("record.write_MB_per_s", benchmark::Quantile(rates, 0.5), "MB/s");
  std::error_code ignored;
  fs::remove(file, ignored);
}

int Run(benchmark::Report* report) {
  if (report->Wants("record.write_MB_per_s")) Write(report);
  if (report->Wants("record.readable_after_kill") || report->Wants("record.lost_at_kill_ms_max")) Kills(report);
  if (report->Wants("guard.disk_full_lost_samples")) FullDisk(report);
  if (report->Wants("record.busy.lost_samples") && !BusySession(report)) {
    std::fprintf(stderr, "bench_recording: the session beside busy loops did not begin or end\n");
    return 1;
  }
  if (report->Wants("record.GB_per_hour") && !Moving(report)) {
    std::fprintf(stderr, "bench_recording: the scripted operation did not end\n");
    return 1;
  }
  for (const char* key : {"record.cpu_pct", "record.lost_samples", "record.samples", "record.file_MB_per_s"}) {
    if (!report->Wants(key)) continue;
    if (Session(report)) break;
    std::fprintf(stderr, "bench_recording: the session did not begin or end within %.0f s\n", kPatience_s);
    return 1;
  }
  return 0;
}

}  // namespace
}  // namespace fulcrum

int main(int argc, char** argv) {
  fulcrum::benchmark::Report report(argc, argv);
  return fulcrum::Run(&report);
}
