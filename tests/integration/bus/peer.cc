// The other process of the bus tests: bus_test_peer DOMAIN ROLE [ARGUMENT]. Runs until it is killed.
#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <thread>

#include "services/transport/bus/dds/participant.h"
#include "services/transport/bus/input_account.h"
#include "tests/unit/bus/samples.h"

namespace fulcrum::bus {
namespace {

std::int64_t NowNs() { return std::chrono::steady_clock::now().time_since_epoch().count(); }

[[noreturn]] void Rest() {
  for (;;) pause();
}

/// ToolState at 1 kHz.
[[noreturn]] void PublishTools(DdsParticipant* bus) {
  auto out = bus->MakeOutput<ToolState>();
  Stamper stamper(NowNs());
  ToolState m = test::Sample<ToolState>();
  for (;;) {
    m.stamp = stamper.Next(NowNs());
    out->Write(m);
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
}

/// TissueFrame at 100 Hz, in place, every coordinate equal to the frame's number modulo 8: a torn frame would show.
[[noreturn]] void PublishFrames(DdsParticipant* bus) {
  auto out = bus->MakeOutput<TissueFrame>();
  Stamper stamper(NowNs());
  for (;;) {
    out->WriteInPlace([&](TissueFrame::View view) {
      view.header.stamp = stamper.Next(NowNs());
      view.header.vertex_count = kMaxTissueVertices;
      view.xyz.assign(3 * kMaxTissueVertices, static_cast<float>(view.header.stamp.sequence % 8));
    });
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
}

/// Publishes once each topic that late joiners receive.
[[noreturn]] void PublishState(DdsParticipant* bus, int node) {
  auto scene = bus->MakeOutput<SceneManifest>();
  auto topology = bus->MakeOutput<TopologyState>();
  auto health = bus->MakeOutput<Health>();
  if (node == 0) {
    scene->Write(test::Sample<SceneManifest>());
    topology->Write(test::Sample<TopologyState>());
  }
  Health m = test::Sample<Health>();
  m.node = static_cast<NodeId>(node);
  m.stamp.epoch = static_cast<std::uint64_t>(node + 1);
  health->Write(m);
  std::puts("ready");
  Rest();
}

/// Prints the sequence number of each frame and tool state that it takes.
[[noreturn]] void Subscribe(DdsParticipant* bus) {
  auto frames = bus->MakeInput<TissueFrame>();
  auto tools = bus->MakeInput<ToolState>();
  TissueFrame frame;
  ToolState tool;
  for (;;) {
    if (frames->TakeLatest(&frame)) {
      std::printf("frame %llu\n", static_cast<unsigned long long>(frame.header.stamp.sequence));
    }
    if (tools->TakeLatest(&tool)) {
      std::printf("tool %llu\n", static_cast<unsigned long long>(tool.stamp.sequence));
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
}

int Main(int argc, char** argv) {
  if (argc < 3) {
    std::fprintf(stderr, "usage: bus_test_peer DOMAIN tools|frames|state|subscribe|alien [ARGUMENT]\n");
    return 2;
  }
  std::setvbuf(stdout, nullptr, _IOLBF, 0);
  const std::string role = argv[2];
  DdsSettings settings;
  settings.domain = std::atoi(argv[1]);
  settings.node_name = "peer_" + role;
  if (role == "alien") settings.schema_hash = 0xa11e5ull;
  settings.lease_s = 1;  // Short, so that tests need not wait until a killed peer is removed.
  DdsParticipant bus(settings);
  if (role == "tools") PublishTools(&bus);
  if (role == "frames") PublishFrames(&bus);
  if (role == "state") PublishState(&bus, argc > 3 ? std::atoi(argv[3]) : 0);
  if (role == "subscribe") Subscribe(&bus);
  if (role == "alien") PublishTools(&bus);
  return 2;
}

}  // namespace
}  // namespace fulcrum::bus

int main(int argc, char** argv) { return fulcrum::bus::Main(argc, argv); }
