// The bus between two processes, on real topics. All times are CLOCK_MONOTONIC, which both processes share.
//
//   small_rtt              HandleState (56 B) there, CauteryContact (84 B) back, at 1 kHz over UDP loopback; both
//                          sides take and write in the callback.
//   frame_25600            TissueFrame of 25,600 vertices at 100 Hz, from the call of WriteInPlace to the callback in
//                          the other process; frame_25600_take: until the node has the checked copy.
//   body                   bytes of a TissueFrame with the vertices of the built-in scene (x1), three and ten times as
//                          many, the time to pack and unpack it, and by how much a coordinate is off.
//   take                   cost in the thread of a node's tick: TakeLatest without a new sample, and with the ten
//                          ToolStates that arrive in a period of 100 Hz.
//   start_to_first_sample  from fork to the first ToolState of a running publisher in the new process.
#include <fcntl.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <thread>
#include <vector>

#include "services/transport/bus/convert/cdr.h"
#include "services/transport/bus/dds/participant.h"
#include "services/transport/bus/dds/shared_memory.h"
#include "services/transport/bus/input_account.h"
#include "tests/benchmark/report.h"

namespace fulcrum::bus {
namespace {

constexpr int kDomain = 13;
constexpr int kFrameVertices = 25'600;
using Clock = std::chrono::steady_clock;
std::int64_t NowNs() { return Clock::now().time_since_epoch().count(); }
double Us(std::int64_t ns) { return 1e-3 * static_cast<double>(ns); }

DdsParticipant MakeBus(const char* name) {
  return DdsParticipant({.domain = kDomain, .node_name = name, .shared_memory = {}});
}

/// Waits up to ten seconds.
template <class Condition>
bool Eventually(const Condition& condition) {
  const auto end = Clock::now() + std::chrono::seconds(10);
  while (!condition()) {
    if (Clock::now() > end) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return true;
}

// ------------------------------------------------------------------------------------------- the other process

[[noreturn]] void Echo() {
  DdsParticipant bus = MakeBus("bench_echo");
  auto out = bus.MakeOutput<CauteryContact>();
  std::unique_ptr<Input<HandleState>> in;
  std::atomic<bool> made{false};
  HandleState got;
  CauteryContact reply;
  in = bus.MakeInput<HandleState>([&] {
    if (!made) return;
    while (in->TakeNext(&got)) {
      reply.stamp = got.stamp;
      out->Write(reply);
    }
  });
  made = true;
  for (;;) pause();
}

/// Prints, for each frame, the times of its callback and of its checked copy [ns since WriteInPlace].
[[noreturn]] void Watch() {
  DdsParticipant bus = MakeBus("bench_watch");
  std::unique_ptr<Input<TissueFrame>> in;
  std::atomic<bool> made{false};
  TissueFrame got;
  in = bus.MakeInput<TissueFrame>([&] {
    const std::int64_t called_ns = NowNs();
    if (!made || !in->TakeLatest(&got)) return;
    const std::int64_t sent_ns = got.header.stamp.stamp_ns;
    std::printf("%lld %lld\n", static_cast<long long>(called_ns - sent_ns), static_cast<long long>(NowNs() - sent_ns));
  });
  made = true;
  for (;;) pause();
}

/// Prints the time of its first sample.
[[noreturn]] void First() {
  DdsParticipant bus = MakeBus("bench_first");
  auto in = bus.MakeInput<ToolState>();
  ToolState got;
  while (!in->TakeLatest(&got)) std::this_thread::sleep_for(std::chrono::microseconds(200));
  std::printf("%lld\n", static_cast<long long>(NowNs()));
  for (;;) pause();
}

class Peer {
 public:
  explicit Peer(const char* role) {
    int ends[2];
    if (pipe2(ends, O_CLOEXEC) != 0) std::abort();
    pid_ = fork();
    if (pid_ == 0) {
      prctl(PR_SET_PDEATHSIG, SIGKILL);
      dup2(ends[1], STDOUT_FILENO);
      execl("/proc/self/exe", "bench_bus", "--peer", role, nullptr);
      _exit(127);
    }
    close(ends[1]);
    output_ = fdopen(ends[0], "r");
  }
  ~Peer() {
    kill(pid_, SIGKILL);
    waitpid(pid_, nullptr, 0);
    std::fclose(output_);
  }
  Peer(const Peer&) = delete;
  Peer& operator=(const Peer&) = delete;
  [[nodiscard]] std::FILE* output() const { return output_; }

 private:
  pid_t pid_ = -1;
  std::FILE* output_ = nullptr;
};

// ------------------------------------------------------------------------------------------------ the cases

void AddQuantiles(benchmark::Report* report, const std::string& stem, const std::vector<double>& us) {
  report->Add(stem + "_us_p50", benchmark::Quantile(us, 0.50), "us");
  report->Add(stem + "_us_p99", benchmark::Quantile(us, 0.99), "us");
}

void SmallRoundTrip(benchmark::Report* report) {
  const std::uint64_t count = report->quick() ? 1000 : 5000;
  DdsParticipant bus = MakeBus("bench_rtt");
  auto out = bus.MakeOutput<HandleState>();
  std::vector<std::atomic<std::int64_t>> back_ns(count + 1);
  std::vector<std::int64_t> sent_ns(count + 1);
  std::unique_ptr<Input<CauteryContact>> in;
  std::atomic<bool> made{false};
  CauteryContact got;
  in = bus.MakeInput<CauteryContact>([&] {
    if (!made) return;
    while (in->TakeNext(&got)) {
      if (got.stamp.sequence <= count) back_ns[got.stamp.sequence] = NowNs();
    }
  });
  made = true;
  Peer peer("echo");
  HandleState m;
  // Discovery does not complete on both sides at once: only an echo shows that it has. Sequence 0 is this warm-up.
  if (!Eventually([&] { return out->Write(m) && back_ns[0] != 0; })) return;
  Stamper stamper(NowNs());
  auto next = Clock::now();
  for (std::uint64_t i = 1; i <= count; ++i) {
    next += std::chrono::milliseconds(1);
    std::this_thread::sleep_until(next);
    sent_ns[i] = NowNs();
    m.stamp = stamper.Next(sent_ns[i]);
    out->Write(m);
  }
  std::this_thread::sleep_for(std::chrono::milliseconds(100));
  std::vector<double> us;
  for (std::uint64_t i = 1; i <= count; ++i) {
    if (back_ns[i] != 0) us.push_back(Us(back_ns[i] - sent_ns[i]));
  }
  AddQuantiles(report, "bus.small_rtt", us);
  report->Add("bus.small_rtt_lost", static_cast<double>(count - us.size()), "samples");
}

void Frames(benchmark::Report* report) {
  const std::size_t count = report->quick() ? 100 : 500;
  DdsParticipant bus = MakeBus("bench_frames");
  auto out = bus.MakeOutput<TissueFrame>();
  Peer peer("watch");
  // Discovery does not complete on both sides at once; the reader has matched by its next announcement at the latest.
  if (!Eventually([&] { return out->has_readers(); })) return;
  std::this_thread::sleep_for(std::chrono::milliseconds(200));
  std::vector<float> xyz(std::size_t{3} * kFrameVertices, 0.25f);
  Stamper stamper(NowNs());
  std::vector<double> write_us;
  auto next = Clock::now();
  for (std::size_t i = 0; i < count; ++i) {
    next += std::chrono::milliseconds(10);
    std::this_thread::sleep_until(next);
    xyz[0] = 1e-4f * static_cast<float>(i % 100);
    const std::int64_t start_ns = NowNs();
    out->WriteInPlace([&](TissueFrame::View view) {
      view.header.stamp = stamper.Next(start_ns);
      view.header.vertex_count = kFrameVertices;
      view.xyz.assign(xyz.begin(), xyz.end());
    });
    write_us.push_back(Us(NowNs() - start_ns));
  }
  std::this_thread::sleep_for(std::chrono::milliseconds(100));
  // The pipe holds all lines: 500 of at most 20 characters.
  fcntl(fileno(peer.output()), F_SETFL, O_NONBLOCK);
  std::vector<double> called_us, taken_us;
  long long called = 0, taken = 0;
  while (std::fscanf(peer.output(), "%lld %lld", &called, &taken) == 2) {
    called_us.push_back(Us(called));
    taken_us.push_back(Us(taken));
  }
  AddQuantiles(report, "bus.frame_25600", called_us);
  AddQuantiles(report, "bus.frame_25600_take", taken_us);
  AddQuantiles(report, "bus.frame_25600_write", write_us);
  report->Add("bus.frame_25600_lost", static_cast<double>(count) - static_cast<double>(called_us.size()), "samples");
}

/// A crumpled sheet of 69 mm.
std::vector<float> Sheet(int vertices) {
  const int cols = static_cast<int>(std::sqrt(vertices / 3.0));
  std::vector<float> xyz;
  for (int v = 0; v < vertices; ++v) {
    const double s = 0.069 * (v % cols) / cols, t = 0.2 * (v / cols) * cols / vertices;
    for (const double x : {s, t, 0.02 * std::sin(150 * s) * std::cos(80 * t)}) xyz.push_back(static_cast<float>(x));
  }
  return xyz;
}

void Sizes(benchmark::Report* report) {
  constexpr int kBuiltIn = 20560;
  for (const int times : {1, 3, 10}) {
    const std::string x = ".moving_x" + std::to_string(times);
    TissueFrame frame, got;
    frame.xyz = Sheet(times * kBuiltIn);
    frame.header.vertex_count = static_cast<std::uint32_t>(times * kBuiltIn);
    std::vector<std::uint8_t> bytes;
    std::vector<double> pack_us, unpack_us;
    for (int i = 0; i < (report->quick() ? 5 : 50); ++i) {
      const std::int64_t start_ns = NowNs();
      if (!EncodeCdr(frame, &bytes)) return;
      const std::int64_t packed_ns = NowNs();
      if (!DecodeCdr(bytes, &got)) return;
      pack_us.push_back(Us(packed_ns - start_ns));
      unpack_us.push_back(Us(NowNs() - packed_ns));
    }
    double off_m = 0;
    for (std::size_t i = 0; i < frame.xyz.size(); ++i) {
      off_m = std::max(off_m, std::abs(static_cast<double>(got.xyz[i]) - static_cast<double>(frame.xyz[i])));
    }
    report->Add("body.frame_kB" + x, 1e-3 * static_cast<double>(bytes.size()), "kB");
    AddQuantiles(report, "body.frame_pack" + x, pack_us);
    AddQuantiles(report, "body.frame_unpack" + x, unpack_us);
    report->Add("body.quantisation_um_max" + x, 1e6 * off_m, "um");
  }
}

void Take(benchmark::Report* report) {
  DdsParticipant writer_side = MakeBus("bench_take_writer");
  DdsParticipant reader_side = MakeBus("bench_take_reader");
  auto out = writer_side.MakeOutput<ToolState>();
  auto in = reader_side.MakeInput<ToolState>();
  Stamper stamper(NowNs());
  ToolState m;
  if (!Eventually([&] { return out->Write(m) && in->TakeLatest(&m); })) return;
  std::vector<double> empty_us, ten_us;
  for (int i = 0; i < (report->quick() ? 50 : 300); ++i) {
    const std::uint64_t before = in->stats().received;
    for (int k = 0; k < 10; ++k) {
      m.stamp = stamper.Next(NowNs());
      out->Write(m);
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
    ToolState got;
    std::int64_t start_ns = NowNs();
    static_cast<void>(in->TakeLatest(&got));
    const double us = Us(NowNs() - start_ns);
    if (in->stats().received == before + 10) ten_us.push_back(us);
    start_ns = NowNs();
    static_cast<void>(in->TakeLatest(&got));
    empty_us.push_back(Us(NowNs() - start_ns));
  }
  report->Add("bus.take.nothing_us_p50", benchmark::Quantile(empty_us, 0.5), "us");
  report->Add("bus.take.ten_tool_states_us_p50", benchmark::Quantile(ten_us, 0.5), "us");
}

void Start(benchmark::Report* report) {
  DdsParticipant bus = MakeBus("bench_start");
  auto out = bus.MakeOutput<ToolState>();
  std::atomic<bool> stop{false};
  std::thread publisher([&] {
    Stamper stamper(NowNs());
    ToolState m;
    while (!stop) {
      m.stamp = stamper.Next(NowNs());
      out->Write(m);
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
  });
  std::vector<double> ms;
  for (int i = 0; i < (report->quick() ? 7 : 25); ++i) {
    const std::int64_t start_ns = NowNs();
    Peer peer("first");
    long long first_ns = 0;
    if (std::fscanf(peer.output(), "%lld", &first_ns) == 1) ms.push_back(1e-3 * Us(first_ns - start_ns));
  }
  stop = true;
  publisher.join();
  report->Add("bus.start_to_first_sample_ms_p50", benchmark::Quantile(ms, 0.5), "ms");
  report->Add("bus.start_to_first_sample_ms_max", benchmark::Quantile(ms, 1.0), "ms");
}

int Main(int argc, char** argv) {
  if (argc == 3 && std::string(argv[1]) == "--peer") {
    std::setvbuf(stdout, nullptr, _IOLBF, 0);
    const std::string role = argv[2];
    if (role == "echo") Echo();
    if (role == "watch") Watch();
    First();
  }
  benchmark::Report report(argc, argv);
  if (report.Wants("bus.small_rtt")) SmallRoundTrip(&report);
  if (report.Wants("bus.frame_25600")) Frames(&report);
  if (report.Wants("bus.take")) Take(&report);
  if (report.Wants("body.frame")) Sizes(&report);
  if (report.Wants("bus.start_to_first_sample")) Start(&report);
  RemoveSharedMemory(SharedMemoryDirectory(kDomain));
  return 0;
}

}  // namespace
}  // namespace fulcrum::bus

int main(int argc, char** argv) { return fulcrum::bus::Main(argc, argv); }
