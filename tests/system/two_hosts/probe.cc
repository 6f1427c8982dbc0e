// Reads the bus of the host that it runs on and writes the samples to a file, for comparison with another host.
//
//   two_hosts_probe DOMAIN FILE [tissue]
//
// It waits for a session, and joins with the rights of a recorder.
// FILE gets a line per sample: "tool <session time s> <force 0 N> <force 1 N> <model age s>",
// "health <node> <state> <pid> <ticks>", "link <name> <value>", "event ..."; FILE.tissue, with "tissue", binary:
// sequence (u64), age at arrival (f64, s), vertex count (u32), floats.
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <thread>

#include "services/base/runtime/cyclic_thread.h"
#include "services/base/runtime/realtime.h"
#include "services/transport/bus/dds/participant.h"
#include "services/transport/bus/dds/shared_memory.h"

using namespace fulcrum;  // NOLINT(google-build-using-namespace): a program of one page.

int main(int argc, char** argv) {
  if (argc < 3) return 2;
  runtime::InstallStopSignals();
  const int domain = std::atoi(argv[1]);
  const std::filesystem::path memory = bus::SharedMemoryDirectory(domain);
  // Each session announces whether its bus uses keys of its own or those of its cart file.
  while (bus::AnnouncedSession(memory) == 0 && !runtime::ShouldStop()) {
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  const bus::Security security = bus::AnnouncedSecurity(memory, NodeName(NodeId::kRecorder));
  bus::DdsParticipant participant(
      {.domain = domain, .node_name = "probe", .shared_memory = memory, .security = security});
  const bool with_tissue = argc > 3 && std::strcmp(argv[3], "tissue") == 0;
  const auto manifests = participant.MakeInput<SceneManifest>();
  const auto tools = participant.MakeInput<ToolState>();
  const auto healths = participant.MakeInput<Health>();
  const auto frames = with_tissue ? participant.MakeInput<TissueFrame>() : nullptr;
  std::FILE* text = std::fopen(argv[2], "w");
  std::FILE* tissue = with_tissue ? std::fopen((std::string(argv[2]) + ".tissue").c_str(), "w") : nullptr;
  if (text == nullptr) return 1;
  SceneManifest manifest;
  ToolState tool;
  Health health;
  TissueFrame frame;
  while (!runtime::ShouldStop()) {
    (void)manifests->TakeLatest(&manifest);
    const auto session_s = [&](std::int64_t stamp_ns) {
      return manifest.session_start_ns == 0 ? -1.0 : 1e-9 * static_cast<double>(stamp_ns - manifest.session_start_ns);
    };
    while (tools->TakeNext(&tool)) {
      std::fprintf(text, "tool %.4f %.5f %.5f %.4f\n", session_s(tool.stamp.stamp_ns),
                   static_cast<double>(tool.tools[0].f_W.norm()), static_cast<double>(tool.tools[1].f_W.norm()),
                   static_cast<double>(tool.tools[0].model_age_s));
    }
    while (healths->TakeNext(&health)) {
      std::fprintf(text, "health %s %d %d %llu\n", NodeName(health.node), static_cast<int>(health.state), health.pid,
                   static_cast<unsigned long long>(health.ticks));
      for (const Metric& metric : health.metrics) {
        if (metric.name.starts_with("link_")) std::fprintf(text, "link %s %.10g\n", metric.name.c_str(), metric.value);
      }
    }
    while (frames != nullptr && frames->TakeLatest(&frame)) {
      const double age_s = 1e-9 * static_cast<double>(runtime::MonotonicNs() - frame.header.stamp.stamp_ns);
      std::fwrite(&frame.header.stamp.sequence, 8, 1, tissue);
      std::fwrite(&age_s, 8, 1, tissue);
      std::fwrite(&frame.header.vertex_count, 4, 1, tissue);
      std::fwrite(frame.xyz.data(), sizeof(float), frame.xyz.size(), tissue);
    }
    std::fflush(text);
    if (tissue != nullptr) std::fflush(tissue);
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return 0;
}
