#include <chrono>
#include <stdexcept>
#include <thread>

#include "services/apps/fulcrum/commands.h"
#include "services/session/supervisor/domain_guard.h"

namespace fulcrum::supervisor::cli {

ExitCode Down(const Words& words) {
  boost::program_options::options_description options;
  AddDomain(&options);
  const Arguments arguments = Parse("down", words, options);
  if (arguments.help) {
    return ExitCode::kDone;
  }
  const int domain = DomainOf(arguments);
  const ExitCode answer = Ask(domain, "down", "");
  // Waits until the session has ended, so that the next one can start at once. A recorder with a slow disk may take
  // half a minute (services/nodes/app/longest_end.h).
  constexpr auto kPatience = std::chrono::seconds(60);
  const auto begin = std::chrono::steady_clock::now();
  while (DomainGuard::IsTaken(domain)) {  // Also another user's, which the command has reached.
    if (std::chrono::steady_clock::now() - begin > kPatience) {
      throw std::runtime_error("the session has not ended within 60 s; see fulcrum status");
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
  return answer;
}

}  // namespace fulcrum::supervisor::cli
