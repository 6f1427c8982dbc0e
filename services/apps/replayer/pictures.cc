#include "services/apps/replayer/pictures.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "render_node/node/render_node.h"
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
  /// True when the message is of this topic; its stamp goes to `stamp_ns`.
  bool Take(const std::string& topic, std::span<const std::uint8_t> bytes, std::int64_t* stamp_ns) {
    if (topic != bus::RoleOf<T>().name) return false;
    if (bus::DecodeCdr(bytes, &message_)) {
      out_->Write(message_);
      *stamp_ns = std::max(*stamp_ns, bus::StampOf(message_).stamp_ns);
    }
    return true;
  }

 private:
  bus::InProcessTopic<T> topic_;
  std::unique_ptr<bus::Input<T>> in_ = topic_.MakeInput();
  std::unique_ptr<typename bus::OutputOf<T>::type> out_ = topic_.MakeOutput();
  T message_;
};

}  // namespace

PicturesResult ReplayPictures(const PicturesSettings& settings, const SceneView& scene,
                              const std::function<void(double)>& progress) {
  recording::TimeOrder messages(settings.recording);
  const recording::McapReader& reader = messages.reader();
  Feed<TissueFrame> tissue;
  Feed<TopologyState> topology;
  Feed<TemperaturePatch> patches;
  Feed<ToolState> tools;
  Feed<HandleState> handles;
  Feed<ThermalEvent> events;
  Feed<CauteryContact> contacts;
  Feed<GeneratorSetting> generator;
  Feed<ContactModel> contact_models;
  render::RenderSettings render_settings;
  // Quality auto depends on the speed of the machine, so that pictures would differ between runs.
  render_settings.quality = render::Quality::kHigh;
  render_settings.frames = settings.frames;
  render::RenderNode node(scene, render_settings,
                          {tissue.input(), topology.input(), patches.input(), tools.input(), handles.input(),
                           events.input(), contacts.input(), generator.input(), contact_models.input(), nullptr});

  std::optional<SceneManifest> session;
  const double period_s = 1.0 / std::max(0.001f, scene.render.rate_Hz);
  std::int64_t newest_ns = 0;
  Tick tick;
  tick.dt_s = period_s;
  recording::McapMessage message{};
  double told_s = 0;
  while (messages.Next(&message)) {
    const std::string& topic = reader.channels().at(message.channel).topic;
    if (topic == bus::RoleOf<SceneManifest>().name) {
      if (SceneManifest manifest; bus::DecodeCdr(message.data, &manifest)) session = manifest;
      RefuseOtherScene(settings.recording, session, scene);
      continue;
    }
    const bool known = tissue.Take(topic, message.data, &newest_ns) || topology.Take(topic, message.data, &newest_ns) ||
                       patches.Take(topic, message.data, &newest_ns) || tools.Take(topic, message.data, &newest_ns) ||
                       handles.Take(topic, message.data, &newest_ns) || events.Take(topic, message.data, &newest_ns) ||
                       contacts.Take(topic, message.data, &newest_ns) ||
                       generator.Take(topic, message.data, &newest_ns) ||
                       contact_models.Take(topic, message.data, &newest_ns);
    if (!known || !session) continue;
    const double time_s = 1e-9 * static_cast<double>(newest_ns - session->session_start_ns);
    if (settings.until_s >= 0 && time_s > settings.until_s) break;
    if (time_s < static_cast<double>(tick.index) * period_s) continue;
    tick.index = static_cast<std::uint64_t>(std::floor(time_s / period_s)) + 1;
    tick.session_time_s = time_s;
    tick.stamp_ns = newest_ns;
    node.Step(tick);
    // Without this wait, a replay faster than the disk would drop pictures.
    node.WaitForFiles();
    if (progress && time_s > told_s + 0.1) {
      told_s = time_s;
      progress(time_s);
    }
  }
  node.Finish();
  node.WaitForFiles();
  Health health;
  node.FillHealth(&health);
  return {node.pictures_written(), health.metrics};
}

}  // namespace fulcrum::replay
