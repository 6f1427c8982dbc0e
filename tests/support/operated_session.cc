#include "tests/support/operated_session.h"

#include <chrono>
#include <csignal>
#include <cstdlib>
#include <optional>
#include <thread>
#include <utility>
#include <vector>

#include "tests/support/browser_client.h"
#include "tests/support/cart.h"
#include "tests/support/virtual_screen.h"
#include "tests/support/xclient.h"

namespace fulcrum::testing {
namespace {

namespace fs = std::filesystem;

constexpr double kPatience_s = 60;

class Window final : public OperatedSession {
 public:
  Window(const std::string& scene, int domain, std::vector<std::string> options) : OperatedSession(domain) {
    if (screen_.display().empty()) return;
    ::setenv("DISPLAY", screen_.display().c_str(), 1);
    options.insert(options.end(), {"--hands", "mouse"});
    cart_.emplace(scene, domain, options);
    client_.emplace(screen_.display());
  }
  [[nodiscard]] std::string missing() const override {
    return screen_.installed() ? "" : "Xvfb is not installed; apt install xvfb";
  }
  [[nodiscard]] MouseAndKeyboard& hand() override { return *client_; }
  [[nodiscard]] bool End() override {
    cart_->Signal(SIGINT);
    return cart_->FaultAtEnd(kPatience_s).empty();
  }
  [[nodiscard]] std::string Said() const override { return cart_ ? cart_->Said() : "no X server"; }

 private:
  bool Await() override {
    return cart_ && WaitFor(kPatience_s, [&] { return fs::exists(cart_->session() / "scene.fulcrum"); }) &&
           WaitFor(kPatience_s, [&] { return client_->FindWindow("Fulcrum"); });
  }
  void TakeControls() override { client_->Click("Return"); }
  [[nodiscard]] fs::path folder() const override { return cart_->session(); }

  VirtualScreen screen_;
  std::optional<Cart> cart_;
  std::optional<XClient> client_;
};

class Browser final : public OperatedSession {
 public:
  Browser(const std::string& scene, int domain, const fs::path& npm)
      : OperatedSession(domain), client_(scene, domain, npm) {}
  [[nodiscard]] std::string missing() const override { return client_.missing(); }
  [[nodiscard]] MouseAndKeyboard& hand() override { return client_; }
  [[nodiscard]] bool End() override { return client_.End(); }
  [[nodiscard]] std::string Said() const override { return client_.Said(); }

 private:
  bool Await() override { return client_.Begin(); }
  void TakeControls() override {}  // The page has taken them.
  [[nodiscard]] fs::path folder() const override { return client_.session(); }

  BrowserClient client_;
};

}  // namespace

std::string OperatedSession::Begin() {
  if (!Await()) return "the session does not come\n" + Said();
  scene_ = std::make_unique<scene::SceneFile>(fs::canonical(folder() / "scene.fulcrum"));
  eyes_ = std::make_unique<Eyes>(domain_);
  const bool ready = WaitFor(kPatience_s, [&] {
    eyes_->Look();
    return eyes_->Ready();
  });
  if (!ready) return "the tools do not come\n" + Said();
  TakeControls();
  std::this_thread::sleep_for(std::chrono::milliseconds(300));
  return {};
}

std::unique_ptr<OperatedSession> WindowSession(const std::string& scene, int domain, std::vector<std::string> options) {
  return std::make_unique<Window>(scene, domain, std::move(options));
}

std::unique_ptr<OperatedSession> BrowserSession(const std::string& scene, int domain, const fs::path& npm) {
  return std::make_unique<Browser>(scene, domain, npm);
}

}  // namespace fulcrum::testing
