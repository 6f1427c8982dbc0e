// A program that is led from the page: a calibration, a replay. It believes in a terminal.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "services/session/console/screen_text.h"
#include "services/session/supervisor/child_process.h"

namespace fulcrum::console {

class GuidedTask {
 public:
  /// Starts it. Throws InputError. Call from the main thread.
  GuidedTask(std::string title, const std::filesystem::path& program, const std::vector<std::string>& arguments);
  ~GuidedTask();
  GuidedTask(const GuidedTask&) = delete;
  GuidedTask& operator=(const GuidedTask&) = delete;

  /// Takes what the program has said, and its end. True when anything has changed.
  bool Poll(std::int64_t now_ns);
  /// Presses Enter.
  void Enter();
  /// As Ctrl-C does; a program that does not end within 3 s is killed.
  void Cancel(std::int64_t now_ns);

  [[nodiscard]] const std::string& title() const { return title_; }
  [[nodiscard]] std::string text() const { return screen_.Text(); }
  [[nodiscard]] bool running() const { return process_.running(); }
  /// It asks for Enter and waits.
  [[nodiscard]] bool wants_enter() const;
  [[nodiscard]] bool cancelled() const { return kill_ns_ != 0; }
  /// Once it has ended.
  [[nodiscard]] const std::optional<supervisor::ProcessEnd>& end() const { return end_; }

 private:
  bool Read();

  std::string title_;
  int terminal_ = -1;  ///< Our side.
  supervisor::ChildProcess process_;
  ScreenText screen_;
  std::optional<supervisor::ProcessEnd> end_;
  std::int64_t kill_ns_ = 0;  ///< When patience with a cancelled one ends; 0: not cancelled.
};

}  // namespace fulcrum::console
