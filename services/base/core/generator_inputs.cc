#include "services/base/core/generator_inputs.h"

#include <algorithm>
#include <iterator>

namespace fulcrum {
namespace {

constexpr unsigned kAllPedals = kPedalCut | kPedalCoag | kPedalBlend;

void Name(TopicId topic, const Stamp& stamp, std::vector<ConsumedInput>* consumed) {
  if (consumed == nullptr) return;
  const bool named = std::any_of(consumed->begin(), consumed->end(), [&](const ConsumedInput& other) {
    return other.topic == topic && other.epoch == stamp.epoch && other.sequence == stamp.sequence;
  });
  if (!named) consumed->push_back({topic, stamp.epoch, stamp.sequence});
}

/// The first sample that is later than `ns`.
template <class Samples>
auto Later(const Samples& samples, std::int64_t ns) {
  return std::upper_bound(samples.begin(), samples.end(), ns,
                          [](std::int64_t at, const auto& sample) { return at < sample.stamp.stamp_ns; });
}

template <class Samples, class Sample>
void Append(std::size_t capacity, const Sample& sample, Samples* samples) {
  if (!samples->empty() && sample.stamp.stamp_ns <= samples->back().stamp.stamp_ns) return;
  samples->push_back(sample);
  if (samples->size() > capacity) samples->pop_front();
}

template <class Samples>
void DropOlder(std::int64_t ns, Samples* samples) {
  while (samples->size() > 1 && (*samples)[1].stamp.stamp_ns <= ns) samples->pop_front();
}

bool IsPower(float power_W) { return power_W >= 0 && power_W <= kMaxSetPower_W; }

}  // namespace

CauteryMode ModeOf(std::uint8_t pedals) {
  return (pedals & kPedalCut) != 0     ? CauteryMode::kCut
         : (pedals & kPedalBlend) != 0 ? CauteryMode::kBlend
         : (pedals & kPedalCoag) != 0  ? CauteryMode::kCoag
                                       : CauteryMode::kOff;
}

float PowerOf(const GeneratorSetting& setting, CauteryMode mode) {
  switch (mode) {
    case CauteryMode::kCut:
      return setting.cut_W;
    case CauteryMode::kCoag:
      return setting.coag_W;
    case CauteryMode::kBlend:
      return setting.blend_W;
    case CauteryMode::kOff:
      break;
  }
  return 0;
}

void GeneratorInputs::Add(const HandleState& state) {
  Append(capacity_, PedalSample{state.stamp, state.pedals}, &pedals_);
}

void GeneratorInputs::Add(const GeneratorSetting& setting) { Append(capacity_, setting, &settings_); }

CauteryMode GeneratorInputs::ModeAt(std::int64_t ns, std::vector<ConsumedInput>* consumed) const {
  const auto after = Later(pedals_, ns);
  if (after == pedals_.begin()) return CauteryMode::kOff;
  const PedalSample& before = *std::prev(after);
  Name(TopicId::kHandleState, before.stamp, consumed);
  const CauteryMode mode = ModeOf(before.pedals);
  if (ns - before.stamp.stamp_ns <= kPedalTimeout_ns) return mode;
  if (after == pedals_.end()) return CauteryMode::kOff;
  Name(TopicId::kHandleState, after->stamp, consumed);
  const bool bridged =
      after->stamp.stamp_ns - before.stamp.stamp_ns <= kPedalBridged_ns && ModeOf(after->pedals) == mode;
  return bridged ? mode : CauteryMode::kOff;
}

GeneratorDemand GeneratorInputs::At(std::int64_t ns, std::vector<ConsumedInput>* consumed) const {
  const CauteryMode mode = ModeAt(ns, consumed);
  if (settings_.empty()) return {mode, 0};
  // The newest setting is all that a late joiner gets, so it also applies to the time before it.
  const auto later = Later(settings_, ns);
  const GeneratorSetting& setting = later == settings_.begin() ? settings_.front() : *std::prev(later);
  Name(TopicId::kGeneratorSetting, setting.stamp, consumed);
  return {mode, PowerOf(setting, mode)};
}

void GeneratorInputs::DropBefore(std::int64_t ns) {
  DropOlder(ns, &pedals_);
  DropOlder(ns, &settings_);
}

GeneratorInputs::State GeneratorInputs::Save() const {
  State state;
  state.pedal_stamp.stamp_ns = state.setting_stamp.stamp_ns = -1;
  if (!pedals_.empty()) {
    state.pedal_stamp = pedals_.front().stamp;
    state.pedals = pedals_.front().pedals;
  }
  if (!settings_.empty()) {
    const GeneratorSetting& setting = settings_.front();
    state.setting_stamp = setting.stamp;
    state.cut_W = setting.cut_W;
    state.coag_W = setting.coag_W;
    state.blend_W = setting.blend_W;
  }
  return state;
}

bool GeneratorInputs::Restore(const State& state) {
  const bool plausible =
      (state.pedals & ~kAllPedals) == 0 && IsPower(state.cut_W) && IsPower(state.coag_W) && IsPower(state.blend_W);
  if (!plausible) return false;
  pedals_.clear();
  settings_.clear();
  if (state.pedal_stamp.stamp_ns >= 0) pedals_.push_back({state.pedal_stamp, state.pedals});
  if (state.setting_stamp.stamp_ns >= 0) {
    settings_.push_back({state.setting_stamp, state.cut_W, state.coag_W, state.blend_W});
  }
  return true;
}

}  // namespace fulcrum
