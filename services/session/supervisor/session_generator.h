// The generator of a running session: its panel, and the topic on which its setting is published.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "services/session/supervisor/command_desk.h"
#include "services/session/supervisor/generator_panel.h"
#include "services/session/supervisor/session_clock.h"
#include "services/transport/bus/input_account.h"
#include "services/transport/bus/port.h"

namespace fulcrum::supervisor {

class SessionGenerator {
 public:
  /// Publishes the setting at the start. `start` and `script` as for GeneratorPanel; `script` must outlive this.
  SessionGenerator(std::unique_ptr<bus::Output<GeneratorSetting>> out, const config::GeneratorConfig& start,
                   std::span<const ScriptKey> script);

  /// @param words as for GeneratorPanel::Turn; without words the reply contains the present setting.
  CommandAnswer Turn(const std::string& words, std::int64_t now_ns);
  /// Publishes changes by the script, with the stamp of the script's key. Does nothing before session time 0.
  void Follow(const SessionClock& clock, std::int64_t now_ns);

  /// The present setting, without a stamp.
  [[nodiscard]] const GeneratorSetting& setting() const { return panel_.setting(); }

 private:
  /// @param from_ns CLOCK_MONOTONIC from which the setting is valid [ns].
  void Publish(std::int64_t from_ns);

  std::unique_ptr<bus::Output<GeneratorSetting>> out_;
  bus::Stamper stamper_;
  GeneratorPanel panel_;
  std::int64_t newest_ns_ = 0;  ///< Stamp of the newest GeneratorSetting.
};

}  // namespace fulcrum::supervisor
