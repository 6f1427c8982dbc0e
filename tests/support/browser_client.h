// The operator's page in headless Chromium, with a session that a person on the page operates. A script drives the
// browser (tests/integration/console/npm/remote.mjs) and takes orders, one a line.
#pragma once

#include <cstdio>
#include <filesystem>
#include <string>

#include "tests/support/mouse_and_keyboard.h"

namespace fulcrum::testing {

class BrowserClient final : public MouseAndKeyboard {
 public:
  /// Starts a console in DDS domain `domain` and, from its page, a session of `scene`. @param npm folder of the driver,
  /// made where it is missing.
  BrowserClient(const std::string& scene, int domain, const std::filesystem::path& npm);
  /// Stops the session from the page and ends the console.
  ~BrowserClient() override;
  BrowserClient(const BrowserClient&) = delete;
  BrowserClient& operator=(const BrowserClient&) = delete;

  /// Waits until the page has the controls. False: it failed (Said), or cannot be had here (missing).
  bool Begin();
  /// Why there is no browser; empty: there is one.
  [[nodiscard]] std::string missing() const;
  [[nodiscard]] std::filesystem::path session() const { return session_; }
  [[nodiscard]] std::string Said() const;
  /// Ends the session from the page. True: it is reported and the page had no trouble.
  bool End();

  void Move(int x, int y) override;
  void MoveDeep(int pixels) override;
  void Press(const std::string& key, bool down) override;

 private:
  void Order(const std::string& line);

  std::filesystem::path log_, session_;
  std::FILE* orders_ = nullptr;
};

}  // namespace fulcrum::testing
