#include <chrono>
#include <cstdio>
#include <thread>

#include "services/apps/fulcrum/commands.h"
#include "services/base/core/error.h"
#include "services/session/supervisor/domain_guard.h"
#include "services/session/supervisor/session_view.h"

namespace fulcrum::supervisor::cli {

ExitCode Status(const Words& words) {
  boost::program_options::options_description options;
  AddDomain(&options);
  const Arguments arguments = Parse("status", words, options);
  if (arguments.help) {
    return ExitCode::kDone;
  }
  const int domain = DomainOf(arguments);
  if (const std::string other = DomainGuard::OtherUsers(domain); !other.empty()) {
    std::printf("%s\n", other.c_str());
    return ExitCode::kFailure;
  }
  if (!DomainGuard::IsHeld(domain)) {
    std::printf("no session runs in domain %d\n", domain);
    return ExitCode::kFailure;
  }
  // A supervisor that has just started opens its bus a little after it has reserved its domain.
  constexpr auto kStart = std::chrono::seconds(2);
  const auto begin = std::chrono::steady_clock::now();
  while (RunningSession(domain) == 0 && std::chrono::steady_clock::now() - begin < kStart) {
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  SessionView view(domain);
  // Late joiners receive the newest Health at once, and each node sends one at 10 Hz: when no new node has reported for
  // this time, all running nodes have. On a secured cart the nodes authenticate one after the other.
  constexpr auto kListen = std::chrono::milliseconds(700);
  // A participant that the supervisor refuses gets no reply, so the wait for the first Health is limited.
  constexpr auto kPatience = std::chrono::seconds(4);
  int heard = 0;
  auto newest = std::chrono::steady_clock::now();
  for (auto now = newest; now - newest < (view.has_supervisor() ? kListen : kPatience);
       now = std::chrono::steady_clock::now()) {
    view.Update();
    if (view.heard() > heard) {
      heard = view.heard();
      newest = now;
    }
    if (const std::string mismatch = view.mismatch(); !mismatch.empty()) throw MismatchError(mismatch);
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  std::fputs(view.Text().c_str(), stdout);
  return ExitCode::kDone;
}

}  // namespace fulcrum::supervisor::cli
