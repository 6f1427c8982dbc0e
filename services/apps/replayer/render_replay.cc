#include "services/apps/replayer/render_replay.h"

#include <algorithm>
#include <span>
#include <string>
#include <tuple>

#include "services/apps/replayer/recorded_topic.h"
#include "services/apps/replayer/session_facts.h"
#include "services/records/recording/time_order.h"
#include "services/transport/bus/convert/cdr.h"
#include "services/transport/bus/in_process.h"
#include "services/transport/bus/topics.h"

namespace fulcrum::replay {
namespace {

/// One topic from the recording to the renderer.
template <class T>
class Feed {
 public:
  [[nodiscard]] bus::Input<T>& input() { return *in_; }
  [[nodiscard]] const T& newest() const { return newest_; }
  /// True when the message is of this topic; its stamp goes to `stamp_ns`.
  bool Take(const std::string& topic, std::span<const std::uint8_t> bytes, std::int64_t latest_ns,
            std::int64_t* stamp_ns) {
    if (topic != bus::RoleOf<T>().name) return false;
    if (const T* sample = recorded_.Take(bytes, latest_ns)) {
      newest_ = *sample;
      out_->Write(newest_);
      *stamp_ns = std::max(*stamp_ns, bus::StampOf(newest_).stamp_ns);
    }
    return true;
  }

 private:
  bus::InProcessTopic<T> topic_;
  std::unique_ptr<bus::Input<T>> in_ = topic_.MakeInput();
  std::unique_ptr<typename bus::OutputOf<T>::type> out_ = topic_.MakeOutput();
  RecordedTopic<T> recorded_;
  T newest_;
};

using Feeds =
    std::tuple<Feed<TissueFrame>, Feed<TopologyState>, Feed<TemperaturePatch>, Feed<ToolState>, Feed<HandleState>,
               Feed<ThermalEvent>, Feed<CauteryContact>, Feed<GeneratorSetting>, Feed<ContactModel>, Feed<ClipState>>;

template <class T>
bus::Input<T>& InputIn(Feeds& feeds) {
  return std::get<Feed<T>>(feeds).input();
}

render::RenderPorts PortsOf(Feeds& feeds) {
  return {InputIn<TissueFrame>(feeds),
          InputIn<TopologyState>(feeds),
          InputIn<TemperaturePatch>(feeds),
          InputIn<ToolState>(feeds),
          InputIn<HandleState>(feeds),
          InputIn<ThermalEvent>(feeds),
          InputIn<CauteryContact>(feeds),
          InputIn<GeneratorSetting>(feeds),
          InputIn<ContactModel>(feeds),
          InputIn<ClipState>(feeds),
          nullptr};
}

}  // namespace

struct RenderReplay::Impl {
  Impl(const std::filesystem::path& file, const SceneView& given, const render::RenderSettings& settings)
      : recording(file), scene(given), clock(ClockOf(file)), messages(file), node(given, settings, PortsOf(feeds)) {}

  [[nodiscard]] double TimeOf(std::int64_t stamp_ns) const {
    return 1e-9 * static_cast<double>(stamp_ns - session->session_start_ns);
  }

  const std::filesystem::path recording;
  const SceneView& scene;
  const RecordedClock clock;
  recording::TimeOrder messages;
  Feeds feeds;
  render::RenderNode node;
  std::optional<SceneManifest> session;
  std::int64_t newest_ns = 0;
  Tick tick;
};

RenderReplay::RenderReplay(const std::filesystem::path& recording, const SceneView& scene,
                           const render::RenderSettings& settings)
    : impl_(std::make_unique<Impl>(recording, scene, settings)) {}

RenderReplay::~RenderReplay() = default;

render::RenderNode& RenderReplay::node() { return impl_->node; }

std::int64_t RenderReplay::session_start_ns() const { return impl_->session->session_start_ns; }

const HandleState& RenderReplay::handles() const { return std::get<Feed<HandleState>>(impl_->feeds).newest(); }
const GeneratorSetting& RenderReplay::generator() const {
  return std::get<Feed<GeneratorSetting>>(impl_->feeds).newest();
}
const ThermalEvent& RenderReplay::event() const { return std::get<Feed<ThermalEvent>>(impl_->feeds).newest(); }

const ContactModel& RenderReplay::contact_model() const { return std::get<Feed<ContactModel>>(impl_->feeds).newest(); }

std::optional<double> RenderReplay::Next() {
  recording::McapMessage message{};
  while (impl_->messages.Next(&message)) {
    const std::string& topic = impl_->messages.reader().channels().at(message.channel).topic;
    if (topic == bus::RoleOf<SceneManifest>().name) {
      if (SceneManifest manifest; bus::DecodeCdr(message.data, &manifest)) impl_->session = manifest;
      RefuseOtherScene(impl_->recording, impl_->session, impl_->scene);
      continue;
    }
    const std::int64_t latest_ns = LatestStamp(impl_->clock, message.log_time_ns);
    const bool known =
        std::apply([&](auto&... feed) { return (feed.Take(topic, message.data, latest_ns, &impl_->newest_ns) || ...); },
                   impl_->feeds);
    if (known && impl_->session) return impl_->TimeOf(impl_->newest_ns);
  }
  return std::nullopt;
}

void RenderReplay::Step(double time_s) {
  Tick& tick = impl_->tick;
  ++tick.index;
  tick.dt_s = time_s - tick.session_time_s;
  tick.session_time_s = time_s;
  tick.stamp_ns = impl_->newest_ns;
  impl_->node.Step(tick);
}

}  // namespace fulcrum::replay
