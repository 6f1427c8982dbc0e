#include "services/session/supervisor/ask.h"

#include <cstdio>

#include "services/apps/fulcrum/commands.h"

namespace fulcrum::supervisor::cli {

ExitCode Ask(int domain, const std::string& verb, const std::string& argument) {
  const control::Reply reply = AskSupervisor(domain, verb, argument);
  std::fprintf(reply.ok ? stdout : stderr, "%s\n", reply.text.c_str());
  return reply.ok ? ExitCode::kDone : ExitCode::kFailure;
}

}  // namespace fulcrum::supervisor::cli
