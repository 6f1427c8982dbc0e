#include "tests/support/recorder_probe.h"

#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <fstream>
#include <thread>

#include "services/base/runtime/cyclic_thread.h"
#include "services/records/recording/mcap_reader.h"
#include "services/scene/builder/build.h"
#include "services/scene/format/scene_file.h"
#include "services/transport/bus/convert/cdr.h"
#include "services/transport/bus/dds/shared_memory.h"
#include "services/transport/bus/topics.h"
#include "tests/support/cart.h"

namespace fulcrum::testing {
namespace {

namespace fs = std::filesystem;
using runtime::MonotonicNs;

constexpr double kPatience_s = 20;
constexpr std::int64_t kPromise_ns = 1'000'000'000;  ///< Samples older than this must be in the file.
constexpr std::int64_t kOnTheWay_ns = 50'000'000;    ///< Samples younger than this may not have been received yet.
constexpr int kFrameEvery = 10;                      ///< A TissueFrame is sent with every so many ToolStates.
constexpr std::uint32_t kVertices = 20'000;

}  // namespace

RecorderProbe::RecorderProbe(int domain)
    : domain_(domain),
      folder_(fs::temp_directory_path() / ("recorder-probe-" + std::to_string(::getpid()))),
      scene_(folder_ / "scene"),
      tool_stamper_(MonotonicNs()),
      frame_stamper_(MonotonicNs()) {
  fs::create_directories(folder_);
  manifest_.scene_hash = scene::WriteSceneFile(scene::BuildProcedural(scene::Small()), "name: small\n", scene_);
  participant_ = std::make_unique<bus::DdsParticipant>(
      bus::DdsSettings{.domain = domain, .node_name = "probe", .shared_memory = {}});
  manifests_ = participant_->MakeOutput<SceneManifest>();
  tools_ = participant_->MakeOutput<ToolState>();
  frames_ = participant_->MakeOutput<TissueFrame>();
  manifest_.scene_name = "small";
  manifest_.session_id = "probe";
  manifest_.session_start_ns = MonotonicNs();
  manifest_.stamp = {1, static_cast<std::uint64_t>(manifest_.session_start_ns), manifest_.session_start_ns};
  manifests_->Write(manifest_);
}

RecorderProbe::~RecorderProbe() {
  manifests_.reset();
  tools_.reset();
  frames_.reset();
  participant_.reset();
  bus::RemoveSharedMemory(bus::SharedMemoryDirectory(domain_));
  std::error_code ignored;
  fs::remove_all(folder_, ignored);
}

bool RecorderProbe::Connect(const Program& recorder) {
  // The reader of a killed recorder is counted until its lease expires, so only the log shows that the new one has
  // started.
  return WaitFor(kPatience_s, [&] {
    return recorder.Said().find("joined session") != std::string::npos && tools_->has_readers() &&
           frames_->has_readers();
  });
}

void RecorderProbe::SendFor(double seconds) {
  using Clock = std::chrono::steady_clock;
  auto next = Clock::now();
  const auto end = next + std::chrono::duration<double>(seconds);
  ToolState tool;
  std::uint32_t noise = 1;  // Positions that no coding makes smaller.
  for (int i = 0; Clock::now() < end; ++i) {
    const std::int64_t now = MonotonicNs();
    tool.stamp = tool_stamper_.Next(now);
    if (tools_->Write(tool)) sent_tools_.push_back({tool.stamp.sequence, now});
    if (i % kFrameEvery == 0) {
      const Stamp stamp = frame_stamper_.Next(now);
      const bool sent = frames_->WriteInPlace([&](TissueFrame::View view) {
        view.header.stamp = stamp;
        view.header.scene_hash = manifest_.scene_hash;
        view.header.vertex_count = kVertices;
        view.xyz.resize(std::size_t{3} * kVertices);
        for (float& x : view.xyz) {
          noise = noise * 1664525u + 1013904223u;
          x = 5e-6f * static_cast<float>(noise >> 16u);
        }
      });
      if (sent) sent_frames_.push_back({stamp.sequence, now});
    }
    next += std::chrono::milliseconds(1);
    std::this_thread::sleep_until(next);
  }
}

void RecorderProbe::Count(const std::vector<Sent>& sent, const Stamps& read, std::int64_t kill_ns, Result* result) {
  // Samples sent before the two processes discovered each other are not received.
  const std::uint64_t first = read.empty() ? 0 : read.begin()->first;
  for (const Sent& sample : sent) {
    if (sample.sequence < first || sample.time_ns > kill_ns - kPromise_ns) continue;
    ++result->due;
    if (read.empty() || sample.sequence > read.rbegin()->first) continue;
    ++result->read;
    result->missed += read.contains(sample.sequence) ? 0 : 1;
  }
}

std::uint64_t RecorderProbe::Missing(const std::vector<Sent>& sent, const Stamps& read, std::int64_t end_ns) {
  if (read.empty()) return sent.size();
  return static_cast<std::uint64_t>(std::ranges::count_if(sent, [&](const Sent& sample) {
    return sample.sequence >= read.begin()->first && sample.time_ns <= end_ns && !read.contains(sample.sequence);
  }));
}

RecorderProbe::Content RecorderProbe::Read(const fs::path& file) {
  Content content;
  recording::McapReader reader(file);
  recording::McapMessage message;
  while (reader.Next(&message)) {
    const std::string& topic = reader.channels().at(message.channel).topic;
    ToolState tool;
    TissueFrame frame;
    if (topic == bus::RoleOf<ToolState>().name && bus::DecodeCdr(message.data, &tool)) {
      content.tools[tool.stamp.sequence] = tool.stamp.stamp_ns;
    } else if (topic == bus::RoleOf<TissueFrame>().name && bus::DecodeCdr(message.data, &frame)) {
      content.frames[frame.header.stamp.sequence] = frame.header.stamp.stamp_ns;
    }
  }
  content.closed = reader.closed() && reader.faults().empty();
  if (reader.metadata().contains("ended")) content.ended = reader.metadata().at("ended").at("reason");
  return content;
}

std::vector<std::string> RecorderProbe::Arguments(const fs::path& file) const {
  return {"--scene", scene_, "--session", folder_, "--domain", std::to_string(domain_), "--file", file};
}

RecorderProbe::Result RecorderProbe::RecordAndKill(double seconds) {
  Result result;
  result.file = folder_ / ("recording" + std::to_string(++runs_) + ".mcap");
  Program recorder("recorder", Arguments(result.file));
  if (!Connect(recorder)) return result;
  sent_tools_.clear();
  sent_frames_.clear();
  SendFor(seconds);
  const std::int64_t kill_ns = MonotonicNs();
  recorder.End(SIGKILL);

  const Content content = Read(result.file);
  Count(sent_tools_, content.tools, kill_ns, &result);
  Count(sent_frames_, content.frames, kill_ns, &result);
  if (!content.tools.empty()) result.unread_ms = 1e-6 * static_cast<double>(kill_ns - content.tools.rbegin()->second);
  return result;
}

RecorderProbe::FullDisk RecorderProbe::RecordUntilFull(std::uint64_t room_B, double seconds) {
  FullDisk result;
  result.file = folder_ / ("recording" + std::to_string(++runs_) + ".mcap");
  // The reserve leaves only this room of the disk's free space.
  const fs::path cart = folder_ / "cart.yaml";
  const std::uint64_t free_B = fs::space(folder_).available;
  std::ofstream(cart) << "recorder: {keep_free_MB: " << (free_B > room_B ? (free_B - room_B) / 1'000'000 : 0) << "}\n";
  std::vector<std::string> arguments = Arguments(result.file);
  arguments.insert(arguments.end(), {"--cart", cart});
  Program recorder("recorder", arguments);
  if (!Connect(recorder)) return result;
  sent_tools_.clear();
  sent_frames_.clear();
  SendFor(seconds);
  if (recorder.End(SIGTERM) != 0) return result;

  const Content content = Read(result.file);
  result.has_ended = content.closed && !content.ended.empty();
  result.recorded = content.tools.size() + content.frames.size();
  if (content.tools.empty() || content.frames.empty()) return result;
  const std::int64_t end_ns = std::max(content.tools.rbegin()->second, content.frames.rbegin()->second) - kOnTheWay_ns;
  result.lost = Missing(sent_tools_, content.tools, end_ns) + Missing(sent_frames_, content.frames, end_ns);
  return result;
}

}  // namespace fulcrum::testing
