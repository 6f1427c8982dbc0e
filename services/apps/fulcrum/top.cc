#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <thread>

#include "services/apps/fulcrum/commands.h"
#include "services/base/core/error.h"
#include "services/base/runtime/realtime.h"
#include "services/session/supervisor/domain_guard.h"
#include "services/session/supervisor/session_view.h"

namespace fulcrum::supervisor::cli {

ExitCode Top(const Words& words) {
  boost::program_options::options_description options;
  AddDomain(&options);
  const Arguments arguments = Parse("top", words, options);
  if (arguments.help) {
    return ExitCode::kDone;
  }
  const int domain = DomainOf(arguments);
  if (const std::string other = DomainGuard::OtherUsers(domain); !other.empty()) throw InputError(other);
  if (!DomainGuard::IsHeld(domain)) {
    throw InputError("no session runs in domain " + std::to_string(domain) + "; start one with fulcrum up SCENE");
  }
  SessionView view(domain);
  const bool terminal = ::isatty(STDOUT_FILENO) == 1;
  constexpr auto kRefresh = std::chrono::milliseconds(500);
  auto next = std::chrono::steady_clock::now() + kRefresh;
  while (!runtime::ShouldStop() && !OutputHasEnded() && DomainGuard::IsHeld(domain)) {
    view.Update();
    if (const std::string mismatch = view.mismatch(); !mismatch.empty()) throw MismatchError(mismatch);
    if (std::chrono::steady_clock::now() >= next) {
      next += kRefresh;
      // Clears the screen before each new text, so that no line of an earlier text stays.
      std::printf("%s%s%s\n", terminal ? "\x1b[H\x1b[2J" : "", view.Text().c_str(),
                  terminal ? "Ctrl-C ends this view" : "");
      std::fflush(stdout);
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
  return ExitCode::kDone;
}

}  // namespace fulcrum::supervisor::cli
