// A session that a person operates, from its window or from the console's page, up to the moment when the controls are
// taken.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "services/scene/format/scene_file.h"
#include "tests/support/mouse_operator.h"

namespace fulcrum::testing {

class OperatedSession {
 public:
  virtual ~OperatedSession() = default;
  /// Waits until the controls are taken and both tools are there. What went wrong; empty: nothing.
  [[nodiscard]] std::string Begin();
  /// What is missing on this machine for such a session; empty: nothing. Known after Begin.
  [[nodiscard]] virtual std::string missing() const = 0;
  [[nodiscard]] virtual MouseAndKeyboard& hand() = 0;
  [[nodiscard]] Eyes& eyes() { return *eyes_; }
  [[nodiscard]] const SceneView& scene() const { return scene_->view(); }
  /// Ends the session. True: all was well; in a window also if nodes ran too slowly for their periods.
  [[nodiscard]] virtual bool End() = 0;
  [[nodiscard]] virtual std::string Said() const = 0;

 protected:
  explicit OperatedSession(int domain) : domain_(domain) {}
  /// Waits until the session runs and the controls can be, or are, taken. False: it does not come.
  virtual bool Await() = 0;
  virtual void TakeControls() = 0;
  [[nodiscard]] virtual std::filesystem::path folder() const = 0;

 private:
  int domain_;
  std::unique_ptr<scene::SceneFile> scene_;
  std::unique_ptr<Eyes> eyes_;
};

/// `fulcrum up SCENE --hands mouse OPTIONS` on an X server of its own.
[[nodiscard]] std::unique_ptr<OperatedSession> WindowSession(const std::string& scene, int domain,
                                                             std::vector<std::string> options = {});
/// A session of the console's page in headless Chromium. @param npm folder of the driver, made where it is missing.
[[nodiscard]] std::unique_ptr<OperatedSession> BrowserSession(const std::string& scene, int domain,
                                                              const std::filesystem::path& npm);

}  // namespace fulcrum::testing
