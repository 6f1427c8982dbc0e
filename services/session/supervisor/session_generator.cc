#include "services/session/supervisor/session_generator.h"

#include <algorithm>
#include <chrono>
#include <utility>

#include "services/base/core/error.h"
#include "services/base/runtime/cyclic_thread.h"
#include "services/session/supervisor/watch_times.h"

namespace fulcrum::supervisor {

SessionGenerator::SessionGenerator(std::unique_ptr<bus::Output<GeneratorSetting>> out,
                                   const config::GeneratorConfig& start, std::span<const ScriptKey> script)
    : out_(std::move(out)), stamper_(runtime::MonotonicNs()), panel_(start, script) {
  Publish(runtime::MonotonicNs());
}

CommandAnswer SessionGenerator::Turn(const std::string& words, std::int64_t now_ns) {
  try {
    panel_.Turn(words);
  } catch (const InputError& error) {
    return {false, error.what()};
  }
  if (!words.empty()) Publish(now_ns);
  return {true, "generator: " + panel_.Text()};
}

void SessionGenerator::Follow(const SessionClock& clock, std::int64_t now_ns) {
  // A turn ahead: readers apply a setting from its stamp on, which must not have passed when it arrives.
  constexpr double kAhead_s = std::chrono::duration<double>(kSessionPeriod).count();
  if (!clock.begun() || !panel_.Follow(clock.At(now_ns) + kAhead_s)) return;
  Publish(clock.start_ns() + static_cast<std::int64_t>(1e9 * panel_.turned_s()));
}

void SessionGenerator::Publish(std::int64_t from_ns) {
  // Readers apply settings in the order of their stamps, so stamps must increase.
  newest_ns_ = std::max(from_ns, newest_ns_ + 1);
  GeneratorSetting setting = panel_.setting();
  setting.stamp = stamper_.Next(newest_ns_);
  out_->Write(setting);
}

}  // namespace fulcrum::supervisor
