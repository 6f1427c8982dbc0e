// Sessions that this console starts: `fulcrum up` as a child, which goes on when the console ends.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "services/session/supervisor/child_process.h"

namespace fulcrum::console {

struct SessionOrder {
  std::string scene;
  std::optional<double> power_W, seconds, picture_rate_Hz;
  bool record = true;
};

struct SessionRunSettings {
  std::filesystem::path program;  ///< fulcrum
  std::filesystem::path out;
  std::filesystem::path cart;  ///< Empty: everything simulated.
  std::filesystem::path data;  ///< Empty: the scene's own.
  int domain = 7;
};

/// How a session ended.
struct SessionEnd {
  bool well = false;
  std::string text;  ///< For people, one line.
};

/// Words of `fulcrum up` for an order.
[[nodiscard]] std::vector<std::string> UpWords(const SessionRunSettings& settings, const SessionOrder& order);

class SessionRun {
 public:
  explicit SessionRun(SessionRunSettings settings);

  /// Throws InputError. Call from the main thread.
  void Start(const SessionOrder& order);
  /// Ends a session that was started here; it writes its report first.
  void Stop();
  /// Sees whether it has ended.
  void Poll();

  [[nodiscard]] bool running() const { return up_.running(); }
  [[nodiscard]] bool stopping() const { return stopping_; }
  [[nodiscard]] bool recording() const { return running() && recording_; }
  [[nodiscard]] const SessionRunSettings& settings() const { return settings_; }
  /// What `fulcrum up` says at the moment.
  [[nodiscard]] std::string LastWord() const;
  /// Of the last one; nothing before and while one runs.
  [[nodiscard]] const std::optional<SessionEnd>& end() const { return end_; }
  /// What is kept of the past in memory for a dump [s].
  static constexpr int kKeep_s = 30;

 private:
  SessionRunSettings settings_;
  std::filesystem::path log_;
  supervisor::ChildProcess up_;
  bool stopping_ = false, recording_ = false;
  std::optional<SessionEnd> end_;
};

}  // namespace fulcrum::console
