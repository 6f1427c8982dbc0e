// SceneManifest, Command, CommandReply, TickManifest, Health.
#include <string>
#include <string_view>

#include "services/bus/convert/convert.h"
#include "services/bus/convert/pieces.h"
#include "services/bus/gate.h"

namespace fulcrum::bus {

using convert::Octet;
namespace cv = convert;

static_assert(idl::NODE_RECORDER == kNodeCount - 1 && idl::NODE_PHYSICS == static_cast<int>(NodeId::kPhysics));
static_assert(idl::TOPIC_GENERATOR_SETTING == kTopicCount - 1 &&
              idl::TOPIC_COMMAND == static_cast<int>(TopicId::kCommand));
static_assert(idl::MODE_LOCK_STEP == static_cast<int>(SessionMode::kLockStep));
static_assert(idl::HEALTH_STOPPING == static_cast<int>(HealthState::kStopping));
static_assert(idl::MAX_CONSUMED == kMaxConsumedInputs && idl::MAX_INPUT_HEALTHS == kMaxInputHealths &&
              idl::MAX_METRICS == kMaxMetrics);

namespace {

template <class FixedString>
bool PutName(const std::string& from, FixedString* to) {
  if (from.size() > FixedString::max_size) return false;
  *to = from;
  return true;
}

/// Cut to what fits, at a character boundary of UTF-8.
template <class FixedString>
void PutText(const std::string& from, FixedString* to) {
  std::size_t length = from.size();
  if (length > FixedString::max_size) {
    length = FixedString::max_size;
    while (length > 0 && (static_cast<unsigned char>(from[length]) & 0xc0u) == 0x80u) --length;
  }
  *to = from.substr(0, length);  // assign() would leave the end of a longer text that stood there.
}

template <class FixedString>
void Get(const FixedString& from, std::string* to) {
  to->assign(from.c_str(), from.size());
}

idl::TimingSummary ToWire(const TimingSummary& t) {
  idl::TimingSummary w;
  w.p50_us(t.p50_us);
  w.p99_us(t.p99_us);
  w.max_us(t.max_us);
  return w;
}
TimingSummary FromWire(const idl::TimingSummary& w) { return {w.p50_us(), w.p99_us(), w.max_us()}; }

}  // namespace

bool ToWire(const SceneManifest& from, idl::SceneManifest* to) {
  to->stamp(cv::ToWire(from.stamp));
  to->scene_hash(from.scene_hash);
  to->session_start_ns(from.session_start_ns);
  to->mode(Octet(from.mode));
  to->recorded(from.recorded);
  return PutName(from.scene_name, &to->scene_name()) && PutName(from.session_id, &to->session_id());
}

void FromWire(const idl::SceneManifest& from, SceneManifest* to) {
  to->stamp = cv::FromWire(from.stamp());
  to->scene_hash = from.scene_hash();
  to->session_start_ns = from.session_start_ns();
  to->mode = static_cast<SessionMode>(from.mode());
  to->recorded = from.recorded();
  Get(from.scene_name(), &to->scene_name);
  Get(from.session_id(), &to->session_id);
}

bool ToWire(const Command& from, idl::Command* to) {
  to->stamp(cv::ToWire(from.stamp));
  to->request_id(from.request_id);
  to->target(Octet(from.target));
  return PutName(from.verb, &to->verb()) && PutName(from.argument, &to->argument());
}

void FromWire(const idl::Command& from, Command* to) {
  to->stamp = cv::FromWire(from.stamp());
  to->request_id = from.request_id();
  to->target = static_cast<NodeId>(from.target());
  Get(from.verb(), &to->verb);
  Get(from.argument(), &to->argument);
}

bool ToWire(const CommandReply& from, idl::CommandReply* to) {
  to->stamp(cv::ToWire(from.stamp));
  to->request_id(from.request_id);
  to->from_node(Octet(from.from));
  to->ok(from.ok);
  PutText(from.text, &to->text());
  return true;
}

void FromWire(const idl::CommandReply& from, CommandReply* to) {
  to->stamp = cv::FromWire(from.stamp());
  to->request_id = from.request_id();
  to->from = static_cast<NodeId>(from.from_node());
  to->ok = from.ok();
  Get(from.text(), &to->text);
}

bool ToWire(const TickManifest& from, idl::TickManifest* to) {
  if (from.consumed.size() > kMaxConsumedInputs) return false;
  to->stamp(cv::ToWire(from.stamp));
  to->node(Octet(from.node));
  to->tick(from.tick);
  to->session_time_s(from.session_time_s);
  to->state_hash(from.state_hash);
  to->consumed().resize(from.consumed.size());
  for (std::size_t i = 0; i < from.consumed.size(); ++i) {
    idl::ConsumedInput& w = to->consumed()[i];
    w.topic(Octet(from.consumed[i].topic));
    w.epoch(from.consumed[i].epoch);
    w.number(from.consumed[i].sequence);
  }
  return true;
}

void FromWire(const idl::TickManifest& from, TickManifest* to) {
  to->stamp = cv::FromWire(from.stamp());
  to->node = static_cast<NodeId>(from.node());
  to->tick = from.tick();
  to->session_time_s = from.session_time_s();
  to->state_hash = from.state_hash();
  to->consumed.clear();
  for (const idl::ConsumedInput& w : from.consumed()) {
    to->consumed.push_back({static_cast<TopicId>(w.topic()), w.epoch(), w.number()});
  }
}

bool ToWire(const Health& from, idl::Health* to) {
  if (from.inputs.size() > kMaxInputHealths || from.metrics.size() > kMaxMetrics) return false;
  to->stamp(cv::ToWire(from.stamp));
  to->node(Octet(from.node));
  to->state(Octet(from.state));
  to->pid(from.pid);
  to->schema_hash(from.schema_hash);
  to->scene_hash(from.scene_hash);
  to->rate_asked_Hz(from.rate_asked_Hz);
  to->rate_achieved_Hz(from.rate_achieved_Hz);
  to->ticks(from.ticks);
  to->overruns(from.overruns);
  to->write_failures(from.write_failures);
  to->step(ToWire(from.step));
  to->wake(ToWire(from.wake));
  PutText(from.last_error, &to->last_error());
  to->inputs().resize(from.inputs.size());
  for (std::size_t i = 0; i < from.inputs.size(); ++i) {
    const InputHealth& h = from.inputs[i];
    idl::InputHealth& w = to->inputs()[i];
    w.topic(Octet(h.topic));
    w.matched(h.matched);
    w.age_ms(h.age_ms);
    w.received(h.received);
    w.lost(h.lost);
    w.rejected(h.rejected);
  }
  to->metrics().resize(from.metrics.size());
  for (std::size_t i = 0; i < from.metrics.size(); ++i) {
    to->metrics()[i].value(from.metrics[i].value);
    if (!PutName(from.metrics[i].name, &to->metrics()[i].name())) return false;
  }
  return true;
}

void FromWire(const idl::Health& from, Health* to) {
  to->stamp = cv::FromWire(from.stamp());
  to->node = static_cast<NodeId>(from.node());
  to->state = static_cast<HealthState>(from.state());
  to->pid = from.pid();
  to->schema_hash = from.schema_hash();
  to->scene_hash = from.scene_hash();
  to->rate_asked_Hz = from.rate_asked_Hz();
  to->rate_achieved_Hz = from.rate_achieved_Hz();
  to->ticks = from.ticks();
  to->overruns = from.overruns();
  to->write_failures = from.write_failures();
  to->step = FromWire(from.step());
  to->wake = FromWire(from.wake());
  Get(from.last_error(), &to->last_error);
  to->inputs.clear();
  for (const idl::InputHealth& w : from.inputs()) {
    to->inputs.push_back(
        {static_cast<TopicId>(w.topic()), w.matched(), w.age_ms(), w.received(), w.lost(), w.rejected()});
  }
  to->metrics.resize(from.metrics().size());
  for (std::size_t i = 0; i < to->metrics.size(); ++i) {
    Get(from.metrics()[i].name(), &to->metrics[i].name);
    to->metrics[i].value = from.metrics()[i].value();
  }
}

}  // namespace fulcrum::bus
