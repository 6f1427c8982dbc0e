// A calibration or replay that the operator controls from the page. Its program runs on a pseudo-terminal.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "services/base/runtime/child_process.h"
#include "services/session/console/screen_text.h"

namespace fulcrum::console {

class GuidedTask {
 public:
  /// Starts the program. Throws InputError. Call from the main thread.
  GuidedTask(std::string title, const std::filesystem::path& program, const std::vector<std::string>& arguments);
  ~GuidedTask();
  GuidedTask(const GuidedTask&) = delete;
  GuidedTask& operator=(const GuidedTask&) = delete;

  /// Reads the program's output and detects its end. True when either has changed.
  bool Poll(std::int64_t now_ns);
  /// Sends Enter to the program.
  void Enter();
  /// Sends SIGINT; a program that does not end within 3 s is killed.
  void Cancel(std::int64_t now_ns);

  [[nodiscard]] const std::string& title() const { return title_; }
  [[nodiscard]] std::string text() const { return screen_.Text(); }
  [[nodiscard]] bool running() const { return process_.running(); }
  /// True when the program waits for Enter.
  [[nodiscard]] bool wants_enter() const;
  [[nodiscard]] bool cancelled() const { return kill_ns_ != 0; }
  /// How the program ended; nullopt while it runs.
  [[nodiscard]] const std::optional<runtime::ProcessEnd>& end() const { return end_; }

 private:
  bool Read();

  std::string title_;
  int terminal_ = -1;  ///< The console's side of the pseudo-terminal.
  runtime::ChildProcess process_;
  ScreenText screen_;
  std::optional<runtime::ProcessEnd> end_;
  std::int64_t kill_ns_ = 0;  ///< Time of SIGKILL after Cancel; 0: not cancelled.
};

}  // namespace fulcrum::console
